"""Which effects are named.

`select` is called by the diagnosis. Every candidate is judged alone (`rounds`): a first look (`looks`, `screen`), then
fitted on one half of the flights and judged on the other (`judging`). Where a library holds, the relations of signals
name the effects (`related`). Else an effect that comes and goes is tried first (`passing_effect`), and effects are
added one by one (`forward`) while each gains enough (`thresholds`); `shares` says what each adds to the others,
`contradiction` what they say that is not there. The result is a `selection`; `recorded` says when recorded flights may
name an effect at all.
"""
