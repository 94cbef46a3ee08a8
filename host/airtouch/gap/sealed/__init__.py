"""Sealed sets: flights with withheld effects, made, diagnosed and scored.

`make` makes a set, its effects drawn at the strengths that `severity` finds: the weakest that any test could detect,
twice and four times that. `key` keeps what was drawn and opens it for one set of answers. `score` scores the answers,
each figure with an interval (`intervals`), and tells rotors and loops apart (`variant`). `run` does all of it, on local
processes or on a cluster (`on_cluster`).
"""
