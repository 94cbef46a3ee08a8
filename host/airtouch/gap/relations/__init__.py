"""The effects in a flight by its features, compared with simulated flights of each effect and without any.

**What is modelled.** Coordinates z of a flight (Q of them, `features.feature_space`) are normal, log densities in nats:

    nominal                          N(0, 1)
    effect of strength s             N(m(s), 1 + |m|^2 A V A')       `effect_class`: curve m, scatter A V A' about it
    two effects                      N(m1 + m2, 1 + both scatters + min(|m1|, |m2|)^2 I I')     I: they are no sum
    a nameless disturbance           N(0, 1 + d^2 N N'), averaged over lengths d                  N: its directions

`density` finds the likeliest strength of one class and averages over all that it may have; `hypotheses` does so for
several classes and for a nameless disturbance.

**What is inferred** (`inference`). Effects are added one by one while each gains enough evidence; what then still
speaks against them decides whether they are named. `readout` turns a strength into the effect's own units.

**What is learned.** `build` simulates flights with each effect (`learning`) and with nameless disturbances
(`exposure`), learns the model and stores it in a `library`; `calibration` measures on other flights how far right
names lie. `own_effect` adds a class of a user's own effect. `settings` holds how many flights each of them takes.
"""
