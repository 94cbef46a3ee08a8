"""Which effects are named: candidates are judged by what they gain on held-out flights, and added one by one.

`select` is called by the diagnosis. A module imports those below it only, in this order:

select           the selection, by the replay or by the relations of signals
gap_closure      the fraction of the gap that effects of recorded flights must close
by_relations     the effects that the relations of signals name, fitted beside one another
passing_effect   an effect that acts for some seconds only, tried before those that always act
forward          effects added one by one, each beside those before it
leave_one_out    what each of several effects adds to the others
over_prediction  where the effects named predict what the flights do not show
rounds           one round: every candidate beside the same base, screened, then fitted
screening        every variant judged at a fraction of what its fit would cost
thresholds       what a further effect must gain
evidence         how the scatter of nominal flights limits the evidence for an effect
judging          one hypothesis fitted on one half of the flights and judged on the other
unknown          what speaks against the effects named, and when the answer is `unknown`
records          the result: candidates, steps, selection
policy           the numbers by which effects are named, and how they depend on the kind of flights

The quantities, in nats unless a unit is given:

    gain             held-out log likelihood over no effect, less price and choice cost (`judging`)
    charges          what a gain is charged with, or given back, beside the price (`records.Charges`)
    price            of each free parameter of a term beyond its first (`judging.price_of`)
    evidence         gain over the base, limited by how rare the strength is in nominal flights (`evidence`)
    merit            gain / TEMPERATURE + evidence up to CERTAIN: the order of candidates (`forward`)
    misfit           what a further effect may gain because the models before it are wrong (`thresholds`)
    limit            what may speak against effects that are right (`policy.UnknownLimit`)
    over_prediction  lost where effects predict what the flights do not show (`over_prediction`)
"""
