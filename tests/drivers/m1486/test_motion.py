"""When a motion of a chip is over for certain, and ends in words."""

from __future__ import annotations

import asyncio
from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import pytest

from steptwin.controller import SECOND
from steptwin.drivers.exchange import LineLost
from steptwin.drivers.m1486.failures import DoubtfulMove, Garbled, NoEcho, NoRoom, Restarted, unconfirmed
from steptwin.drivers.m1486.motion import ChipMotion, ChipMotionCommand, ChipMoveEnd, ChipReason
from steptwin.drivers.m1486.sharedstate import SharedChipState
from steptwin.drivers.m1486.watching import _is_watched, _Mover, early_ns, watch

AT = 50 * SECOND


@pytest.mark.parametrize("duration_s", [0.5, 10.0])
def test_a_motion_is_over_after_1_2_times_its_duration_and_a_second(duration_s: float) -> None:
    motion = ChipMotionCommand(ChipMotion.MOVE, AT, 0, duration_s=duration_s)
    over = AT + round((1.2 * duration_s + 1.0) * SECOND)
    assert not motion.is_over(over)
    assert motion.is_over(over + 1)
    assert motion.end == AT + round(duration_s * SECOND)
    assert early_ns(motion) == AT + round((0.98 * duration_s - 0.05) * SECOND)


def test_a_motion_without_known_duration_is_never_over_for_certain() -> None:
    motion = ChipMotionCommand(ChipMotion.ENDLESS, AT, 0)
    assert not motion.is_over(AT + 10**9 * SECOND)
    assert motion.end == AT
    assert (motion.target_u, motion.spoilt, motion.is_marked, motion.is_unfinished, motion.over_at) == (
        None,
        0,
        False,
        False,
        None,
    )


def test_an_end_in_words() -> None:
    end = ChipMoveEnd(15, ChipReason.EARLY, 2.5, "mm", 1.0, "why")
    assert str(end) == "chip F: ended early (LIMIT, or Kill from another program) at 2.5 mm (why)"
    assert str(ChipMoveEnd(None, ChipReason.TARGET, None, "mm", 1.0)) == "the chip: target reached"
    assert {reason for reason in ChipReason if ChipMoveEnd(1, reason, 0.0, "step", 0.0).ok} == {
        ChipReason.TARGET,
        ChipReason.CAME_TO_REST,
        ChipReason.SOUGHT,
        ChipReason.REST,
        ChipReason.DONE,
    }


def test_failures_in_words() -> None:
    lost = LineLost("gone")
    assert str(NoRoom("bus", "chip 7: f64")) == (
        "bus: 'chip 7: f64' was refused: the input buffer has no room (5EH); the chip moves, waits or its program is held"
    )
    garbled = {
        doubt: Garbled("bus", "chip 7: f64", b"f64", heard, uncertain=doubt) for doubt, heard in ((True, b"f6\xb4"), (False, b""))
    }
    assert [error.uncertain for error in garbled.values()] == [True, False]
    assert str(garbled[True]) == (
        "bus: 'chip 7: f64' did not come back as it was sent: 'f6´' instead of 'f64'; "
        "it is unknown whether the chip has executed it"
    )
    assert str(garbled[False]).endswith(": nothing instead of 'f64'; it was not executed")
    assert str(NoEcho("bus", "chip 7", lost)) == (
        "bus: chip 7 does not echo: it is off, has another address or baud rate, or is still busy with an earlier command (gone)"
    )
    assert str(Restarted("bus", "chip 7")) == (
        "bus: chip 7 was switched off or reset meanwhile: its settings are those of power-up, its position is unknown; "
        "nothing was executed"
    )
    assert str(DoubtfulMove("chip 7", "a move", lost)) == (
        "it is unknown whether chip 7 has begun a move: the command was sent once and is not repeated (gone); "
        "stop it, or wait for it and check its position"
    )
    assert str(unconfirmed("chip 7", lost)) == (
        "chip 7 could not be stopped: it cannot be reached and continues its last command (gone)"
    )
    assert (NoEcho("", "", None).uncertain, Restarted("", "").uncertain, DoubtfulMove("", "", lost).uncertain) == (
        False,
        False,
        True,
    )


class Waited:
    """What a mover asks of its unit: one with an EEPROM that takes 0.5 s for a question."""

    def __init__(self, stops: int = 0) -> None:
        self.shared = SharedChipState()
        self.shared.stops = stops
        self.write_ns = SECOND // 2


def test_when_the_end_of_a_motion_is_expected() -> None:
    """From 98 % of its time less 50 ms on, until 300 ms after it; an E type writes the question down before it answers."""
    motion = ChipMotionCommand(ChipMotion.MOVE, AT, 0, duration_s=10.0)
    mover = _Mover(Waited(), motion)  # type: ignore[arg-type]
    first, last = AT + SECOND // 2 + 9_750_000_000, AT + SECOND // 2 + 10_300_000_000
    assert [mover.is_near(at) for at in (first - 1, first, last - 1, last)] == [False, True, True, False]
    assert [mover.is_late(at) for at in (last - 1, last)] == [False, True]
    assert _Mover(Waited(stops=1), motion).is_near(AT), "it was stopped: any time may be its end"  # type: ignore[arg-type]


def test_a_motion_is_watched_until_300_ms_after_its_time() -> None:
    shared = SharedChipState()
    assert not _is_watched(shared, AT)
    shared.motion = ChipMotionCommand(ChipMotion.MOVE, AT, 0, duration_s=10.0)
    end = AT + 10_300_000_000
    assert [_is_watched(shared, at) for at in (AT, end - 1, end)] == [True, True, False]
    shared.stops = 1
    assert not _is_watched(shared, AT)
    shared.stops = 0
    shared.motion.over_at = AT
    assert not _is_watched(shared, AT)
    shared.motion = ChipMotionCommand(ChipMotion.ENDLESS, AT, 0)
    assert not _is_watched(shared, AT)


def test_a_watch_ends_where_its_time_has_passed_in_a_suspension() -> None:
    """It has just seen that the motion is not over, then comes the suspension."""
    motion = ChipMotionCommand(ChipMotion.MOVE, AT, 0, duration_s=10.0)
    shared = SharedChipState()
    shared.motion = motion
    moments = iter([AT + 10_299_999_999])
    line = SimpleNamespace(
        now=lambda: next(moments, AT + 60 * SECOND), shared={"m1486 chips": [None], ("m1486", None): shared}, sleep=pytest.fail
    )
    unit: Any = SimpleNamespace(line=line, shared=shared, talk=SimpleNamespace(wire_ns=lambda count: count), turn=nullcontext)
    asyncio.run(watch(unit, motion, AT + 100 * SECOND))
    assert next(moments, None) is None
    assert motion.over_at is None
