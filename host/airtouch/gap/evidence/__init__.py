"""How likely flights are under effects.

**What is modelled.** What the model leaves of the spectra of some blocks, n complex values, log densities in nats:

    residual      r = g(x) - sum b c                    g: the gap under mean effects (`problem`)
    power         P = floor + random + loop             `flattened`; `random_effects`, `vibration_lines`; `torque_power`
    likelihood    -w sum[log P + (nu + 1) log(1 + |r|^2 / (a P))]     `likelihood`; w: OVERLAP_WEIGHT, as blocks overlap
    tails         E[(nu + 1) e / (a + e)] = 1           a: `tail_scale`, for e = |r|^2 / P exponential with mean 1
    priors        x ~ N(0, s^2), b ~ N(0, spread^2)     `fit`, `gauss_newton`; x in natural steps, s: PRIOR_UNITS

x: parameters of mean effects (s: COMMAND_PRIOR at most where only the commands show them); b, c: an offset of a channel
of a flight and its column; nu: degrees of freedom of the floor, which is estimated from few flights. The commands'
floor is corrected anew under each hypothesis, which costs nats beside the sum (`signals.command_view`).

**Words.**

- A *mean* effect changes the expected complex values of the spectra, so that it can be subtracted: a force, a delay. A
  *random* effect adds power of unknown phase: noise, turbulence. An effect of the *clock* shows in the logged times
  alone (MEAN, SPECTRUM and CLOCK in `signatures.signature`).
- *Scaled* parameters are counted in natural steps from neutral (`signatures.term`): at 0 the effect does nothing.
- A *view* is one way to look at a flight: the *replay* of the logged commands in the air, the same at *rest* on the
  ground, and the *commands*, which change as the control loop reacts to effects.
- A *block* is a stretch of samples of which one spectrum is taken. A *cell* is one channel in one band of one view.
- *Evidence*, *gain* and *cost* are in nats.

**How.** `data` holds the spectra of some flights and keeps what is worked out of them. A part of their blocks is
`flattened` to one array of values (`layout`, by `cells` of channel and band). A `problem` is these values under
hypotheses. `fit` finds the parameters: of mean effects by `gauss_newton` (`slopes`, `least_squares`), of random ones by
their strength (`random_strength`). `judge` says how likely other blocks are under them. `clock` judges what shows in
the log's times alone. `against` is the evidence against the named effects, whoever measures it.
"""
