"""The effects in a flight by its features, compared with simulated flights of each effect and without any.

**What is modelled.** Coordinates z of a flight (Q of them, `features.feature_space`) are normal:

    nominal                          N(0, 1)
    effect of strength s             N(m(s), 1 + |m|^2 A V A')       `effect_class`: curve m, scatter A V A' about it
    two effects                      N(m1 + m2, 1 + both scatters + min(|m1|, |m2|)^2 I I')     I: they are no sum
    a nameless disturbance           N(0, 1 + d^2 N N'), averaged over lengths d                  N: its directions

`density` finds the likeliest strength of one class, with the log density of the flight there, and the log marginal
likelihood, which averages over all strengths that it may have. `hypotheses` compares several classes, or a nameless
disturbance, with no effect: a log likelihood ratio, and the evidence. All of these are in nats.

**What is inferred** (`inference`). Effects are added one by one while each gains enough evidence. The counterevidence,
against those that were added, decides whether they are named. `readout` turns a strength into the effect's own units.

**What is learned.** `build` simulates flights with each effect (`learning`) and with nameless disturbances
(`exposure`, of `nameless_effects`), learns the model and stores it in a `library`. `calibration` measures on other
flights how far they lie from the right effects. `own_effect` adds a class of a user's own effect. `settings` holds how
many flights each of them takes.
"""
