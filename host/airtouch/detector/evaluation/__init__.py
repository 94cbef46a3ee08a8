"""How well detectors do: which flights, which are held out, and the scores, with intervals by flight."""
