"""The present state of a chip: defaults of the manual's chapters II and VII, and what commands change."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from m1486_rig import Bench

from steptwin.controller import SECOND
from steptwin.controllerstate import ControllerState, ProgramActivity, StatusLevel
from steptwin.m1486.lines import DUAL_DAC, TWO_DACS
from steptwin.m1486.present import state_of

WARNING = StatusLevel.WARNING


def state(bench: Bench) -> ControllerState:
    return state_of(bench.chip, bench.now)


def program(bench: Bench) -> tuple[ProgramActivity | None, str]:
    found = state(bench).program
    assert found is not None
    return found.state, found.text


def stopped(bench: Bench) -> None:
    bench.do("c51", "v200", "f64000")
    bench.send("r", "w1")
    bench.run(0.1)
    bench.send("k")


def limited(bench: Bench) -> None:
    bench.do("c51", "v200", "g+")
    bench.send("r", "w1")
    bench.run(0.1)
    bench.pin(LIMIT=0)


ACTIVITIES: list[tuple[Callable[[Bench], object], ProgramActivity, str]] = [
    (lambda bench: None, ProgramActivity.STOPPED, "has nothing to do"),
    (lambda bench: bench.file("@1", "v100", "v200", "j1"), ProgramActivity.RUNNING, "runs"),
    (lambda bench: bench.send("w2500"), ProgramActivity.WAITING, "waits 2.495 s more"),
    (lambda bench: bench.send("o3"), ProgramActivity.STOPPED, "has nothing to do"),
    (lambda bench: (bench.pin(B3=0), bench.send("o3")), ProgramActivity.WAITING, "waits until B3 is high"),
    (lambda bench: bench.send("z3"), ProgramActivity.WAITING, "waits until B3 is low"),
    (lambda bench: bench.send("f64000", "r"), ProgramActivity.WAITING, "waits for the end of the move"),
    (lambda bench: bench.send("g+", "r"), ProgramActivity.WAITING, "waits for the end of the endless move"),
    (lambda bench: bench.send(")1"), ProgramActivity.WAITING, "waits for the end of the seek"),
    (stopped, ProgramActivity.PAUSED, "stopped by Kill (C75 lets it go on)"),
    (limited, ProgramActivity.PAUSED, "stopped by LIMIT"),
    (lambda bench: bench.pin(SD=0), ProgramActivity.STOPPED, "shut down"),
]


@pytest.mark.parametrize(("prepare", "activity", "text"), ACTIVITIES, ids=[text for _, _, text in ACTIVITIES])
def test_the_program_in_words(prepare: Callable[[Bench], object], activity: ProgramActivity, text: str) -> None:
    bench = Bench()
    prepare(bench)
    bench.run(ms=5)
    assert program(bench) == (activity, text)


def test_a_chip_that_is_held_or_shut_down_has_a_warning() -> None:
    bench = Bench()
    assert (state(bench).status.level, state(bench).status.text) == (StatusLevel.OK, "ok")
    stopped(bench)
    assert (state(bench).status.level, state(bench).status.text) == (WARNING, "stopped by Kill (C75 lets it go on)")
    bench.pin(SD=0)
    assert (state(bench).status.level, state(bench).status.text) == (WARNING, "shut down")


def test_a_motion_that_is_stopping_after_k_is_still_one() -> None:
    bench = Bench()
    bench.do("s200", "a1000", "v2000", "g+")
    bench.send("r")
    bench.run(2)
    assert state(bench).axes[0].velocity == 2000 * 64
    bench.send("k")
    bench.run(0.9)
    (axis,) = state(bench).axes
    assert (axis.moving, axis.velocity) == (True, pytest.approx(1100 * 64))  # 1000 step/s² less each second
    bench.run(1)
    (axis,) = state(bench).axes
    assert (axis.moving, axis.velocity, axis.position) == (False, 0.0, bench.true)


def test_the_axis_shows_where_the_pulses_led_and_details_the_counter() -> None:
    bench = Bench()
    bench.do("f640", "r", "=6400", "b128", "r")
    found = state(bench)
    (axis,) = found.axes
    assert (axis.number, axis.position, axis.velocity, axis.moving, axis.enabled, axis.encoder) == (
        1,
        512.0,
        0.0,
        False,
        None,
        None,
    )
    assert found.details["counter"] == 6400 - 128
    assert (found.variant, found.time_s) == ("B", bench.now / SECOND)
    assert found.pins == dict(bench.chip.pins())


def test_the_pins_of_the_driver_interface_follow_the_pulses() -> None:
    """Also between what the chip has to do: their levels are those of the moment that is asked for."""
    bench = Bench(interface=DUAL_DAC)
    bench.do("v200", "f64000")
    bench.send("r")
    bench.run(0.5)
    seen = set()
    for _ in range(8):
        ahead = state_of(bench.chip, bench.now + 3_100_000).pins
        bench.run(ms=3.1)
        assert ahead == dict(bench.chip.pins())
        seen.add(tuple(ahead[f"B{line}"] for line in range(8, 18)))
    assert len(seen) > 4


@pytest.mark.parametrize(
    ("commands", "statement"),
    [
        (("w1000", "f64000", "r"), "W1000"),
        (("z3", "f64000"), "Z3"),
        (("f64000", "r", "w1000"), "R"),
        (("f64000", "r", "w1000", "k"), "R"),
        (("@1", "j1"), "J1"),
    ],
)
def test_the_command_in_progress(commands: tuple[str, ...], statement: str) -> None:
    """The one at which the program stands, which may come after a jump; none where it waits for a host."""
    bench = Bench()
    assert state(bench).program.statement is None
    bench.file(*commands)
    bench.run(ms=50)
    assert state(bench).program.statement == statement


# ---------------------------------------------------------------------- details


def test_details_at_power_on() -> None:
    """Defaults of the manual: distance 64 000, V1000, P25000, Q1, N1, M1 in Step & Direction mode; functions 48 to 55 on.

    M-3: S and A. Address pins that are not tied are high.
    """
    assert state(Bench()).details == {
        "address": "F", "interface": "sd", "baud": 4800, "listens": True, "memory_used": 0, "memory_size": 2032,
        "stored": 0, "input_waiting": 0, "input_size": 32, "counter": 0, "counter_valid": True, "S": 200, "A": 5000, "P": 25000,
        "V": 1000, "M": 1, "Q": 1, "N": 1, "next_distance": 64000, "next_direction": 1, "variable": 0, "remainder": 0,
        "registers": {str(number): 0 for number in range(1, 9)}, "flags_on": (), "functions_on": tuple(range(48, 56)),
    }  # fmt: skip


def test_details_after_commands() -> None:
    bench = Bench("C", address=11, baud=1200, interface=TWO_DACS)
    bench.do("xg", "s300", "a7000", "p900", "v1500", "m8", "q2", "n3", "b640")
    bench.do("t80", "t86", "c50", "t40", "t56", ":1234", ">2", ":77", ">8", ":1000", "/7", "=4096")
    found = state(bench).details
    assert {name: found[name] for name in ("address", "interface", "baud", "memory_size", "input_size")} == {
        "address": "B", "interface": "two", "baud": 1200, "memory_size": 4000, "input_size": 12,
    }  # fmt: skip
    assert {name: found[name] for name in "SAPVMQN"} == {"S": 300, "A": 7000, "P": 900, "V": 1500, "M": 8, "Q": 2, "N": 3}
    assert (found["next_distance"], found["next_direction"]) == (-640, -1)
    assert (found["variable"], found["remainder"], found["counter"]) == (142, 6, 4096)  # 1000 = 142 × 7 + 6
    assert found["registers"] == {"1": 0, "2": 1234, "3": 0, "4": 0, "5": 0, "6": 0, "7": 0, "8": 77}
    assert found["flags_on"] == (80, 86)
    assert found["functions_on"] == (40, 48, 49, 51, 52, 53, 54, 55, 56)
    bench.do(":1", "-2")
    assert state(bench).details["flags_on"] == (80, 86, 87)  # carry: the operand exceeds the variable


def test_details_of_motions() -> None:
    """G+ and G− have no end; a move that K ended leaves no valid counter (M-16)."""
    bench = Bench()
    for letter, direction in (("g+", 1), ("g-", -1)):
        bench.do(letter)
        found = state(bench).details
        assert (found["next_distance"], found["next_direction"]) == (None, direction)
    stopped(bench)
    bench.finish()
    assert not state(bench).details["counter_valid"]


def test_details_of_the_line() -> None:
    """Another chip is addressed; characters of a line that has not ended wait."""
    bench = Bench(address=3)
    bench.raw(b"v10")
    found = state(bench).details
    assert (found["input_waiting"], found["input_size"], found["listens"]) == (3, 32, True)
    bench.raw(b"0\rx4\r")
    assert (state(bench).details["listens"], state(bench).details["input_waiting"]) == (False, 0)


def test_the_file_in_the_eeprom_is_counted() -> None:
    """E types: a file of F (32 bits), R (8 bits)."""
    bench = Bench("E1")
    bench.file("f64", "r")
    bench.finish()
    assert state(bench).details["stored"] == len(bench.chip.image) > 0
