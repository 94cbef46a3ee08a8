"""Where the gap between simulation and reality lies, which effect causes it, how far it shrinks."""
