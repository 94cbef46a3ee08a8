"""Which effects are named: a first look, fit on one half and judge on the other, one after another."""
