"""The radio link through cflib: connecting, log blocks and their packets, parameters, the drone's clock."""
