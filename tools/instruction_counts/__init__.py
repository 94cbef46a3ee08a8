"""Flight code on the desktop: cross-compiled by a compiler from PyPI, run in an emulator from PyPI."""
