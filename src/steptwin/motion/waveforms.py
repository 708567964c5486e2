"""Phase currents of a two-phase stepper motor in microstep operation: the seven characteristics of the M1486.

Electrical angle θ in minimum microsteps (full step/64): 256 are one electrical period, four full steps. Currents as signed
7-bit numbers: magnitude 0–127, the sign is the direction of flow (PHASE high = negative, M-25).

The manual gives names only (one of them: wide trapezoid, which with two microsteps per full step is half-step operation);
the shapes are this project's definition. Tables are made of + − × ÷ √ only, so that they are the same on every machine.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt

from steptwin.errors import Misuse
from steptwin.motion.trig import sine

PERIOD = 256
"""Minimum microsteps in an electrical period."""
_QUARTER = PERIOD // 4
FULL_SCALE = 127

SINE, WIDE_TRAPEZOID, TRIMMED, TRIMMED_MORE, TRIANGLE, FILLED, FILLED_MORE = CHARACTERISTICS = range(1, 8)
"""Arguments of the command N."""


def currents(characteristic: int, theta: int) -> tuple[int, int]:
    """Currents (−127…127) of phase 1, f(θ), and phase 2, f(θ − 90°), at any whole ``theta`` (minimum microsteps).

    ``characteristic`` is the argument of N, 1–7, else `Misuse`.
    """
    table = _TABLES.get(characteristic)
    if table is None:
        raise Misuse(f"characteristic = {characteristic}: must be 1 to 7")
    return table[theta % PERIOD], table[(theta - _QUARTER) % PERIOD]


def _fifths(x: float, power: int) -> float:
    """x^(power/5) for 0 <= x <= 1. Newton's iteration for the fifth root begins above it, so that it never overshoots."""
    if x == 0.0:
        return 0.0
    root, following = 2.0, 1.0
    while following < root:
        root = following
        following = root - (root - x / (root * root * root * root)) / 5.0
    value = 1.0
    for _ in range(power):
        value *= root
    return value


def _table(magnitude: Callable[[int, float], float]) -> list[int]:
    """One period of a characteristic from its first quarter, given as a function of k (0…64) and sin(k · 90°/64)."""
    # Half a unit is rounded up; it occurs in the straight lines only, where k/32 and k/64 are exact.
    quarter = [int(FULL_SCALE * magnitude(k, sine(k / _QUARTER)) + 0.5) for k in range(_QUARTER + 1)]
    half = quarter + quarter[-2:0:-1]
    return half + [-value for value in half]


_TABLES: dict[int, list[int]] = {
    SINE: _table(lambda _, sine: sine),
    WIDE_TRAPEZOID: _table(lambda k, _: min(k / 32, 1.0)),
    TRIMMED: _table(lambda _, sine: _fifths(sine, 6)),
    TRIMMED_MORE: _table(lambda _, sine: sine * sqrt(sine)),
    TRIANGLE: _table(lambda k, _: k / 64),
    FILLED: _table(lambda _, sine: _fifths(sine, 4)),
    FILLED_MORE: _table(lambda _, sine: _fifths(sine, 3)),
}
