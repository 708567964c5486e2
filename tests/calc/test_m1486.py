"""Moves of an M1486 against the formulas of its assumptions, worked out by hand, and against the chip itself."""

from __future__ import annotations

import pytest

from steptwin.calc import Calculation, Calculator, M1486Model
from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.m1486.drive import ChipDrive
from steptwin.m1486.lines import STEP_DIRECTION, TWO_DACS
from steptwin.m1486.variants import variant

A = Calculator(M1486Model())


def move(calculator: Calculator = A, find: str | None = None, **values: float) -> Calculation:
    return calculator.calculate(values, find)


def test_linear_ramps() -> None:
    """S200 A5000 V1000: 0.16 s and 96 steps of ramp on either side of 1000 steps."""
    result = move(distance=64000, velocity=1000, acceleration=5000)
    assert result.times == pytest.approx(
        {"time": 0.16 + 0.808 + 0.16, "acceleration_time": 0.16, "constant_time": 0.808, "deceleration_time": 0.16}
    )
    assert result.parts[0].distance == pytest.approx(96 * 64)
    assert [(one.code, one.value) for one in result.settings] == [
        ("F", 64000), ("S", 200), ("V", 1000), ("A", 5000), ("P", 25000), ("M", 4), ("Q", 1),
    ]  # fmt: skip


def test_a_parabolic_part_takes_twice_the_linear_time() -> None:
    """M-6: from P to V in 2·(V − P)/A."""
    result = move(distance=640000, velocity=2000, acceleration=5000, profile=1000)
    assert [part.name for part in result.parts] == [
        "acceleration", "parabolic acceleration", "constant velocity", "parabolic deceleration", "deceleration",
    ]  # fmt: skip
    assert [part.duration_s for part in result.parts[:2]] == pytest.approx([800 / 5000, 2 * 1000 / 5000])
    assert [formula.source for formula in result.formulas] == ["VII.2", "M-6", "VII.2"]


def test_m_8_without_a_ramp() -> None:
    result = move(distance=6400, start_stop=500, velocity=400, acceleration=5000)
    assert result.times["time"] == pytest.approx(100 / 400)
    assert any("no ramp (M-8)" in note for note in result.notes)


def test_m_7_a_short_move() -> None:
    result = move(distance=640, velocity=1000, acceleration=5000)
    assert not result.reaches
    assert result.formulas[-1].source == "M-7"


@pytest.mark.parametrize(("name", "clock"), [("A", 1), ("B2x", 2)])
def test_the_chip_takes_as_long(name: str, clock: int) -> None:
    kind = variant(name)
    result = move(Calculator(M1486Model(kind, STEP_DIRECTION)), distance=128000, velocity=3000, acceleration=9000, profile=1500)
    drive = ChipDrive(kind, STEP_DIRECTION)
    drive.distance_u, drive.velocity, drive.acceleration, drive.profile_speed = 128000, 3000, 9000, 1500
    assert drive.run(0)
    assert result.times["time"] * SECOND == pytest.approx(drive.deadline(), abs=1)
    assert any("24 MHz" in note for note in result.notes) is (clock == 2)


@pytest.mark.parametrize("find", ["distance", "velocity", "acceleration", "start_stop", "profile"])
@pytest.mark.parametrize("time", ["time", "acceleration_time"])
def test_any_quantity_from_the_others(find: str, time: str) -> None:
    values = {"distance": 640000.0, "start_stop": 250.0, "velocity": 2000.0, "acceleration": 4000.0, "profile": 1200.0}
    if find == "distance" and time == "acceleration_time":
        values["distance"] = 3200.0  # beyond, that time does not depend on it
    wanted = A.calculate(values).times[time]
    rest = {name: value for name, value in values.items() if name != find}
    result = A.calculate({**rest, time: wanted}, find)
    assert result.exact == pytest.approx(values[find], rel=1e-6)
    assert result.values == {**values, "microstep": 4, "qualification": 1}


def test_whole_numbers_and_the_grid_of_m() -> None:
    result = move(distance=640000, velocity=2000, time=5.93)
    assert result.values["acceleration"] == round(result.exact or 0)
    assert result.notes[0].startswith("with values that the controller takes, time is 5.9")
    wanted = "distance 100 min. microsteps is taken as 96 min. microsteps"
    assert wanted in move(distance=100, velocity=200, acceleration=50).notes
    assert move(distance=100, velocity=200, acceleration=50, microstep=16, qualification=4).values["distance"] == 100


def test_backward_is_b() -> None:
    assert move(distance=-6400, velocity=1000, acceleration=5000).settings[0][1:4:2] == ("B", 6400)


def test_microsteps_after_power_on_depend_on_the_interface() -> None:
    values = {"distance": 64000.0, "velocity": 1000.0, "acceleration": 5000.0}
    for interface, microsteps in ((STEP_DIRECTION, 1), (TWO_DACS, 4)):
        assert Calculator(M1486Model(interface=interface)).calculate(values).values["microstep"] == microsteps


@pytest.mark.parametrize(
    ("values", "find", "message"),
    [
        ({"velocity": 20001}, None, r"velocity = 20001 step/s: permitted from 16 up to 20000 step/s"),
        ({"start_stop": 1951}, None, r"permitted from 16 up to 1950 step/s"),
        ({"microstep": 3}, None, r"microstep = 3: permitted 1, 2, 4, 8, 16, 32, 64"),
        ({"microstep": 2, "distance": 64, "velocity": 100, "acceleration": 99}, None, r"M2 does not permit Q1: .* Q2"),
        ({"distance": 64, "velocity": 100, "time": 1}, "microstep", r"microstep cannot be calculated, it is a choice"),
        ({"deceleration": 5}, None, r"no quantity 'deceleration' \(did you mean 'acceleration'\?\)"),
    ],
)
def test_what_cannot_be(values: dict[str, float], find: str | None, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        A.calculate(values, find)


def test_what_is_worth_knowing() -> None:
    notes = move(distance=64000, velocity=5000, acceleration=20000, microstep=64, qualification=4, profile=7500).notes
    assert any("V5000 runs as V3000 (M-34)" in note for note in notes)
    assert any("(M-4)" in note for note in notes)
    assert any("above 187.5 step/s the microsteps are those of Q" in note for note in notes)
