"""The answer of a diagnosis, part by part, in the order in which `gap.diagnosis` asks for them.

- `shrink`: how far the gap closes.
- `ranking`: the verdict, and every candidate with its probability (`probabilities`) and why it is not the answer
  (`reasons`).
- `named_effects`: the effects with their parameters (`estimates`), and `notes` on these.
- `controls`: what the answer is compared with, a wrong effect and the vehicle as declared.
- `unexplained`: what stays open, and which signals it follows (`followed_signals`).
- `advice`: what to fly next.
- `sentences`, `words`, `curves`: what terminal and report show of it.
"""
