"""The exponential function and its inverse made of + − × ÷, so that they are the same on every machine."""

from __future__ import annotations

from math import factorial

# Taylor's series; up to 1/2 the omitted terms are below 1e-18 of the result.
_TERMS = tuple(1.0 / factorial(n) for n in range(16))
_MOST = 700.0


def decay(x: float) -> float:
    """e^−x for ``x`` ≥ 0, within 1e-12 of the exact value; 0 above 700."""
    if x > _MOST:
        return 0.0
    halvings = 0
    while x > 0.5:
        x *= 0.5
        halvings += 1
    total = _TERMS[-1]
    for term in _TERMS[-2::-1]:
        total = total * x + term
    for _ in range(halvings):
        total *= total
    return 1.0 / total


def logarithm(y: float) -> float:
    """The natural logarithm of ``y`` from 1 to 1e300, within 1e-12: Newton's iteration on `decay`, from below."""
    x = 0.0
    while True:
        before, x = x, x + 1.0 - 1.0 / (y * decay(x))
        if x - before < 1e-13 * (1.0 + x):
            return x
