"""The sound of a driveline: impacts of a run, or a measured signal, as sound pressure in a WAV file.

* ``impulse_train``: impulses at their exact times as band-limited samples.
* ``transfer_path``: sound pressure from an impulse, by damped modes or by a measured impulse response.
* ``listen``: one or more runs or recordings through one transfer path, with one gain.
* ``resample``: a signal at another sampling rate.
* ``sound_page``: the presentation of a sound.
* ``psychoacoustics``: loudness, sharpness and roughness.
"""
