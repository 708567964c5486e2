"""What a controller tells of what no register shows: moment, axis, code and text."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from mic488_rig import Rig, controller, programmed

from steptwin.controller import MILLISECOND, SECOND
from steptwin.mic488.config import AxisConfig
from steptwin.mic488.core import Mic488Event
from steptwin.mic488.encoder import Coupling

Told = tuple[int, int | None, str, str]
"""ms, axis, code, text."""

FAST = AxisConfig(acc=1e6, dec=1e6, vel=1000.0, in_kl=0, in_kr=1, home_mode=1, limit_mode=3)
ON = "M1 = ON\nM2 = ON\n"


def off(rig: Rig) -> None:
    rig.wait(0.5)
    rig.set("POS_ABS", 5.0, 2)
    rig.set("VEL_ABS", 5.0, 3)
    rig.set("HOME", -5.0, 4)


def too_fast(rig: Rig) -> None:
    rig.enable(2, 3)
    rig.wait(0.25)
    rig.set("VEL_ABS", 70_000.0, 2)
    rig.set("VEL_ABS", -123_456.0, 3)


def switched(rig: Rig) -> None:
    rig.enable(1, 2)
    rig.set("VEL_ABS", -100.0, 1)
    rig.wait(0.3)
    rig.pin("IN1", 1)
    rig.wait(0.1)
    rig.pin("IN1", 0)
    rig.set("VEL_ABS", 100.0, 2)
    rig.wait(0.2)
    rig.pin("IN2", 1)


def too_near(rig: Rig) -> None:
    """At 500 imp/s with 1000 imp/s²: 125 imp to brake."""
    rig.enable(2)
    rig.set("VEL_ABS", 500.0, 2)
    rig.wait(1.0)
    rig.set("POSLIM_R", 400.0, 2)


def homed(rig: Rig) -> None:
    """The switch is found at once; then nothing is left to do."""
    rig.switch(2, None, 0, "IN1")
    rig.enable(2)
    rig.wait(0.2)
    rig.set("HOME", -100.0, 2)
    rig.wait(5.0)


def untriggered(rig: Rig) -> None:
    rig.enable(1, 2)
    rig.word("AXIS_CTR_MODE", 1)
    rig.wait(0.4)
    rig.word("AXIS_POS_REL_TRIG", 2)
    rig.word("AXIS_VEL_ABS_TRIG", 1)


CASES: dict[str, tuple[AxisConfig, Callable[[Rig], object], list[Told]]] = {
    "drives that are off": (
        AxisConfig(),
        off,
        [
            (500, 2, "drive-off", "position command ignored: M2 is not enabled"),
            (500, 3, "drive-off", "velocity command ignored: M3 is not enabled"),
            (500, 4, "drive-off", "homing ignored: M4 is not enabled"),
        ],
    ),
    "faster than the outputs": (
        AxisConfig(),
        too_fast,
        [
            (250, 2, "speed-clamped", "M2: 70000 imp/s is more than the outputs give, 64000 imp/s"),
            (250, 3, "speed-clamped", "M3: -123456 imp/s is more than the outputs give, 64000 imp/s"),
        ],
    ),
    "limit switches": (FAST, switched, [(300, 1, "limit", "M1 stopped by KL"), (600, 2, "limit", "M2 stopped by KR")]),
    "a limit too near": (AxisConfig(), too_near, [(1000, 2, "overrun", "M2 cannot brake before its soft limit")]),
    "triggers without values": (
        AxisConfig(),
        untriggered,
        [
            (400, 2, "trigger-empty", "trigger of M2 without a new value of POS_REL"),
            (400, 1, "trigger-empty", "trigger of M1 without a new value of VEL_ABS"),
        ],
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_an_event_of_an_axis_in_full(name: str) -> None:
    axis, play, told = CASES[name]
    rig = Rig(controller(axis, axis, axis, axis))
    play(rig)
    assert list(rig.device.events) == [Mic488Event(ms * MILLISECOND, number, code, text) for ms, number, code, text in told]
    assert [event.facts for event in rig.device.events] == [(("axis", number),) for _, number, _, _ in told]


def test_homing_tells_its_end() -> None:
    rig = Rig(controller(*(replace(FAST, limit_mode=0),) * 4))
    homed(rig)
    (event,) = rig.device.events
    assert (event.axis, event.code, event.text) == (2, "homed", "M2 is at its home position")
    assert 0.2 * SECOND < event.time < 5.2 * SECOND


def test_a_position_that_is_not_reached_is_told() -> None:
    """MIC-19: after the time of the configuration."""
    rig = Rig(controller(AxisConfig(), AxisConfig(pos_ctrl_mode=1, err_ctrl_mode=1)))
    rig.device.couple_encoder(2, Coupling.BLOCKED, 0)
    rig.enable(2)
    rig.set("POS_ABS", 500.0, 2)
    rig.until(2, 5)
    (event,) = rig.device.events
    assert event == Mic488Event(rig.now, 2, "position-error", "M2 did not reach its position")


def test_events_of_programs_name_no_axis() -> None:
    rig = programmed("OUT1 = ON\nMOVELIN @A\nWAIT 1 = 2\n", "A;10;10;5;x\n")
    rig.start()
    rig.wait(1)
    rig.halt()
    rig.word("PROG_BANK_SEL", 3)
    rig.start()
    assert list(rig.device.events) == [
        Mic488Event(2 * MILLISECOND, None, "drive-off", "MOVELIN ignored: M1 and M2 must be enabled"),
        Mic488Event(SECOND, None, "program-error", "program bank 3 is empty"),
    ]
    assert [event.facts for event in rig.device.events] == [(), ()]


def test_an_axis_that_is_left_alone_on_a_path_is_told() -> None:
    rig = programmed(f"{ON}MOVELIN @A\nWAIT 1 = 2\n", "A;9000;9000;100;x\n")
    rig.start()
    rig.wait(1)
    rig.stop(1)
    (event,) = rig.device.events
    assert event == Mic488Event(SECOND, None, "path-left", "M2 slows down: the other axis left their path")


def test_a_path_that_is_too_fast_is_told() -> None:
    """(3, 4) is 5 units: at 100 000 units/s M2 would make 80 000 imp/s, M1 60 000."""
    rig = programmed(f"{ON}MOVELIN @A\nWAIT 1 = 2\n", "A;3000;4000;100000;x\n")
    rig.start()
    rig.wait(0.01)
    (event,) = rig.device.events
    text = "100000 imp/s along the path is above 64000 imp/s"
    assert event == Mic488Event(3 * MILLISECOND, None, "speed-clamped", text)


def test_switching_on_is_told_of_no_axis() -> None:
    rig = Rig()
    rig.wait(0.7)
    rig.device.power_cycle(rig.now)
    assert list(rig.device.events) == [Mic488Event(700 * MILLISECOND, None, "power-on", "power-on")]
