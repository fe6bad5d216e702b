"""The sound of a driveline: impacts of a run, or a measured signal, as sound pressure in a WAV file.

* ``transfer_path``: how an impulse becomes sound pressure somewhere: damped modes, or a measured impulse response.
* ``listen``: one or more runs or recordings through one path, at one gain.
* ``sound_page``: how a sound is presented.
* ``psychoacoustics``: loudness, sharpness, roughness and impulsiveness.
"""
