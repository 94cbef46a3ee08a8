"""What no named effect explains: the nameless model of the residual that a hypothesis leaves.

`model` asks how much it gains on held-out data. First comes the `regression` of the residual on `columns`: the spectra
of the flight's own signals (`basis`); on top of it come free `powers` of every cell. `naming.select` asks for its
gain, which decides on `unknown`, and `naming.passing_effect` for that of the height alone; `nominal.calibrate` measures
how coefficients and powers scatter in nominal flights.
"""
