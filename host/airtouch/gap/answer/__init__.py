"""What is said of the flights; `gap.diagnosis` calls these in this order.

How far the gap closes (`shrink`). The verdict and every candidate by its `probabilities` (`ranking`), with the
`reasons` against the others; the `named_effects` with the `estimates` of their parameters, and `notes` on these. What
the answer is held against: a wrong effect and another vehicle (`controls`). What stays open (`unexplained`); what to
fly next (`advice`); the `sentences`, `words` and `pictures` of a report.
"""
