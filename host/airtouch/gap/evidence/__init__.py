"""How likely flights are under effects.

**What is modelled.** The residual, measured minus modelled, of the spectra of some blocks: n complex values. Log
densities are in nats.

    residual      r = r(x) - sum b c                    r(x): under mean effects (`problem`)
    power         P = floor + extra                     expected of |r|^2, unit^2/Hz; floor: of no effect (`flattened`)
    extra power   random + loop                         `random_effects`, `vibration_lines`; `torque_power`
    likelihood    -w sum[log P + (nu + 1) log(1 + |r|^2 / (a P))]     `likelihood`; w: OVERLAP_WEIGHT, as blocks overlap
    tails         E[(nu + 1) e / (a + e)] = 1           a: `tail_scale`, for e = |r|^2 / P exponential with mean 1
    priors        x ~ N(0, s^2), b ~ N(0, t^2)          `fit`, `gauss_newton`; x in natural steps, s: PRIOR_STD

x: parameters of mean effects (s: COMMAND_PRIOR_STD at most where only the commands show them); b, c: an offset of a
channel of a flight and its column; t: how far nominal flights' offsets scatter; nu: degrees of freedom of the floor,
which is estimated from few flights. The commands' floor is corrected anew under each hypothesis, which costs nats
beside the sum (`signals.command_view`).

**Words.**

- A *mean* effect changes the expected complex values of the spectra, so that it can be subtracted: a force, a delay. A
  *random* effect adds power of unknown phase: noise, turbulence. An effect of the *clock* shows in the logged times
  alone (MEAN, SPECTRUM and CLOCK in `signatures.signature`).
- *Scaled* parameters are counted in natural steps from neutral (`signatures.term`): at 0 the effect does nothing.
- A *view* is one way to look at a flight: the *replay* of the logged commands in the air, the same at *rest* on the
  ground, and the *commands*, which change as the control loop reacts to effects.
- A *block* is a stretch of samples of which one spectrum is taken. A *cell* is one channel in one band of one view.
- A block's *state* is in the air or at rest on the ground.
- *Floor power* is expected of the residual without effects, *extra power* is what a hypothesis adds, and *expected
  power* is their sum.
- *Evidence*, *gain* and *cost* are in nats.
- A constant that is called *chosen* is a judgement: no measurement is behind it, unless its comment names one.

**How.** `data` holds the residual spectra of some flights and caches what is worked out of them. A set of their blocks
is `flattened` to one array of values (`layout`, by `cells` of channel and band). A `problem` is these values under
hypotheses. `fit` finds the parameters: of mean effects by `gauss_newton` (`slopes`, `least_squares`), of random ones by
their strength (`random_strength`). `judge` says how likely other blocks are under them. `clock` judges what shows in
the log's times alone. `counterevidence` is the evidence against the named effects, whoever measures it.
"""
