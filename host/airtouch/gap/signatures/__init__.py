"""What the diagnosis knows of each effect: its free parameters, and how strong it seems where there is none."""
