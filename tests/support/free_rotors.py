"""The motion of a rotor that nothing but its load and its friction moves, and of one in its field, integrated by SciPy."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, pi, sin

import pytest

solve_ivp = pytest.importorskip("scipy.integrate").solve_ivp
POLES = 50


def coasted(
    x: float, v: float, seconds: float, *, inertia: float, load: float, friction: float, low: float = -inf, high: float = inf
) -> tuple[float, float]:
    """Angle and speed (rad, rad/s) after a time without current, between inelastic stops; ``load`` pulls to lower angles."""
    t = 0.0
    while t < seconds:
        way = (v > 0) - (v < 0) or (-1 if load > friction else 1 if load < -friction else 0)
        if way == 0 or (v == 0 and ((way < 0 and x <= low) or (way > 0 and x >= high))):
            return x, 0.0

        def rate(_: float, y: list[float], way: int = way) -> list[float]:
            return [y[1], (-load - way * friction) / inertia]

        def stands(_: float, y: list[float], way: int = way) -> float:
            return y[1] * way + 1e-12

        def meets(_: float, y: list[float], way: int = way) -> float:
            return min(y[0] - low, high - y[0]) if low > -inf or high < inf else 1.0

        ends: list[Callable[[float, list[float]], float]] = [stands, meets]
        for one in ends:
            one.terminal, one.direction = True, -1  # type: ignore[attr-defined]
        run = solve_ivp(rate, (t, seconds), [x, v], events=ends, rtol=1e-10, atol=1e-12)
        t, x, v = float(run.t[-1]), float(run.y[0][-1]), float(run.y[1][-1])
        if run.status == 1:
            v = 0.0
            x = min(max(x, low), high)
    return x, v


def in_field(
    x: float,
    v: float,
    seconds: float,
    *,
    inertia: float,
    load: float,
    friction: float,
    field: Callable[[float], float],
    torque: Callable[[float], float],
    points: int = 200,
) -> list[tuple[float, float, float]]:
    """(time, angle, speed) in equal steps: ``field`` is the angle of the field and ``torque`` its holding torque at a time."""

    def rate(t: float, y: list[float]) -> list[float]:
        against = friction * max(-1.0, min(1.0, y[1] / 1e-3))
        return [y[1], (-torque(t) * sin(POLES * (y[0] - field(t))) - against - load) / inertia]

    at = [seconds * n / points for n in range(points + 1)]
    run = solve_ivp(rate, (0.0, seconds), [x, v], t_eval=at, max_step=2e-4, rtol=1e-8, atol=1e-10, method="LSODA")
    return [(t, float(x), float(v)) for t, x, v in zip(run.t, run.y[0], run.y[1], strict=True)]


def turns(units: float, pitch: float) -> float:
    """Radians of the motor."""
    return units / pitch * 2 * pi
