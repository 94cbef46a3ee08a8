"""The nameless model: what may be left of the residual beside the effects named, without saying why.

- `model`: how much it gains on held-out data. `naming.select` asks for that, which decides on `unknown`, and
  `naming.passing_effect` for the gain of the height alone; `nominal.calibrate` asks how coefficients and powers scatter
  in nominal flights.
- `regression`: its first part, of the residual on `columns`, the spectra of the flight's own signals (`basis`).
- `powers`: its second part, a free factor on the power of every cell.
"""
