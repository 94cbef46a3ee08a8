"""Flights without a gyro: which rotor is damaged, by the commands of a hover.

**What is measured** (`hover_pattern`). In hover nothing turns on average, so the mean commanded thrusts of the four
motors are the torques that act on the vehicle. One flight gives four numbers of balance, b = (log lift, roll / lift,
pitch / lift, yaw / lift), with lift, roll, pitch and yaw mixed from the thrusts (`loop.command_spectra.MIX`), and the
log10 power of two motions, unsteadiness of the commands and heave.

**What is modelled** (`hover_hypotheses`). Each hypothesis is 4096 samples of what it may do to b, by its prior
(`priors`):

    rotor r lost a share l of its thrust     its command is 1 / (1 - l) of what it was: lift, roll, pitch, yaw change
    weight of a share m of the mass at x, y  log(1 + m), m' y / d, -m' x / d, 0, with m' = m / (1 + m), d: rotor's x, y
    a nameless change                        four independent normal numbers, or lift (less) or yaw alone

**What is compared** (`hover_balance`). The flights' mean b and powers, less those of the nominal flights. The evidence
of a hypothesis is its prior probability times the mean over its samples of a Student likelihood of b, times the normal
likelihood of the powers (Bayes factors: MacKay, Information Theory, Inference, and Learning Algorithms, 2003, chapter
28). The evidences of all hypotheses of one name over the sum of all is the probability of that name, and the samples
weighted by their likelihood give its parameters (`hover_posterior`). `hover_ranking` withdraws names that
close too little of the gap, and `balance_result` fills the diagnosis.

Figures on recorded flights: host/docs/gap-crazypad.md.
"""
