"""Sealed sets: flights with withheld effects, made, diagnosed and scored.

`blind` makes a set, its effects drawn at the strengths that `blind_severity` finds: the weakest that any test could
detect, twice and four times that. `blind_key` keeps what was drawn and opens it for one set of answers. `blind_score`
scores the answers, each figure with an interval (`intervals`). `blind_run` does all of it, on local processes or on a
cluster (`on_cluster`).
"""
