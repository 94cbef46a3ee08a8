"""The numbers by which effects are named: what they must gain, share and close, and how that depends on the flights.

A constant holds for all flights. What depends on the study that they are compared with stands in `NamingPolicy`, and
`policy_of` alone makes it of the study. Numbers of a computation stand beside it: how halves are made and when a
parameter is at its bound in `judging`, steps and iterations in `screening.first_order`.
"""

from dataclasses import dataclass

from airtouch.gap.study import Study

# -- Gains required, nats of held-out data --

#: that a further effect must add, and the first one in recorded flights or where no loop is modelled; chosen
#: 2026-11-21: a likelihood ratio of 12 nats has by chance at most the probability e^-12 (Markov's bound), if the models
#: of noise are right
LEAST_GAIN = 12.0
#: that a variant with a random part or a companion must gain over the same effect without (`rounds`)
LONGER_GAIN = LEAST_GAIN
#: by which an effect that gains too little over its companion alone is put behind it (`rounds`)
COMPANION_GAIN = LEAST_GAIN
#: that a passing effect must gain over those that always act, and have as evidence; what it gains up to
#: here counts whatever nominal flights show (`passing_effect`)
PASSING_GAIN = LEAST_GAIN
#: evidence of a mean effect in one round from which the next fits it in full, whatever screening says (`forward`)
SURE_EVIDENCE = LEAST_GAIN
#: that the first effect must gain in simulated flights, where nominal ones gave a loop; chosen, after 6 nats had given
#: 4 false alarms on 46 flights of a fresh set (2026-11-21). In recorded flights 8 nats named an effect in six of 33
#: nominal flights of days that the table of scatter did not know, 12 nats in two (2026-11-26 19:55)
FIRST_GAIN = 8.0
#: that each free parameter of a term beyond its first must gain; a random part or a companion, a term of its own, must
#: gain LONGER_GAIN instead. Chosen, near Akaike's 1 (1974)
PRICE = 0.9
#: nats by which gains are divided before candidates are compared, because likelihoods of recorded flights are
#: overconfident; chosen 2026-11-21. With a larger number the rarer strength outweighs the gain, and probabilities are
#: nearer to one another
TEMPERATURE = 6.0

# -- Search --

#: nats that a random effect must gain in screening to be fitted; a mean effect that gains less is asked whether the
#: commands alone show it. Chosen 2026-11-21: a larger number saves fits and loses weak random effects
HOPELESS = 0.5
#: nats that a variant's mean term may be behind the best in screening and still be fitted with its random part; chosen:
#: odds of 20, as between candidates (`answer.ranking.LEAST_DIFFERENCE`)
ABOUT_AS_GOOD = 3.0
#: nats that a hypothesis must gain in screening to be fitted in full, and the parameters of an effect of the loop
#: together by a brief fit for each to be fitted alone; chosen for time: less means more fits, more loses effects that
#: screening takes for weaker than they are
PROMISING = 0.5 * FIRST_GAIN
#: share of what it must gain, less PROMISING, that an effect of the loop must gain by a brief fit to be fitted in full;
#: chosen for time: in 113 such fits of seven recorded flights the full one gained at most 1.25 times as much and 6 nats
BRIEF_SHARE = 0.75
#: hypotheses judged to first order, the best of them, among which those that gain PROMISING are fitted in full; others
#: are fitted beside these: random effects that promise something, what only a fit can judge, and names that a round is
#: asked to fit (`rounds`). Chosen for time, as PROMISING
BEST_SCREENED = 5
#: effects that are named of one set of flights; chosen 2026-11-21. A fourth would cost one more round of fits
MOST_EFFECTS = 3
#: deviations of nominal flights that are added freely (`forward`); chosen 2026-11-22. With fewer, what nominal flights
#: have as well may be left to the effects named; each more costs a round of fits
MOST_DEVIATIONS = 3
#: nats of evidence beyond which more does not rank a candidate higher (`forward`); chosen 2026-11-22. A larger number
#: lets a rare strength win over a larger gain, a smaller one lets the gain decide sooner
CERTAIN = 20.0
#: of FIRST_GAIN: candidates that gained less are not judged again beside a deviation; chosen, to save their fits
WORTH_AGAIN = 0.25
#: fraction of the evidence for the likeliest effect that a wake must have for the replay to name it, as its shape may
#: differ from that of its class; chosen: three simulated wakes that fill a flight have 0.09 to 0.10, four motor noises
#: that the replay took for a wake 0.01 to 0.02 (host/docs/looks.md, 2026-11-25 11:53)
WAKE_SHARE = 0.05

# -- Misfit: fractions of the nats that the effects of a hypothesis gain --
# No model of an effect is exact. A further effect must gain as much beside them, since what their models are wrong by
# may look like it. A larger share misses weak effects beside strong ones, a smaller one names a model's error.

#: in simulated flights, of what is gained in the cells that the further effect improves; chosen
MISFIT_SHARE_SIMULATED = 0.01
#: of its own gain, in all flights: by which a deviation that nominal flights have as well must gain more than an effect
#: with evidence to be added before it (`forward`)
MISFIT_SHARE_DEVIATION = MISFIT_SHARE_SIMULATED
MISFIT_SHARE_RECORDED = 0.1  #: in all others, of the whole gain; chosen 2026-11-22, as no model of air is exact
#: for an effect that changes the loop, beside one that is random or changes it too, with this project's own firmware;
#: chosen: twice the 5 % that wrong ones gained at most beside right ones in 43 simulated flights (2026-11-23)
MISFIT_SHARE_LOOP_OWN_FIRMWARE = 0.1
#: the same with any other firmware; chosen, as large as the error of the loop model `torque_power.TORQUE_DOUBT`
MISFIT_SHARE_LOOP_OTHER_FIRMWARE = 0.25
#: for a random effect, to be named; chosen. Beside weak motors and offset masses, motor noise that was not there gained
#: 3 to 16 % in simulated flights (host/docs/looks.md, 2026-11-23 19:09): the yaw command of the logged instant is not
#: that of the 10 ms around it
MISFIT_SHARE_RANDOM = 0.25

# -- `unknown` and over-prediction --
# How these make a limit: host/docs/unknown.md, "Where the limit comes from". Larger numbers leave a wrong name, or
# `none`, where an effect is missing; smaller ones call right names `unknown`.

#: held-out nats that the nameless model may gain beside the effects named before the answer is `unknown`, of n nominal
#: flights: UNKNOWN_GAIN times (n + 1) / (n - 1) from two on, which is 36 nats with two and 24 with three; UNKNOWN_ALONE
#: with one or none; both chosen
UNKNOWN_GAIN, UNKNOWN_ALONE = 12.0, 25.0
#: share of what the effects named gain that the nameless model may gain as well, as no model is exact; UNKNOWN_ASSUMED
#: where one of them is random, or changes the loop of flights other than simulated ones, so that its spectrum is
#: assumed, not measured; with one nominal flight or none, of what the nameless model gains over no effect. Chosen
#: 2026-11-21, from 0.05 on, as much as models of effects usually left
UNKNOWN_SHARE, UNKNOWN_ASSUMED = 0.1, 0.2
#: factor on these shares in flights of this project's simulator and firmware, whose models are exact; chosen, after the
#: nameless model had gained at most 0.36 of what it may beside right names in 78 such flights (2026-11-23)
SAME_MODELS = 0.5
#: nats that a right effect may lose in a cell by chance; chosen: by the bound in
#: `over_prediction.over_prediction_by_channel` the chance of more is at most 37 %
CHANCE_LOSS = 1.0

# -- What names must close of the gap of recorded flights --

#: share of the gap that an effect of the loop, one that passes, or any that is named without a gyro must close: as much
#: as the loop model may be wrong by, `torque_power.TORQUE_DOUBT`; chosen
LEAST_CLOSED = 0.25
#: gap, in units of the floor, up to which an effect that is not of the loop need close nothing, also without a gyro;
#: chosen. An effect that passes may leave so small a gap, as the two halves of the data seldom share its seconds
STANDS_OUT = 1.1


@dataclass(frozen=True)
class UnknownLimit:
    """What the nameless model may gain beside the effects named where these are right.

    least: nats that are no news however little the effects gain; share, assumed_share: fraction of what they gain,
    where their spectra are measured, and where one is assumed; share_over_none: fraction of what the model gains over
    no effect; nominal_gain: nats that it gains in nominal flights as long as these, 0 where that does not count.
    """

    least: float
    share: float = 0.0
    assumed_share: float = 0.0
    share_over_none: float = 0.0
    nominal_gain: float = 0.0

    def nats(self, gain: float, over_none: float, spectrum_is_assumed: bool) -> float:
        """The limit, nats: the largest of what each field allows.

        gain: of the effects named; over_none: of the nameless model over no effect; spectrum_is_assumed: whether
        that of one effect is assumed.
        """
        share = self.assumed_share if spectrum_is_assumed else self.share
        return max(self.least, share * gain, self.share_over_none * over_none, self.nominal_gain)


@dataclass(frozen=True)
class NamingPolicy:
    """What flights must show for effects to be named, as far as that depends on their study.

    least_evidence: nats that the first effect must gain, and that every effect must have as evidence to be named.

    misfit_share: fraction of their gain that the models of effects may be wrong by; misfit_by_cell: whether a model is
    wrong only where it acts, so that the gain in improved cells alone counts; loop_misfit_share, loop_misfit_by_cell:
    the same for an effect that changes the loop, beside one whose spectrum is assumed. A loop that is fitted to
    nominal flights is wrong in all axes.

    loop_is_assumed: whether the spectrum of an effect that changes the loop is assumed, not measured;
    judges_over_prediction: whether effects are held against what the flights do not show; judges_unsteadiness: whether
    flights are held against how steady nominal ones are; must_close_gap: whether names must close a part of the gap;
    unknown: what the nameless model may gain.
    """

    least_evidence: float
    misfit_share: float
    misfit_by_cell: bool
    loop_misfit_share: float
    loop_misfit_by_cell: bool
    loop_is_assumed: bool
    judges_over_prediction: bool
    judges_unsteadiness: bool
    must_close_gap: bool
    unknown: UnknownLimit


def policy_of(study: Study, seconds: float) -> NamingPolicy:
    """The policy for flights of so many seconds that are compared with a study.

    Flights count as simulated where nominal flights show it, else as recorded: so do those without a baseline.
    """
    return NamingPolicy(
        least_evidence=FIRST_GAIN if study.simulated and study.loop is not None else LEAST_GAIN,
        misfit_share=MISFIT_SHARE_SIMULATED if study.simulated else MISFIT_SHARE_RECORDED,
        misfit_by_cell=study.simulated,
        loop_misfit_share=MISFIT_SHARE_LOOP_OWN_FIRMWARE if study.same_models else MISFIT_SHARE_LOOP_OTHER_FIRMWARE,
        loop_misfit_by_cell=study.same_models,
        loop_is_assumed=not study.simulated,
        judges_over_prediction=study.simulated,
        judges_unsteadiness=not study.simulated,
        must_close_gap=not study.simulated,
        unknown=unknown_limit(study, seconds))


def unknown_limit(study: Study, seconds: float) -> UnknownLimit:
    """What the nameless model may gain in flights of so many seconds that are compared with a study.

    From two nominal flights on it falls with their number n, as the factor (n + 1) / (n - 1) does: 36 nats with two, 24
    with three. With one or none it is 25 nats, less than with two, but UNKNOWN_ASSUMED of what the nameless model gains
    over no effect counts as well, and what it gains in nominal flights.
    """
    n = study.nominal_count
    # of simulated flights it does not count, and is not asked for, as to measure their scatter takes seconds
    scatter = None if study.simulated else study.scatter
    nominal_gain = 0.0 if scatter is None else scatter.allowed(seconds, UNKNOWN_GAIN)
    if n < 2:
        return UnknownLimit(UNKNOWN_ALONE, share_over_none=UNKNOWN_ASSUMED, nominal_gain=nominal_gain)
    exactness = SAME_MODELS if study.same_models else 1.0
    return UnknownLimit(UNKNOWN_GAIN * (n + 1) / (n - 1), UNKNOWN_SHARE * exactness, UNKNOWN_ASSUMED * exactness,
                        nominal_gain=nominal_gain)
