"""The one exception that users see."""


class AirTouchError(ValueError):
    """Bad input, said in one line: the file, the place in it and the remedy.

    The command line prints it without a traceback and exits with code 2.
    """
