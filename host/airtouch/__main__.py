"""`python -m airtouch` is the `airtouch` command."""

import sys

from airtouch.cli import main

sys.exit(main())
