"""Moves of a MIC488 against the textbook formulas of trapezoid and triangle, and against the machine itself."""

from __future__ import annotations

from math import sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.calc import Calculation, Calculator, Mic488Model
from steptwin.errors import Misuse

MM = Calculator(Mic488Model("mm", gear=640.0, axis=2))


def textbook(s: float, v: float, a: float, d: float) -> float:
    if v * v / (2 * a) + v * v / (2 * d) < s:
        return v / (2 * a) + v / (2 * d) + s / v
    peak = sqrt(2 * s * a * d / (a + d))
    return peak / a + peak / d


def move(**values: float) -> Calculation:
    return MM.calculate(values)


def test_the_example_of_the_manual() -> None:
    """Manual 4.9: 12800 pulses in a revolution, 2.5 rev/s, 4.5 rev."""
    result = Calculator(Mic488Model("rev", gear=12800)).calculate({"distance": 4.5, "velocity": 2.5, "acceleration": 10})
    assert result.profile.counts[-1] == 57600
    assert result.times["time"] == pytest.approx(4.5 / 2.5 + 2.5 / 10)
    assert "57600 pulses, at most 32000 a second" in result.notes


def test_a_trapezoid_has_three_parts() -> None:
    result = move(distance=150, velocity=60, acceleration=300, deceleration=200)
    assert [(part.name, part.from_velocity, part.to_velocity) for part in result.parts] == [
        ("acceleration", 0, 60),
        ("constant velocity", 60, 60),
        ("deceleration", pytest.approx(60), 0),
    ]
    assert [part.distance for part in result.parts] == pytest.approx([6, 135, 9])
    assert result.times == pytest.approx(
        {"time": 2.75, "acceleration_time": 0.2, "constant_time": 2.25, "deceleration_time": 0.3}
    )
    assert result.reaches
    assert [formula.name for formula in result.formulas] == ["trapezoid"]
    assert [(one.code, one.value) for one in result.settings] == [("M2_VMAX", 60), ("M2_ACC", 300), ("M2_DEC", 200)]


def test_a_short_move_is_a_triangle() -> None:
    result = move(distance=1, velocity=60, acceleration=300)
    assert result.peak == pytest.approx(sqrt(300))
    assert not result.reaches
    assert [part.name for part in result.parts] == ["acceleration", "deceleration"]
    assert [formula.name for formula in result.formulas] == ["triangle"]


NUMBERS = st.floats(0.5, 90.0)


@given(distance=NUMBERS, velocity=NUMBERS, acceleration=st.floats(5, 5000), deceleration=st.floats(5, 5000))
def test_times_are_those_of_the_textbook_and_back(
    distance: float, velocity: float, acceleration: float, deceleration: float
) -> None:
    values = {"distance": distance, "velocity": velocity, "acceleration": acceleration, "deceleration": deceleration}
    result = MM.calculate(values)
    pulses = round(distance * 640) / 640
    assert result.times["time"] == pytest.approx(textbook(pulses, velocity, acceleration, deceleration))
    for name in ("distance", "acceleration", "deceleration"):
        rest = {other: value for other, value in values.items() if other != name}
        found = MM.calculate(
            {**rest, "distance": pulses, "time": result.times["time"]}
            if name != "distance"
            else {**rest, "time": result.times["time"]},
            name,
        )
        assert found.times["time"] == pytest.approx(result.times["time"], rel=1e-3)
        if name == "distance":
            assert found.exact == pytest.approx(pulses)


def test_velocity_for_a_total_time() -> None:
    """v² /a − T·v + s = 0 for a = d: v = (T − √(T² − 4·s/a))·a/2."""
    result = move(distance=150, acceleration=300, time=3)
    assert result.found == "velocity"
    assert result.exact == pytest.approx((3 - sqrt(9 - 4 * 150 / 300)) * 300 / 2)
    assert result.times["time"] == pytest.approx(3)


def test_acceleration_for_the_time_of_a_part_is_that_of_deceleration_too() -> None:
    result = move(distance=150, velocity=60, acceleration_time=0.5)
    assert (result.exact, result.values["deceleration"]) == pytest.approx((120, 120))


def test_a_distance_is_a_whole_number_of_pulses() -> None:
    result = move(distance=0.001, velocity=60, acceleration=300)
    assert result.values["distance"] == 1 / 640
    assert "distance 0.001 mm is taken as 0.0015625 mm" in result.notes
    with pytest.raises(Misuse, match=r"distance = 0\.0005 mm: is less than the controller's step"):
        move(distance=0.0005, velocity=60, acceleration=300)


def test_backward() -> None:
    result = move(distance=-150, velocity=60, acceleration=300)
    assert result.times["time"] == pytest.approx(2.7)
    assert result.parts[1].distance == pytest.approx(-138)


@pytest.mark.parametrize(
    ("values", "find", "message"),
    [
        ({"velocity": 120}, None, r"velocity = 120 mm/s: permitted above 0 up to 100 mm/s"),
        ({"velocity": 0}, None, r"velocity = 0 mm/s: permitted above 0 up to 100 mm/s"),
        ({"acceleration": -1}, None, r"acceleration = -1 mm/s²: permitted above 0"),
        ({"velocity": float("nan")}, None, r"velocity = nan mm/s"),
        ({"distance": 1e9}, None, r"distance = 1000000000 mm: permitted above 0 up to 6710886\.398 mm"),
        ({"speed": 3}, None, r"no quantity 'speed': quantities are distance, velocity, acceleration"),
        ({"velocty": 3}, None, r"did you mean 'velocity'"),
        ({"velocity": 10}, None, r"distance, acceleration: missing"),
        ({"velocity": 10, "time": 1}, None, r"distance, acceleration: a time determines one of them"),
        ({"velocity": 10, "time": 1, "constant_time": 1}, None, r"time and constant_time: one time"),
        ({"velocity": 10}, "distance", r"to calculate distance a time is needed"),
        ({"distance": 10, "velocity": 10, "acceleration": 9, "time": 1}, None, r"name what is to be calculated instead"),
        ({"distance": 10, "time": 1}, "time", r"time is given, so time follows"),
        (
            {"distance": 150, "velocity": 60, "time": 2},
            None,
            r"total time = 2 s cannot be: with acceleration above 0 .* it is 2\.5 s to",
        ),
        (
            {"distance": 1500, "acceleration": 6, "velocity": 60, "acceleration_time": 20},
            "distance",
            r"time of acceleration = 20 s cannot be",
        ),
    ],
)
def test_what_cannot_be(values: dict[str, float], find: str | None, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        MM.calculate(values, find)
