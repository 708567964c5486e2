"""The dead-man's switch of a chip: short moves, each begun by a `hold`; whatever else happens, the present one is completed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from chip_rig import ChipWire, chip_line

from steptwin import drivers
from steptwin.drivers.blocking import finish
from steptwin.drivers.exchange import LineFailure, Overtaken
from steptwin.drivers.m1486 import AsyncM1486
from steptwin.drivers.m1486.jog import LINK_S, NOT_HELD, AsyncM1486Jog
from steptwin.drivers.m1486.settings import ChipSettings
from steptwin.errors import Misuse, Refusal
from steptwin.wire.line import SerialLine

STEP = 64
SETTINGS = {"start_stop": 200, "acceleration": 5000, "velocity": 1500, "profile": 25000, "microstep": 1, "qualification": 1}


def ready(kind: str = "B", *, configured: bool = True, **options: Any) -> tuple[ChipWire, AsyncM1486]:
    wire = ChipWire(kind, (7,))
    chip = AsyncM1486(chip_line(wire), 7, **options)
    finish(chip.open())
    if configured:
        finish(chip.configure(**SETTINGS))  # type: ignore[arg-type]
    return wire, chip


def begun(chip: AsyncM1486, velocity: float) -> AsyncM1486Jog:
    jog = AsyncM1486Jog(chip, velocity)
    assert jog.reach == 0.0
    assert finish(jog.__aenter__()) is jog
    return jog


def end(jog: AsyncM1486Jog) -> None:
    finish(jog.__aexit__(None, None, None))


def test_both_drivers_jog_under_the_names_of_the_mic488() -> None:
    """As they are imported."""
    wire, waiting = ready()
    assert isinstance(waiting, drivers.AsyncM1486)
    jog = waiting.jog(400.0)
    assert isinstance(jog, drivers.AsyncM1486Jog)
    finish(jog.__aenter__())
    end(jog)
    with drivers.M1486(chip_line(wire), 7) as chip:
        chip.configure(**SETTINGS)  # type: ignore[arg-type]
        with chip.jog(-400.0) as held:
            assert isinstance(held, drivers.M1486Jog)
            assert held.hold()
            assert (held.reach, held.end) == (60.0, None)
        assert held.end == "released"
    assert wire.true(7) == -60 * STEP


@pytest.mark.parametrize("velocity", [400.0, -400.0])
def test_each_hold_moves_by_one_link(velocity: float) -> None:
    """400 full steps/s make 60 of them in 0.15 s."""
    wire, chip = ready()
    jog = begun(chip, velocity)
    link_u = round(400 * LINK_S) * STEP * (1 if velocity > 0 else -1)
    assert jog.reach == 60.0
    for links in range(2, 6):
        assert finish(jog.hold())
        assert wire.moving(7)
        assert (links - 1) * 60 * STEP <= abs(wire.true(7)) < links * 60 * STEP
    end(jog)
    assert jog.end == "released"
    assert not wire.moving(7)
    assert wire.true(7) == 5 * link_u
    # V of the jog lasts as long as the jog; its moves know where they end.
    assert (wire.chip.drive.velocity, chip.settings.velocity) == (1500, 1500)
    assert finish(chip.counter()) == 5 * link_u % 2**24


def test_v_is_that_of_the_jog_while_it_lasts() -> None:
    wire, chip = ready()
    jog = begun(chip, 400.0)
    assert (wire.chip.drive.velocity, chip.settings.velocity) == (400, 400)
    end(jog)


def test_v_that_is_not_known_stays_that_of_the_jog() -> None:
    """S, A and V cannot be read of a chip."""
    wire, chip = ready(configured=False)
    finish(chip.configure(microstep=1, qualification=1))
    assert chip.settings.velocity is None
    jog = begun(chip, 400.0)
    end(jog)
    assert wire.chip.drive.velocity == 400
    assert wire.true(7) == 60 * STEP


@pytest.mark.parametrize(
    ("steps_per_unit", "velocity", "reach"), [(200.0, 2.0, 0.3), (200.0, 0.5, 0.075), (1.0, 20.0, 3.0), (1.0, 16.0, 2.0)]
)
def test_velocity_and_reach_are_in_the_unit_of_the_chip(steps_per_unit: float, velocity: float, reach: float) -> None:
    """200 full steps per unit: 2 units/s are 400 full steps/s. A link is whole steps of M1, rounded; one at least."""
    wire, chip = ready(steps_per_unit=steps_per_unit)
    jog = begun(chip, velocity)
    assert jog.reach == pytest.approx(reach)
    end(jog)
    assert wire.true(7) == round(reach * steps_per_unit) * STEP


def test_a_chip_with_24_mhz_runs_at_twice_its_v() -> None:
    wire, chip = ready("B2x", variant="B2x")
    jog = begun(chip, 800.0)
    assert wire.chip.drive.velocity == 400
    assert jog.reach == 120.0
    end(jog)


def test_not_held_any_more_the_motor_completes_its_move() -> None:
    wire, chip = ready()
    jog = begun(chip, 400.0)
    assert finish(jog.hold())
    stood = wire.true(7)
    wire.sleep(5.0)
    assert not wire.moving(7)
    assert wire.true(7) - stood <= jog.reach * STEP
    assert wire.true(7) == 2 * 60 * STEP


@pytest.mark.parametrize(
    ("meanwhile", "text"),
    [
        (lambda wire, chip: wire.at(0.02, lambda: wire.chip.set_pin("LIMIT", 0, wire.now)), "the chip "),
        (lambda wire, chip: finish(chip.stop()), "stopped"),
    ],
    ids=["LIMIT", "Kill"],
)
def test_what_stops_the_motor_ends_the_jog(meanwhile: Callable[[ChipWire, AsyncM1486], object], text: str) -> None:
    wire, chip = ready()
    if text != "stopped":
        finish(chip.command("c51"))  # LIMIT holds the program
    jog = begun(chip, 400.0)
    meanwhile(wire, chip)
    assert not finish(jog.hold())
    assert jog.end is not None
    assert jog.end.startswith(text)
    stood = wire.true(7)
    assert not finish(jog.hold())
    wire.sleep(5.0)
    assert wire.true(7) == stood


def test_a_stop_between_the_distance_and_its_move_ends_the_jog() -> None:
    """The next move is specified, but not begun."""
    wire, chip = ready()
    jog = begun(chip, 400.0)

    def stop(data: bytes) -> None:
        if data.startswith(b"f"):
            chip._unit.shared.stops += 1

    wire.before_each = stop
    assert not finish(jog.hold())
    assert jog.end == "'chip 7: r' was not sent: a stop was requested meanwhile"
    wire.sleep(5.0)
    assert wire.true(7) == 60 * STEP


def test_a_jog_that_is_refused_at_its_beginning_puts_the_velocity_back() -> None:
    wire, chip = ready()

    def stop(data: bytes) -> None:
        if data.startswith(b"f"):
            chip._unit.shared.stops += 1

    wire.before_each = stop
    with pytest.raises(Overtaken):
        finish(AsyncM1486Jog(chip, 400.0).__aenter__())
    assert chip.settings.velocity == SETTINGS["velocity"] == wire.chip.drive.velocity
    assert wire.true(7) == 0


@pytest.mark.parametrize(("away_s", "runs_on"), [(0.2, True), (0.41, False)])
def test_a_jog_that_is_held_too_late_has_ended(away_s: float, *, runs_on: bool) -> None:
    """0.4 s after the echo of its R; the letter that tells its end counts when it is asked for in time."""
    wire, chip = ready()
    jog = begun(chip, 400.0)
    assert finish(jog.hold())
    wire.sleep(away_s)
    assert finish(jog.hold()) is runs_on
    assert jog.end == (None if runs_on else NOT_HELD)
    end(jog)
    assert wire.true(7) == (2 + runs_on) * 60 * STEP


@pytest.mark.parametrize(("acceleration", "steps"), [(5000, 128), (500, 57)])
def test_a_move_with_slow_ramps_is_shorter(acceleration: int, steps: int) -> None:
    """Within 0.25 s: S · 0.25 s and A · (0.125 s)²."""
    _, chip = ready()
    finish(chip.configure(acceleration=acceleration))
    jog = begun(chip, 2000.0)
    assert jog.reach == steps
    assert finish(jog.hold())
    end(jog)


def test_ramps_that_are_slower_than_known_end_a_jog() -> None:
    """What is not known is taken as at power-up, A 5000; with A 500 such a move takes longer than the hold time."""
    wire, chip = ready()
    finish(chip.configure(acceleration=500))
    chip._unit.shared.settings = ChipSettings(microstep=1)
    jog = begun(chip, 2000.0)
    assert jog.reach == 128
    assert not finish(jog.hold())
    assert jog.end == NOT_HELD
    assert wire.true(7) == 128 * STEP


def test_a_jog_is_held_inside_its_with_block() -> None:
    wire, chip = ready()
    with pytest.raises(Misuse, match="a jog is held inside its with block"):
        finish(AsyncM1486Jog(chip, 400.0).hold())
    assert wire.true(7) == 0


def test_a_line_that_is_cut_is_told_and_the_motor_stops_by_itself() -> None:
    wire, chip = ready()
    jog = begun(chip, 400.0)
    wire.severed = True
    with pytest.raises(LineFailure):
        finish(jog.hold())
    with pytest.raises(LineFailure):
        end(jog)
    assert wire.true(7) == 60 * STEP
    # The error inside of the block is the one to know of.
    finish(jog.__aexit__(LineFailure, LineFailure("cut"), None))


def test_what_cannot_be_jogged() -> None:
    wire, chip = ready()
    with pytest.raises(Misuse, match="velocity = 0: the sign of the velocity is the direction"):
        AsyncM1486Jog(chip, 0.0)
    with pytest.raises(Misuse, match="velocity = 20001: M1486B takes 16 to 20 000 step/s"):
        begun(chip, 20001.0)
    assert wire.true(7) == 0
    chip._unit.talk._serial = SerialLine(600)
    with pytest.raises(Refusal, match="a jog needs a line of at least 1200 bit/s: with 600 bit/s the commands"):
        AsyncM1486Jog(chip, 400.0)
    _, eeprom = ready("E1", configured=False)
    with pytest.raises(Refusal, match="M1486E1 writes every command into its EEPROM, so it is not jogged"):
        AsyncM1486Jog(eeprom, 400.0)
