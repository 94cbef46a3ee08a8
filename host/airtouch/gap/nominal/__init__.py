"""What the baseline flights say: the vehicle, the floors, how strong each effect seems in them.

`consistency` leaves out flights that are unlike the others. `calibrate` fits the vehicle to the rest, by turns with
`build_study`, which measures floor, loop and response of a vehicle with given parameters. `apparent` fits every effect
to flights that have none, and so knows what strength is nothing.
"""
