"""How likely the flights are under an effect: likelihood, fit, gates in time."""
