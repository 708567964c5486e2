"""How much a soak test does.

The environment variable ``STEPTWIN_SOAK`` is a factor: 1 with ``make soak``, a hundredth in an ordinary test run.
"""

from __future__ import annotations

import os

VARIABLE = "STEPTWIN_SOAK"
ORDINARY = 0.01


def factor() -> float:
    """The factor from the environment; ``ValueError`` for anything but a positive number up to 1000."""
    text = os.environ.get(VARIABLE, str(ORDINARY))
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 < value <= 1000:
        raise ValueError(f"{VARIABLE}={text!r}: a number above 0 and up to 1000 is permitted, 1 is the full length")
    return value


def scaled(full: int) -> int:
    """`full` iterations (cycles, frames, connections) times the factor, at least one."""
    return max(1, round(full * factor()))


def time_limit() -> float:
    """Seconds a soak test may take: as long as any other test when it is short, an hour at factor 1."""
    return max(120.0, 3600.0 * factor())
