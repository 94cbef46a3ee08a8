"""The live view: the detector on the host, and the board that shows it in a terminal."""
