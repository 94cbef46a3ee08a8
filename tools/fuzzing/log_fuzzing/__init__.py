"""Fuzzing of the log readers: sound files of every format, mutations of them, and the path that a file takes."""
