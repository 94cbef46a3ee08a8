"""How likely the flights are under an effect: their likelihood, and the fit of an effect to them."""
