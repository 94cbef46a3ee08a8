"""What is said: how far it closes, what stays open, what to fly next, words and pictures."""
