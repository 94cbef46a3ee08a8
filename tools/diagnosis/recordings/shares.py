"""A share of flights with its interval, as the tables print it."""

from airtouch.gap.sealed.intervals import wilson


def share_text(hits: int, n: int, digits: int = 0) -> str:
    """Hits of n with their 95 % interval in brackets; digits: decimals of the percentages."""
    share = wilson(hits, n)
    return f"{hits} of {n} [{share['low']:.{digits}%}, {share['high']:.{digits}%}]"
