"""Each format of log file, a module each: how a file is recognised, read, and for some written."""
