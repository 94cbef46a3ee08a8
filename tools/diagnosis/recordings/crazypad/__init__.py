"""CrazyPAD: the labels of its flights, the figures of their diagnoses, its corrections of the velocity."""
