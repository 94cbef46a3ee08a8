"""What is compared: residuals by channel, their spectra in blocks, and the floors of nominal flights.

`channels.residual` replays a flight's commands through the model and takes what was measured minus that. `spectra` cuts
it into blocks, and `floor` measures on nominal flights what power these have. Two corrections make it fair: `response`,
as only a part of a logged command's torque turns the vehicle, another part in blocks in which a set-point stepped
(`quiet_blocks` tells these), and `lost_rows`, as straight lines across lost rows add power.

Commands are not replayed but judged by their spectra: `command_view`. Their floor is `ClosedLoop.floor`, which
`loop.identify` measures, not the columns of commands in `floor.Floor.power`; each flight may correct it:
`command_floor_correction`. All that flights are compared with is a `study`, beside the folders.
"""
