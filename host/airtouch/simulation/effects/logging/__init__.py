"""Effects of how the log is written: they change no flight."""
