"""`python -m airtouch` is the `airtouch` command."""

from airtouch.cli import main

main()
