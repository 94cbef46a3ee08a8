"""How the fitted twin and the recorded flights differ: figures, curves, a classifier, sentences."""
