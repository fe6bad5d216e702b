"""The sound of a driveline: impacts of a run, or a measured signal, as sound pressure in a WAV file.

* ``train``: impulses at their exact times as band-limited samples.
* ``path``: how an impulse becomes sound pressure somewhere: damped modes, or a measured impulse response.
* ``listen``: one or more runs or recordings through one path, at one gain.
* ``sound_page``: how a sound is presented.
* ``quality``: loudness, sharpness, roughness and impulsiveness.
"""
