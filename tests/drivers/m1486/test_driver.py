"""The driver against chips in virtual time: what it types, how motions end, what it refuses."""

from __future__ import annotations

import math

import pytest
from chip_rig import KNOWN, ChipWire, Fault, chip_driver, chip_line, typed

from steptwin.controller import SECOND
from steptwin.drivers.m1486 import (
    M1486,
    Busy,
    ChipMoveFailed,
    ChipReason,
    ChipSettings,
    PositionUnknown,
)
from steptwin.drivers.m1486.talk import ChipRequest
from steptwin.errors import LineFailure, Misuse
from steptwin.m1486.lines import DUAL_DAC


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda c: c.configure(velocity=20_001), "velocity = 20001: M1486B takes 16 to 20 000 step/s"),
        (lambda c: c.configure(start_stop=15), "start_stop = 15: M1486B takes 16 to 1950 step/s"),
        (lambda c: c.configure(microstep=3), "microstep = 3: M1486B takes 1, 2, 4, 8, 16, 32, 64"),
        (lambda c: c.configure(microstep=16, qualification=1), "M16 does not permit Q1: permitted are Q4"),
        (lambda c: c.move_to(-1.0), "position -1 step is outside 0 to 250000 step"),
        (lambda c: c.move_by(250_001.0), "distance 250001 step is outside ±250000 step"),
        (lambda c: c.move_by(0.25), "0.25 step is 16 minimum microsteps, which is not a whole full step"),
        (lambda c: c.seek(1, 22), "the line to seek = 22: M1486B takes 1 to 21"),
        (lambda c: c.set_output(22, True), "no line 22"),
        (lambda c: c.set_function(41, False), "function 41 is used by this driver: it stays ON"),
        (lambda c: c.command("f16000001"), "F16000001 is out of range"),
        (lambda c: c.command("r"), "'r' is not a command to type alone"),
        (lambda c: c.command("zz"), "'zz' is not a command: 'z' begins a second command (Zero) on this line"),
        (lambda c: c.command(""), "'' is not a command"),
        (lambda c: c.configure(velocity=15.5), "velocity = 15.5: M1486B takes 16 to 20 000 step/s"),
        (lambda c: c.set_position(math.inf), "inf step is not a position"),
        (lambda c: c.move_by(math.nan), "nan step is not a distance"),
        (lambda c: c.inputs(1, 10), "10 lines from B1 on = 20: M1486B takes"),
        (lambda c: c.inputs(20, 3), "3 lines from B20 on = 203: M1486B takes"),
        (lambda c: c.set_flag(87, True), "no user flag 87: they are 80 to 86"),
        (lambda c: c.set_function(64, True), "no function 64: they are 40 to 63"),
        (lambda c: c.set_function(57, True), "function 57 is used by this driver: it stays OFF"),
        (lambda c: c.seek(0, 3), "direction 0: permitted are 1 and -1"),
        (lambda c: c.uploaded(0), "0 bytes: at least 1"),
        (lambda c: c.uploaded(1), "no program of the chip was started here"),
        (lambda c: c.run_block(["f64", "\\"]), "has no place in a block"),
        (lambda c: c.run_block(["f64"] * 64), "the block is larger than the command memory of M1486B, 2032 bits"),
        (lambda c: c.download("v99999\nq"), "program is not sent:"),
        (lambda c: c.run_block(["f64"], timeout_s=-1.0), "a time to wait of -1 s is outside 0 to 1000000 s"),
        (lambda c: c.wait(float("nan")), "a time to wait of nan s is outside"),
        (lambda c: c.uploaded(1, float("inf")), "a time to wait of inf s is outside"),
        (lambda c: c.start_program(81), "the label = 81"),
        (lambda c: c.run(0), "direction 0"),
        (lambda c: c.set_variable(1 << 24), "the internal variable = 16777216: M1486B takes 0 to"),
        (lambda c: c.configure(velocity=math.inf), "velocity = inf: M1486B takes 16 to 20 000 step/s"),
        (lambda c: c.configure(velocity=math.nan), "velocity = nan: M1486B takes 16 to 20 000 step/s"),
        (lambda c: c.set_variable(-1), "the internal variable = -1: M1486B takes 0 to"),
        (lambda c: c.move_to(250_001.0), "position 250001 step is outside 0 to 250000 step"),
        (lambda c: c.move_by(-250_001.0), "distance -250001 step is outside ±250000 step"),
    ],
)
def test_misuse_is_told_before_anything_is_typed(call: object, text: str) -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    wire.sent.clear()
    with pytest.raises(Misuse) as caught:
        call(chip)  # type: ignore[operator]
    assert text in str(caught.value)
    assert wire.sent == []


# ---------------------------------------------------------------------- motion


def test_a_move_takes_the_time_it_was_computed_to_take() -> None:
    wire = ChipWire("B", interface=DUAL_DAC)
    chip = chip_driver(wire, steps_per_unit=40.0, unit="mm")
    chip.configure(**KNOWN)
    wire.sent.clear()
    chip.move_to(20.0)
    assert typed(wire).endswith("g51200 r ")
    expected = ChipSettings(**KNOWN).travel_s(51_200, chip.variant)
    end = chip.wait()
    assert str(end) == "the chip: target reached at 20 mm"
    assert expected is not None
    train = wire.chip.drive.train.profile
    assert ((train.end or 0) - train.start) / SECOND == pytest.approx(expected, abs=1e-6)
    chip.move_by(-7.5)
    assert chip.wait().position == 12.5
    assert wire.true() == 12.5 * 40 * 64


def test_m_28_the_position_is_not_known_while_it_moves_nor_after_a_stop() -> None:
    """And M-16."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.move_by(5000.0)
    with pytest.raises(Busy, match="the chip is not done with a move: wait for its end or stop it"):
        chip.position()
    chip.stop()
    assert chip.wait(check=False).reason is ChipReason.STOPPED
    with pytest.raises(PositionUnknown, match="shows its target, not where it was stopped"):
        chip.position()
    with pytest.raises(PositionUnknown):
        chip.move_to(10.0)
    place = wire.true()
    chip.move_by(10.0)
    assert chip.wait().ok
    assert wire.true() == place + 640
    chip.set_position(100.0)
    assert chip.position() == 100.0


def test_a_run_without_end() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.run(-1, velocity=300)
    wire.sleep(2.0)
    with pytest.raises(Misuse, match="runs without end: give timeout_s"):
        chip.wait()
    assert chip.wait(0.5, check=False).reason is ChipReason.OVERDUE
    chip.stop()
    end = chip.wait(check=False)
    assert end.reason is ChipReason.STOPPED
    assert end.position == (wire.true() & 0xFFFFFF) / 64
    assert wire.true() < -500 * 64


def test_a_seek() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    wire.at(0.9, lambda: wire.chip.set_pin("B2", 0, wire.now))
    chip.seek(-1, 2)
    assert chip.wait().reason is ChipReason.SOUGHT
    assert -200 * 64 < wire.true() < -100 * 64


def test_limit_ends_a_move_early() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.configure(**{**KNOWN, "microstep": 1})
    chip.move_by(5000.0)
    wire.at(1.0, lambda: wire.chip.set_pin("LIMIT", 0, wire.now))
    with pytest.raises(ChipMoveFailed, match=r"ended early \(LIMIT, or Kill from another program\)"):
        chip.wait()
    with pytest.raises(PositionUnknown):
        chip.position()
    chip.set_limit(False)
    chip.move_by(-100.0)
    assert chip.wait().ok
    chip.set_limit(True)
    wire.chip.set_pin("LIMIT", 1, wire.now)
    chip.run(1)
    wire.at(1.0, lambda: wire.chip.set_pin("LIMIT", 0, wire.now))
    assert chip.wait(5.0, check=False).reason is ChipReason.LIMIT


def test_a_chip_held_by_kill_is_recovered() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.set_function(51, False)
    chip.run(1)
    chip.stop()
    wire.sleep(1.0)
    with pytest.raises(Busy, match="is held by Kill because its function 51 is OFF: recover it"):
        chip.position()
    chip.recover()
    assert chip.position() == wire.true() / 64


def test_a_move_that_is_late_is_overdue() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.configure(**KNOWN)
    chip.move_by(5000.0)
    end = chip.wait(1.0, check=False)
    assert (end.reason, end.position) == (ChipReason.OVERDUE, None)
    assert chip.wait().reason is ChipReason.TARGET


def test_a_target_is_reached_only_where_that_is_known() -> None:
    """The counter shows it also where LIMIT has ended a move (M-16), so it says nothing: the time does, if it is known and the
    chip was asked before it was up."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    ends = []
    for is_known, pause_s in ((False, 0.0), (True, 0.0), (True, 5.0)):
        if is_known:
            chip.configure(**KNOWN)
        chip.move_by(1000.0)
        wire.sleep(pause_s)
        ends.append(chip.wait())
    assert [end.ok for end in ends] == [True] * 3
    assert [str(end).partition(" (")[0] for end in ends] == [
        "the chip: came to rest at 1000 step, target 1000 step",
        "the chip: target reached at 2000 step",
        "the chip: came to rest at 3000 step, target 3000 step",
    ]
    chip.move_by(1000.0)
    wire.sleep(1.5)
    wire.chip.drive.set_counter(640, wire.now)
    end = chip.wait(check=False)
    assert (end.ok, str(end)) == (False, "the chip: redirected at 10 step, target 4000 step")


def test_a_move_of_nothing_is_over_at_once_and_types_nothing() -> None:
    """R would make the move before once more."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.move_by(700.0)
    chip.wait()
    wire.sent.clear()
    for move in (lambda: chip.move_by(0.0), lambda: chip.move_to(700.0)):
        move()
        end = chip.wait()
        assert (end.reason, end.position) == (ChipReason.TARGET, 700.0)
    assert not {"r", "h"} & set(typed(wire).split())
    assert wire.true() == 700 * 64


def test_settings_typed_by_hand_are_known_again() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    function = chip._driver._unit.shared.function
    chip.configure(**KNOWN)
    chip.command("s300")
    assert (chip.settings.start_stop, chip.settings.velocity) == (300, KNOWN["velocity"])
    chip.set_variable(400)
    chip.command("v")
    assert chip.settings.velocity is None, "it is what the variable was"
    for text, on in (("c51", False), ("t51", True), ("c52", True)):
        chip.command(text)
        assert function(51) is on, text
    assert function(52) is False


@pytest.mark.parametrize(("command", "is_once"), [("+5", True), (":5", False)])
def test_a_command_whose_cr_may_have_been_heard_is_typed_again_where_that_does_no_harm(command: str, is_once: bool) -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    wire.put(Fault("to host", len("u20|B") + len(command), "drop"))
    if is_once:
        with pytest.raises(LineFailure, match="it is unknown whether"):
            chip.command(command)
    else:
        chip.command(command)
    assert wire.faults[0].met
    assert chip.variable() == 5


def test_what_is_reset_by_force_brakes_before() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.run(1)
    wire.sent.clear()
    chip.reset(force=True)
    assert typed(wire).split()[:3] == ["%", "k", "\\"]
    wire.sleep(0.5)  # its ramp
    assert not wire.moving()


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"steps_per_unit": 0.0}, "steps_per_unit = 0: must be above 0"),
        ({"steps_per_unit": -1.0}, "steps_per_unit = -1: must be above 0"),
        ({"steps_per_unit": math.inf}, "steps_per_unit = inf: must be above 0"),
        ({"steps_per_unit": math.nan}, "steps_per_unit = nan: must be above 0"),
        ({"timeout_s": 0.0}, "a time-out of 0 s is outside 0 to 60 s"),
        ({"timeout_s": 60.5}, "a time-out of 60.5 s is outside 0 to 60 s"),
        ({"address": 16}, "address 16: permitted are 0 to 15"),
        ({"address": -1}, "address -1: permitted are 0 to 15"),
        ({"origin_u": -1}, "origin_u = -1: permitted are 0 to 16000000 minimum microsteps"),
        ({"origin_u": 16_000_001}, "origin_u = 16000001: permitted are 0 to 16000000 minimum microsteps"),
    ],
)
def test_what_is_no_chip(options: dict[str, float], text: str) -> None:
    with pytest.raises(Misuse) as caught:
        M1486(chip_line(ChipWire("B")), **options)  # type: ignore[arg-type]
    assert str(caught.value) == text


@pytest.mark.parametrize("options", [{"timeout_s": 60.0}, {"address": 0}, {"address": 15}, {"origin_u": 16_000_000}])
def test_what_is_just_a_chip(options: dict[str, float]) -> None:
    assert M1486(chip_line(ChipWire("B")), **options).unit == "step"  # type: ignore[arg-type]


def test_how_long_a_move_takes_is_known_when_all_settings_are() -> None:
    """A B type at 12 MHz; with M16 V cannot be more than 750 full steps/s (Q4), with Q1 it can."""
    settings = ChipSettings(start_stop=200, acceleration=5000, velocity=1000, profile=25000, qualification=1)
    chip = chip_driver(ChipWire("B"))
    # 96 full steps up to 1000/s in 0.16 s, as many down, 808 between.
    assert settings.travel_s(1000 * 64, chip.variant) == pytest.approx(0.16 + 0.16 + 0.808)
    for name in ("start_stop", "acceleration", "velocity", "profile", "qualification"):
        assert settings.with_(**{name: None}).travel_s(64_000, chip.variant) is None


def test_the_face_for_threads_passes_all_its_arguments_on() -> None:
    said: list[str] = []
    chip = M1486(
        "/dev/none", 7, baud=9600, variant="C", steps_per_unit=40.0, unit="mm", origin_u=640, timeout_s=0.75, log=said.append
    )
    driver = chip._driver
    assert (chip.address, chip.unit, chip.place) == (7, "mm", "/dev/none")
    assert (driver.scale_u, driver.origin_u, driver._unit.timeout_ns) == (2560.0, 640, 750_000_000)
    assert driver._variant is not None
    assert driver._variant.name == "C"
    talk = driver._unit.talk
    assert talk.wire_ns(1) == pytest.approx(10 * SECOND / 9600, abs=1)
    talk.start(ChipRequest(None, "t6"), 0, urgent=False)
    assert len(said) == 1
    assert said[0].endswith("t6")


def test_half_a_minimum_microstep_is_rounded_and_more_is_no_full_step() -> None:
    """As long as M is not known: a full step has 64 of them."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.move_by(10 + 0.5 / 64)
    assert chip.wait().ok
    assert wire.true() == 640
    with pytest.raises(Misuse, match="which is not a whole full step"):
        chip.move_by(10 + 0.6 / 64)
