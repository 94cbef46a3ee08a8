"""What is compared: measured minus modelled by channel, spectra in blocks, and the floors of both.

`channels.residual` replays a flight's commands through the model and takes what was measured minus that. `spectra` cuts
it into blocks and measures the floor on nominal flights. Two corrections make it fair: `response`, as only a part of a
logged command's torque turns the vehicle, another part in blocks in which a set-point stepped (`quiet_blocks` tells
these), and `lost_rows`, as straight lines across lost rows add power. Commands are not replayed but judged by their
spectra: `command_view`, with a floor that each flight may correct: `floor_correction`. `study` holds all that flights
are compared with.
"""
