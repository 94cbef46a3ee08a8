"""What the diagnosis knows of each effect.

`signature`: how it is fitted and where it shows, one record an effect; a `term` is one variant of it in a hypothesis,
`candidates` are all; `alike`: names of one thing. `scatter`: how strong it seems in nominal flights, by the table
`nominal_scatter.toml` and the baseline flights (`scatter_estimates`, `posterior`). `random_draws`: how simulated
flights with it are drawn, for sealed sets and for learning.
"""
