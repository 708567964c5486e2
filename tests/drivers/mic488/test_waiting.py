"""When a wait ends, told from what is read and when: every status, every time-out."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pytest

from steptwin.controller import MILLISECOND, SECOND
from steptwin.drivers.blocking import finish
from steptwin.drivers.line import LONGEST_WAIT_S
from steptwin.drivers.mic488.motion import MotionCommand, MotionKind, MoveEnd, Reason
from steptwin.drivers.mic488.unit import ControlRegisters
from steptwin.drivers.mic488.waiting import AxisWait, dynamics, wait_for
from steptwin.errors import LineFailure, Misuse
from steptwin.mic488.config import AxisConfig, ControllerConfig
from steptwin.mic488.registermap import DataType
from steptwin.mic488.status import AxisStatus

BEGIN = 100 * SECOND


class Unit:
    """A controller whose statuses the test gives, one after the other; its registers are ``values``."""

    def __init__(
        self, statuses: Sequence[object] = (), gear: float | None = 100.0, config: ControllerConfig | None = None
    ) -> None:
        self.statuses = list(statuses)
        self.scale = gear
        self.config = config
        self.values = {"POS_ACT": 3.0, "VEL_ACT": -4.0, "ACC": 8.0, "DEC": 5.0, "VMAX": 10.0}
        self.wording = SimpleNamespace(data_type=DataType.REAL)
        self.shared = SimpleNamespace(control=None)
        self.line: Any = self
        self.moment = BEGIN
        self.asked: list[int | None] = []
        self.slept: list[float] = []

    def now(self) -> int:
        return self.moment

    async def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.moment += round(seconds * SECOND)

    def item(self, key: str, axis: int) -> str:
        return f"{key}{axis}"

    async def read(self, items: Sequence[str], data_type: DataType) -> dict[str, float]:
        assert data_type is DataType.REAL
        return {item: self.values[item[:-1]] for item in items}

    def in_units(self, item: str, value: float, data_type: DataType) -> tuple[float, str]:
        return value, "mm"

    def unit_name(self, axis: int) -> str:
        return "mm"

    def gear(self, axis: int) -> float | None:
        return self.scale

    async def control(self, after: int | None = None) -> ControlRegisters:
        self.asked.append(after)
        status = self.statuses.pop(0)
        if isinstance(status, LineFailure):
            raise status
        axes = status if isinstance(status, tuple) else (status, status, 0, 0)
        return ControlRegisters(self.moment, DataType.REAL, 0, False, 0, axes)  # type: ignore[arg-type]


def judged(unit: Any, watch: AxisWait, status: int, at: int | None = None) -> MoveEnd | None:
    moment = unit.moment if at is None else at
    return finish(watch.judge(ControlRegisters(moment, DataType.REAL, 0, False, 0, (0, status, 0, 0))))


def limit_s(unit: Any, motion: MotionCommand | None, status: int, timeout_s: float | None = None) -> float:
    """After how many seconds in that status a wait is given up, to the millisecond."""
    watch = AxisWait(unit, 2, motion, timeout_s)
    while judged(unit, watch, status) is None:
        unit.moment += MILLISECOND
        assert unit.moment < BEGIN + 1000 * SECOND, "it waits for ever"
    return (unit.moment - BEGIN) / SECOND


def told(kind: MotionKind, value: float, before: int = 1) -> MotionCommand:
    return MotionCommand(kind, value, BEGIN, before)


@pytest.mark.parametrize(
    ("motion", "status", "seconds"),
    [
        # From 3 to 30, from -4: 0.8 s and 1.6 back; then 28.6, of which 6.25 and 10 are ramps of 1.25 s and 2 s.
        (told(MotionKind.POSITION, 30.0), AxisStatus.POSITION, 1.2 * (0.8 + 1.25 + 2.0 + (28.6 - 16.25) / 10) + 1.0),
        (told(MotionKind.DISTANCE, 27.0), AxisStatus.POSITION, 1.2 * (0.8 + 1.25 + 2.0 + (28.6 - 16.25) / 10) + 1.0),
        (told(MotionKind.VELOCITY, 0.0), AxisStatus.VELOCITY, 1.2 * 4.0 / 8.0 + 1.0),
        (told(MotionKind.VELOCITY, 5.0), AxisStatus.POSITION, 60.0),
        (told(MotionKind.HOMING, 5.0), AxisStatus.HOMING, 60.0),
        (None, AxisStatus.POSITION, 60.0),
        (None, AxisStatus.HOMING, 60.0),
        (None, AxisStatus.CORRECTION, 5.0),
    ],
)
def test_a_wait_without_time_is_given_up_after_1_2_times_the_computed_one_and_a_second(
    motion: MotionCommand | None, status: int, seconds: float
) -> None:
    assert limit_s(Unit(), motion, status) == pytest.approx(seconds, abs=0.002)


@pytest.mark.parametrize("timeout_s", [0.0, 0.5, 7.25])
def test_a_time_that_was_given_counts_from_the_beginning_of_the_wait_whatever_the_motion(timeout_s: float) -> None:
    for status in (AxisStatus.POSITION, AxisStatus.VELOCITY, AxisStatus.HOMING, AxisStatus.CORRECTION):
        assert limit_s(Unit(), told(MotionKind.POSITION, 30.0), status, timeout_s) == pytest.approx(timeout_s, abs=0.001)


def test_a_correction_has_time_of_its_own_after_the_motion() -> None:
    """5 s, or what the controller is configured to try for, and a second."""
    unit = Unit()
    watch = AxisWait(unit, 2, told(MotionKind.POSITION, 30.0), None)  # type: ignore[arg-type]
    assert judged(unit, watch, AxisStatus.POSITION) is None
    unit.moment += 6 * SECOND
    assert judged(unit, watch, AxisStatus.CORRECTION) is None
    unit.moment += 5 * SECOND - 1
    assert judged(unit, watch, AxisStatus.CORRECTION) is None
    unit.moment += 1
    end = judged(unit, watch, AxisStatus.CORRECTION)
    assert end is not None
    assert (end.reason, end.detail.endswith("for 11.0 s")) == (Reason.OVERDUE, True)
    for err, settle, seconds in ((2000, 500, 5.0), (7000, 500, 8.5)):
        axis = AxisConfig(err_time_ms=err, enc_settle_ms=settle)
        config = ControllerConfig(axes=(AxisConfig(), axis, AxisConfig(), AxisConfig()))
        assert limit_s(Unit(config=config), None, AxisStatus.CORRECTION) == pytest.approx(seconds, abs=0.002)


def test_only_a_status_read_after_the_limit_tells_that_it_is_exceeded() -> None:
    unit = Unit()
    watch = AxisWait(unit, 2, None, 1.0)  # type: ignore[arg-type]
    unit.moment += 5 * SECOND
    assert judged(unit, watch, AxisStatus.POSITION, BEGIN + SECOND - 1) is None
    end = judged(unit, watch, AxisStatus.POSITION, BEGIN + SECOND)
    assert end is not None
    assert (end.axis, end.position_u, end.unit, end.after_s) == (2, 3.0, "mm", 5.0)


def test_velocity_mode_needs_a_time() -> None:
    for motion in (None, told(MotionKind.VELOCITY, 1.0), told(MotionKind.POSITION, 0.0)):
        with pytest.raises(Misuse, match="M2 runs in velocity mode and does not end by itself: give timeout_s"):
            limit_s(Unit(), motion, AxisStatus.VELOCITY)


def test_a_status_just_after_the_command_may_still_be_the_one_of_before() -> None:
    unit = Unit()
    watch = AxisWait(unit, 2, told(MotionKind.POSITION, 3.0, before=AxisStatus.REACHED), None)  # type: ignore[arg-type]
    assert watch.after == BEGIN
    assert judged(unit, watch, AxisStatus.REACHED, BEGIN + 100 * MILLISECOND - 1) is None
    for status, at in ((AxisStatus.ON, BEGIN), (AxisStatus.REACHED, BEGIN + 100 * MILLISECOND)):
        end = judged(unit, watch, status, at)
        assert end is not None
    assert AxisWait(unit, 1, None, None).after == BEGIN  # type: ignore[arg-type]
    late = MotionCommand(MotionKind.POSITION, 3.0, BEGIN - SECOND, AxisStatus.REACHED)
    assert AxisWait(unit, 1, late, None).after == BEGIN - SECOND  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("target", "gear", "reason"),
    [
        (3.0, 100.0, Reason.TARGET),
        (3.005, 100.0, Reason.TARGET),
        (2.995, 100.0, Reason.TARGET),
        (3.0052, 100.0, Reason.DIVERTED),
        (2.9948, 100.0, Reason.DIVERTED),
        (3.0, None, Reason.TARGET),
        (3.4, None, Reason.RESTED),
        (50.0, None, Reason.DIVERTED),
    ],
)
def test_a_target_is_reached_to_half_a_pulse(target: float, gear: float | None, reason: Reason) -> None:
    unit = Unit(gear=gear)
    end = judged(unit, AxisWait(unit, 2, told(MotionKind.POSITION, target), None), AxisStatus.REACHED)  # type: ignore[arg-type]
    assert end is not None
    assert end.reason is reason
    assert end.detail == ("" if reason is Reason.TARGET else f"the target was {target:g} mm")
    distance = judged(unit, AxisWait(unit, 2, told(MotionKind.DISTANCE, target), None), AxisStatus.REACHED)  # type: ignore[arg-type]
    assert distance is not None
    assert distance.reason is Reason.TARGET


def test_a_position_on_the_way_tells_how_large_a_pulse_can_be() -> None:
    """It is read once, also where the time to wait is given."""
    for timeout_s in (None, 60.0):
        unit = Unit(gear=None)
        watch = AxisWait(unit, 2, told(MotionKind.POSITION, 4.0), timeout_s)  # type: ignore[arg-type]
        unit.values["POS_ACT"] = 0.25
        assert [judged(unit, watch, AxisStatus.POSITION) for _ in range(2)] == [None, None]
        unit.values["POS_ACT"] = 3.0
        end = judged(unit, watch, AxisStatus.REACHED)
        assert end is not None
        assert (end.reason, end.detail) == (Reason.DIVERTED, "the target was 4 mm")


def test_large_targets_are_known_to_24_bits() -> None:
    for target, reason in ((2.0**24 + 4.0, Reason.TARGET), (2.0**24 + 5.1, Reason.DIVERTED)):
        unit = Unit(gear=1.0)
        unit.values["POS_ACT"] = 2.0**24
        end = judged(unit, AxisWait(unit, 2, told(MotionKind.POSITION, target), None), AxisStatus.REACHED)  # type: ignore[arg-type]
        assert end is not None
        assert end.reason is reason


def test_a_stop_by_somebody_says_which_status_there_is() -> None:
    unit = Unit()
    end = judged(unit, AxisWait(unit, 2, told(MotionKind.POSITION, 5.0, before=4), None), AxisStatus.ON)  # type: ignore[arg-type]
    assert end is not None
    assert (end.reason, bool(end.detail)) == (Reason.STOPPED, True)
    limit = judged(unit, AxisWait(unit, 2, None, None), AxisStatus.LIMIT_L)  # type: ignore[arg-type]
    assert limit is not None
    assert (limit.reason, limit.detail) == (Reason.LIMIT_L, "")


@pytest.mark.parametrize("timeout_s", [-0.1, float("nan"), LONGEST_WAIT_S * 1.01])
def test_times_that_nobody_waits(timeout_s: float) -> None:
    with pytest.raises(Misuse, match=r"a time to wait of .* s is outside 0 to 1000000 s"):
        AxisWait(Unit(), 1, None, timeout_s)  # type: ignore[arg-type]


def test_the_dynamics_in_their_order() -> None:
    assert finish(dynamics(Unit(), 3)) == (3.0, -4.0, 8.0, 5.0, 10.0)  # type: ignore[arg-type]


def watches(unit: Any, *motions: MotionCommand | None) -> dict[int, AxisWait]:
    return {axis: AxisWait(unit, axis, motion, 10.0) for axis, motion in enumerate(motions, start=1)}


def test_all_are_waited_for_every_50_ms_with_statuses_of_30_ms_at_most() -> None:
    unit = Unit([(2, 2, 0, 0), (4, 2, 0, 0), (4, 4, 0, 0)])
    early = MotionCommand(MotionKind.DISTANCE, 1.0, BEGIN - SECOND, 1)
    ends = finish(wait_for(unit, watches(unit, early, None), check=True))  # type: ignore[arg-type]
    assert {axis: end.reason for axis, end in ends.items()} == {1: Reason.TARGET, 2: Reason.TARGET}
    assert unit.slept == [0.05, 0.05]
    assert unit.asked == [BEGIN, BEGIN + 20 * MILLISECOND, BEGIN + 70 * MILLISECOND]
    assert [end.after_s for end in ends.values()] == [pytest.approx(0.05), pytest.approx(0.1)]


@pytest.mark.parametrize("check", [True, False])
def test_a_line_that_fails_ends_it_for_those_who_still_move(check: bool) -> None:
    failure = LineFailure("gone")
    unit = Unit([(4, 2, 0, 0), failure])
    if check:
        with pytest.raises(LineFailure, match="gone"):
            finish(wait_for(unit, watches(unit, None, None), check=True))  # type: ignore[arg-type]
        return
    ends = finish(wait_for(unit, watches(unit, None, None), check=False))  # type: ignore[arg-type]
    assert ends[1].reason is Reason.TARGET
    assert ends[2] == MoveEnd(2, Reason.COMMUNICATION, None, "mm", 0.05, "gone", failure)
