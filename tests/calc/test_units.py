from __future__ import annotations

import pytest

from steptwin.calc import Dimension, DriveMechanics, UnitScale, read_quantity, unit_of
from steptwin.errors import Misuse


def test_gear_from_mechanics() -> None:
    """Manual 4.9: 200 steps × 64 = 12800 pulses in a revolution. A screw of 5 mm behind a gear of 2:1."""
    assert DriveMechanics(motor_steps=200, microsteps=64).scale().in_pulses("rev") == 12800
    scale = DriveMechanics(motor_steps=200, microsteps=64, ratio=2, lead=5).scale()
    assert [scale.in_pulses(unit) for unit in ("imp", "step", "rev", "mm", "cm", "m")] == [1, 64, 25600, 5120, 51200, 5120000]
    assert scale.in_pulses("degree") == pytest.approx(25600 / 360)


def test_units_that_follow_from_a_gear() -> None:
    scale = UnitScale.of_gear("degree", 10)
    assert scale.in_pulses("rev") == pytest.approx(3600)
    with pytest.raises(Misuse, match=r"mm is not known in pulses: give the lead \[mm/rev\]; known are imp, degree, rev"):
        scale.in_pulses("mm")
    with pytest.raises(Misuse, match=r"rev is not known in pulses: give the motor's steps"):
        UnitScale.of_gear("mm", 640).in_pulses("rev")


@pytest.mark.parametrize(
    ("text", "dimension", "value", "unit"),
    [
        ("150mm", Dimension.DISTANCE, 150, "mm"),
        (" -12,5 ° ", Dimension.DISTANCE, -12.5, "degree"),
        ("1e3", Dimension.DISTANCE, 1000, None),
        ("64000 microsteps", Dimension.DISTANCE, 64000, "imp"),
        ("60 mm/s", Dimension.SPEED, 60, "mm"),
        ("600rpm", Dimension.SPEED, 10, "rev"),
        ("300MM/s2", Dimension.ACCELERATION, 300, "mm"),
        ("2rev/s²", Dimension.ACCELERATION, 2, "rev"),
        ("250 ms", Dimension.TIME, 0.25, None),
        ("1.5min", Dimension.TIME, 90, None),
    ],
)
def test_numbers_with_units(text: str, dimension: Dimension, value: float, unit: str | None) -> None:
    assert read_quantity(text, dimension) == (pytest.approx(value), unit)


@pytest.mark.parametrize(
    ("text", "dimension", "message"),
    [
        ("fast", Dimension.SPEED, "'fast' is not a number with a unit: expected such as 60mm/s"),
        ("60mm", Dimension.SPEED, "has the unit of something else: expected such as 60mm/s"),
        ("60mm/s", Dimension.ACCELERATION, "has the unit of something else: expected such as 300mm/s2"),
        ("3 furlong", Dimension.DISTANCE, "no unit 'furlong': units are imp, step"),
        ("3 h", Dimension.TIME, "units are s, ms, min"),
        ("1e999", Dimension.DISTANCE, "is too large"),
    ],
)
def test_what_is_no_quantity(text: str, dimension: Dimension, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        read_quantity(text, dimension)


@pytest.mark.parametrize("wrong", [0.0, -1.0, float("inf"), float("nan"), 1e7])
def test_mechanics_that_cannot_be(wrong: float) -> None:
    with pytest.raises(Misuse, match=r"lead = .* mm/rev: permitted are numbers above 0"):
        DriveMechanics(lead=wrong).scale()


def test_names_of_units() -> None:
    assert unit_of("DEG") == "degree"
    with pytest.raises(Misuse, match="did you mean 'degree'"):
        unit_of("degre")
