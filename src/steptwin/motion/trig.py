"""Sine, cosine and their inverses made of + − × ÷ √, so that they are the same on every machine.

Angles ``_q`` are in quarter turns (90°): whole ones give exact values, and any angle is reduced without error. Results are
within 2^-51 of the exact ones, relative to the result near its zeros.

`sine_near_0`, `cosine_near_0` and `arcsine_below_45` have no branches, and `steptwin.motion.pulses` runs them on arrays.
"""

from __future__ import annotations

from collections.abc import Callable
from math import factorial, floor, sqrt
from typing import Any, TypeAlias

from steptwin.errors import Misuse

PI = 3.141592653589793
QUARTER = 0.5 * PI
"""Radians in a quarter turn."""

SINE_45 = sqrt(0.5)

Real: TypeAlias = Any
"""A float, or an array of them."""

# Taylor's series; up to 45° the omitted terms are below 1e-17 of the result.
_SINE = tuple((-1) ** n / factorial(2 * n + 1) for n in range(9))
_COSINE = tuple((-1) ** n / factorial(2 * n) for n in range(10))
# The same series up to 45° / 8.
_ARCSINE = tuple(factorial(2 * n) / (4**n * factorial(n) ** 2 * (2 * n + 1)) for n in range(9))
_HALVINGS = 3


def sine(angle_q: float) -> float:
    """Sine of ``angle_q``, any finite number."""
    whole = floor(angle_q + 0.5)
    return _sine_of(whole, angle_q - whole)


def cosine(angle_q: float) -> float:
    """Cosine of ``angle_q``, any finite number."""
    whole = floor(angle_q + 0.5)
    return _sine_of(whole + 1, angle_q - whole)


def _sine_of(whole: int, rest: float) -> float:
    """Sine of ``whole`` quarter turns and ``rest``, at most half of one."""
    x = rest * QUARTER
    value = cosine_near_0(x) if whole & 1 else sine_near_0(x)
    return 0.0 - value if whole & 2 else value


def arcsine(x: float) -> float:
    """The angle, −1…1 quarter turns, whose sine is ``x``; `Misuse` outside −1…1."""
    y = abs(x)
    if not y <= 1.0:
        raise Misuse(f"arc sine of {x}: permitted are -1…1")
    angle_q = arcsine_below_45(y, sqrt) if y <= SINE_45 else 1.0 - 2.0 * arcsine_below_45(sqrt(0.5 * (1.0 - y)), sqrt)
    return angle_q if x >= 0.0 else -angle_q


def arccosine(x: float) -> float:
    """The angle, 0…2 quarter turns, whose cosine is ``x``; `Misuse` outside −1…1."""
    y = abs(x)
    if not y <= 1.0:
        raise Misuse(f"arc cosine of {x}: permitted are -1…1")
    if y <= SINE_45:
        return 1.0 - (arcsine_below_45(y, sqrt) if x >= 0.0 else -arcsine_below_45(y, sqrt))
    angle_q = 2.0 * arcsine_below_45(sqrt(0.5 * (1.0 - y)), sqrt)
    return angle_q if x >= 0.0 else 2.0 - angle_q


def direction(x: float, y: float) -> float:
    """The angle, more than −2 up to 2 quarter turns, at which (x, y) is seen from (0, 0), from +x to +y positive.

    `Misuse` for (0, 0) itself.
    """
    distance = length(x, y)
    if distance == 0.0:
        raise Misuse("the direction of (0, 0): permitted is any other point")
    if abs(y) <= abs(x):
        angle_q = arcsine(y / distance)
        return angle_q if x > 0.0 else (2.0 - angle_q if y >= 0.0 else -2.0 - angle_q)
    angle_q = arcsine(x / distance)
    return 1.0 - angle_q if y > 0.0 else angle_q - 1.0


def length(x: float, y: float) -> float:
    """Distance of (x, y) from (0, 0), without overflow on the way."""
    greater = max(abs(x), abs(y))
    if greater == 0.0:
        return 0.0
    u, v = x / greater, y / greater
    return greater * sqrt(u * u + v * v)


def sine_near_0(x: Real) -> Real:
    """Sine of −π/4…π/4 radians."""
    w = x * x
    total = _SINE[-1] * w
    for coefficient in _SINE[-2:0:-1]:
        total = (total + coefficient) * w
    return x + x * total


def cosine_near_0(x: Real) -> Real:
    """Cosine of −π/4…π/4 radians."""
    w = x * x
    total = _COSINE[-1] * w
    for coefficient in _COSINE[-2:0:-1]:
        total = (total + coefficient) * w
    return 1.0 + total


def arcsine_below_45(x: Real, root: Callable[[Real], Real]) -> Real:
    """The angle, 0…½ quarter turns, whose sine is ``x`` (0…√½): the angle is halved three times, then Taylor's series."""
    for _ in range(_HALVINGS):
        x = x / root(2.0 + 2.0 * root(1.0 - x * x))
    w = x * x
    total = _ARCSINE[-1] * w
    for coefficient in _ARCSINE[-2:0:-1]:
        total = (total + coefficient) * w
    return (x + x * total) * (2**_HALVINGS / QUARTER)
