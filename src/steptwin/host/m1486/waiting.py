"""Waiting until a chip has done what it was told, and telling why a motion ended."""

from __future__ import annotations

from collections.abc import Callable

from steptwin.errors import LineFailure, Misuse
from steptwin.host.m1486.motion import MARGIN, MARGIN_S, UNKNOWN_S, ChipMotion, ChipMoveEnd, ChipReason, Told
from steptwin.host.m1486.unit import SLICE_NS, Unit
from steptwin.host.m1486.watching import early_ns, watch
from steptwin.machine import SECOND, Nanos


async def wait_for(
    unit: Unit, timeout_s: float | None, unit_name: str, shown: Callable[[int], float], *, check: bool
) -> ChipMoveEnd:
    """See `steptwin.host.m1486.driver.AsyncM1486.wait`. ``shown`` turns the counter into a position.

    A line that fails is raised with ``check``, else it is the end.
    """
    notes = unit.notes
    motion = notes.motion
    begin = unit.line.now()

    def ended(reason: ChipReason, position: float | None, detail: str, cause: Exception | None = None) -> ChipMoveEnd:
        seconds = (unit.line.now() - begin) / SECOND
        return ChipMoveEnd(unit.address, reason, position, unit_name, seconds, detail, cause)

    limit = begin + round((_time_out_s(unit, motion) if timeout_s is None else timeout_s) * SECOND)
    try:
        if motion is not None and not unit.is_alone:
            await watch(unit, motion, limit)
        async with unit.turn():
            if motion is None or motion.over_at is None:
                letter = await unit.asks_who(max(limit - unit.line.now(), SLICE_NS))
                if letter is None:
                    is_stopped = motion is not None and motion.stops != notes.stops
                    return ended(ChipReason.STOPPED if is_stopped else ChipReason.OVERDUE, None, unit.why_busy())
            over_at = unit.line.now() - unit.write_ns if motion is None or motion.over_at is None else motion.over_at
            counter = await unit.read_number(1, rests=True)
            notes.motion = None
    except LineFailure as failure:
        if check:
            raise
        return ended(ChipReason.COMMUNICATION, None, str(failure), failure)
    reason, detail = _reason(unit, motion, counter, over_at)
    if reason is ChipReason.DIVERTED and motion is not None and motion.target_u is not None:
        detail = f"the target was {shown(motion.target_u):g} {unit_name}"
    if motion is not None and motion.kind is ChipMotion.MOVE and reason in (ChipReason.EARLY, ChipReason.STOPPED):
        notes.is_position_valid = False  # M-16
    return ended(reason, shown(counter) if notes.is_position_valid else None, detail)


def _time_out_s(unit: Unit, motion: Told | None) -> float:
    if motion is None or motion.stops != unit.notes.stops:
        return UNKNOWN_S
    if motion.kind is ChipMotion.ENDLESS:
        raise Misuse(f"{unit.name} runs without end: give the time to wait, timeout_s")
    return UNKNOWN_S if motion.duration_s is None else MARGIN * motion.duration_s + MARGIN_S


_ENDS = {ChipMotion.ENDLESS: ChipReason.LIMIT, ChipMotion.SEEK: ChipReason.SOUGHT}


def _reason(unit: Unit, motion: Told | None, counter: int, over_at: Nanos) -> tuple[ChipReason, str]:
    """Why it ended, and more of it. ``over_at``: when it was seen to have ended."""
    if motion is None:
        return ChipReason.REST, ""
    if motion.stops != unit.notes.stops:
        return ChipReason.STOPPED, ""
    if motion.kind is ChipMotion.BLOCK:
        is_whole = unit.talk.spoilt.get(unit.address, 0) == motion.spoilt
        return (ChipReason.DONE if is_whole else ChipReason.CUT), ""
    if motion.kind in _ENDS:
        return _ENDS[motion.kind], ""
    if motion.target_u is not None and counter != motion.target_u:
        return ChipReason.DIVERTED, ""
    if motion.duration_s is not None and over_at < early_ns(motion):
        return ChipReason.EARLY, f"after at most {(over_at - motion.at) / SECOND:.2f} s of {motion.duration_s:.2f} s"
    return ChipReason.TARGET, ""
