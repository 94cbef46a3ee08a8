"""Which effects are named: candidates are judged by what they gain on held-out flights, and added one by one.

`select` is called by the diagnosis. Each file decides one thing, by the function in brackets. A module imports those
below it only, in this order:

select           whether the replay or the relations of signals name the effects (`select`, `replay_may_name`)
gap_closure      whether they close enough of the gap of recorded flights to keep their names (`least_shrink`)
by_relations     which effects the relations of signals name, fitted beside one another (`selection_by_relations`)
passing_effect   whether an effect acts for some seconds only, tried before those that always act (`passing_effect`);
                 how much less steady the flights are than nominal ones (`unsteadiness_rarity`)
forward          which effect is added next, whether it is named, and when no more is added (`forward`, `_best_of`)
leave_one_out    what each of several effects adds to the others (`with_leave_one_out_gains`)
over_prediction  how much the effects named predict that the flights do not show (`over_prediction_of`)
rounds           in one round, which variants are fitted and which hypothesis of each candidate is best (`round_of`)
screening        what every variant promises, at a fraction of what its fit would cost (`screen.screen_variants`)
thresholds       what a further effect must gain (`least_further_gain`)
evidence         how much of a gain counts, as nominal flights seem to have the effect too (`with_evidence`)
judging          what one hypothesis gains, fitted on one half of the flights, judged on the other (`cross_validated`)
unknown          whether what speaks against the effects named makes the answer `unknown` (`is_explained`)
records          the words: `Hypothesis`, `Step`, `Selection` and what they are made of
policy           the numbers by which effects are named, and how they depend on the kind of flights (`policy_of`)

What the verdict makes of a selection is decided in `answer.ranking.verdict_of`.

The quantities, in nats unless a unit is given:

    gain             held-out log likelihood over no effect, less price and choice cost (`judging`)
    charges          what is subtracted from a gain, or added, beside the price (`records.Charges`)
    price            of each free parameter of a term beyond its first (`judging.price_of`)
    evidence         gain over the base, limited by how rare the strength is in nominal flights (`evidence`)
    merit            gain / TEMPERATURE + evidence up to CERTAIN: the order of hypotheses (`forward`)
    misfit           what a further effect may gain because the models before it are wrong (`thresholds`)
    limit            what may speak against effects that are right (`policy.UnknownLimit`)
    over_prediction  lost where effects predict what the flights do not show (`over_prediction`)
    rarity           by how much flights are less steady than nominal ones (`records.UnsteadinessRarity`)
"""
