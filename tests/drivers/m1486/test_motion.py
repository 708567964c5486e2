"""When a motion of a chip is over for certain, and ends in words."""

from __future__ import annotations

import pytest

from steptwin.drivers.exchange import LineLost
from steptwin.drivers.m1486.failures import DoubtfulMove, Garbled, NoEcho, NoRoom, Restarted, untold
from steptwin.drivers.m1486.motion import ChipMotion, ChipMoveEnd, ChipReason, Told
from steptwin.drivers.m1486.watching import early_ns, end_ns
from steptwin.machine import SECOND

AT = 50 * SECOND


@pytest.mark.parametrize("duration_s", [0.5, 10.0])
def test_a_motion_is_over_after_1_2_times_its_duration_and_a_second(duration_s: float) -> None:
    motion = Told(ChipMotion.MOVE, AT, 0, duration_s=duration_s)
    over = AT + round((1.2 * duration_s + 1.0) * SECOND)
    assert not motion.is_over(over)
    assert motion.is_over(over + 1)
    assert end_ns(motion) == AT + round(duration_s * SECOND)
    assert early_ns(motion) == AT + round((0.98 * duration_s - 0.05) * SECOND)


def test_a_motion_without_known_duration_is_never_over_for_certain() -> None:
    motion = Told(ChipMotion.ENDLESS, AT, 0)
    assert not motion.is_over(AT + 10**9 * SECOND)
    assert end_ns(motion) == AT
    assert (motion.target_u, motion.spoilt, motion.is_marked, motion.is_unfinished, motion.over_at) == (
        None,
        0,
        False,
        False,
        None,
    )


def test_an_end_in_words() -> None:
    end = ChipMoveEnd(15, ChipReason.EARLY, 2.5, "mm", 1.0, "why")
    assert str(end) == "chip F: ended before its time (LIMIT, or Kill by somebody) at 2.5 mm (why)"
    assert str(ChipMoveEnd(None, ChipReason.TARGET, None, "mm", 1.0)) == "the chip: target reached"
    assert {reason for reason in ChipReason if ChipMoveEnd(1, reason, 0.0, "step", 0.0).ok} == {
        ChipReason.TARGET,
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
        "it is not known whether the chip has acted on it"
    )
    assert str(garbled[False]).endswith(": nothing instead of 'f64'; it was not carried out")
    assert str(NoEcho("bus", "chip 7", lost)) == (
        "bus: chip 7 does not echo: it is off, has another address or baud rate, or still does what it was told before (gone)"
    )
    assert str(Restarted("bus", "chip 7")) == (
        "bus: chip 7 was switched off or reset meanwhile: its settings are those of power-up, and where it stands is not known; "
        "nothing was carried out"
    )
    assert str(DoubtfulMove("chip 7", "a move", lost)) == (
        "it is not known whether chip 7 has begun a move: the command was sent once and is not repeated (gone); "
        "stop it, or wait for it and look at its position"
    )
    assert str(untold("chip 7", lost)) == (
        "chip 7 could not be stopped: it cannot be told, and goes on with what it was told before (gone)"
    )
    assert (NoEcho("", "", None).uncertain, Restarted("", "").uncertain, DoubtfulMove("", "", lost).uncertain) == (
        False,
        False,
        True,
    )
