"""Which effects are named.

What an effect must show to be named stands in `policy`, with what depends on the kind of flights; numbers of a
computation stand beside it.

`select` is called by the diagnosis. Every candidate is judged alone (`rounds`): screened (`screening`) by its
`first_order`, then fitted on one half of the flights and judged on the other (`judging`). Where a library holds, the
relations of signals name the effects (`by_relations`). Else an effect that comes and goes is tried first
(`passing_effect`), and effects are added one by one (`forward`) while each gains enough (`thresholds`).
`leave_one_out` has what each adds to the others, `over_prediction` their over-prediction. The result is a `Selection`
(`records`); `gap_closure` has the fraction of the gap that effects of recorded flights must close.
"""
