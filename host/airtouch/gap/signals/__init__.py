"""What is compared: measured minus modelled by channel, spectra in blocks, and the floors of both."""
