"""What is said of the flights; `gap.diagnosis` calls these in this order.

The verdict and every candidate by its `probabilities` (`ranking`), with the `reasons` against the others; the
parameters of the `named_effects`; how far the gap closes (`shrink`), against a wrong effect and another vehicle
(`controls`); what stays open (`unexplained`); what to fly next (`advice`); the `words` and `pictures` of a report.
"""
