"""Waiting until a chip has executed its commands, and finding why a motion ended."""

from __future__ import annotations

from collections.abc import Callable

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.drivers.line import check_wait
from steptwin.drivers.m1486.motion import MARGIN, MARGIN_S, UNKNOWN_S, ChipMotion, ChipMotionCommand, ChipMoveEnd, ChipReason
from steptwin.drivers.m1486.unit import ASK_AGAIN_NS, SLICE_NS, ChipUnit
from steptwin.drivers.m1486.watching import early_ns, watch
from steptwin.errors import LineFailure, Misuse

ANSWERED_NS: Nanos = 40 * MILLISECOND
"""A chip that takes longer to answer moved when it was asked, ns; adapters delay the answer of one at rest."""


async def wait_for(
    unit: ChipUnit, timeout_s: float | None, unit_name: str, shown: Callable[[int], float], *, check: bool
) -> ChipMoveEnd:
    """See `steptwin.drivers.m1486.driver.AsyncM1486.wait`. ``shown`` turns the counter into a position.

    A failing line is raised with ``check``, else returned as the end.
    """
    check_wait(timeout_s)
    shared = unit.shared
    motion = shared.motion
    begin = unit.line.now()

    def ended(
        reason: ChipReason, position: float | None, detail: str, cause: Exception | None = None, target_u: int | None = None
    ) -> ChipMoveEnd:
        seconds = (unit.line.now() - begin) / SECOND
        target = None if target_u is None else shown(target_u)
        return ChipMoveEnd(unit.address, reason, position, unit_name, seconds, detail, cause, target)

    limit = begin + round((_time_out_s(unit, motion) if timeout_s is None else timeout_s) * SECOND)
    try:
        if motion is not None and not unit.is_alone:
            await watch(unit, motion, limit)
        async with unit.turn():
            if motion is None or motion.over_at is None:
                marked = motion if motion is not None and motion.is_marked and unit.talk.uploads is shared.uploads else None
                if marked is not None:
                    await _end_of_block(unit, limit)
                letter = await unit.query_type(max(limit - unit.line.now(), SLICE_NS))
                if marked is not None and letter is not None:
                    marked.is_unfinished = not shared.uploads
                    shared.uploads = None
                if letter is None:
                    is_stopped = motion is not None and motion.stops != shared.stops
                    return ended(ChipReason.STOPPED if is_stopped else ChipReason.OVERDUE, None, unit.why_busy())
                if motion is not None and motion.label is not None and await unit.runs_at_once():
                    return ended(ChipReason.OVERDUE, None, f"its end leads to the J behind it, and to label {motion.label} again")
            over_at = unit.line.now() - unit.write_ns if motion is None or motion.over_at is None else motion.over_at
            counter = await unit.read_number(1, rests=True)
            shared.motion = None
    except LineFailure as failure:
        if check:
            raise
        return ended(ChipReason.COMMUNICATION, None, str(failure), failure)
    reason, detail = _reason(unit, motion, counter, over_at)
    if motion is not None and motion.kind is ChipMotion.MOVE and reason in (ChipReason.EARLY, ChipReason.STOPPED):
        shared.is_position_valid = False  # M-16
    is_in_doubt = motion is not None and reason in (ChipReason.CAME_TO_REST, ChipReason.DIVERTED)
    target_u = motion.target_u if motion is not None and is_in_doubt else None
    return ended(reason, shown(counter) if shared.is_position_valid else None, detail, target_u=target_u)


async def _end_of_block(unit: ChipUnit, limit: Nanos) -> None:
    """Wait until a block has sent its mark, the chip answers without it, or ``limit``."""
    line, talk, shared = unit.line, unit.talk, unit.shared
    begin = line.now()
    while not shared.uploads and unit.address not in talk.arrived and line.now() < limit:
        is_first = not talk.owes(unit.address) and line.now() >= begin + ASK_AGAIN_NS
        if is_first or unit.should_ask_again(2 * ASK_AGAIN_NS):
            await unit.ask()
        await unit.receive_upload(SLICE_NS)


def _time_out_s(unit: ChipUnit, motion: ChipMotionCommand | None) -> float:
    if motion is None or motion.stops != unit.shared.stops:
        return UNKNOWN_S
    if motion.kind is ChipMotion.ENDLESS:
        raise Misuse(f"{unit.name} runs without end: give timeout_s")
    return UNKNOWN_S if motion.duration_s is None else MARGIN * motion.duration_s + MARGIN_S


_ENDS = {ChipMotion.ENDLESS: ChipReason.LIMIT, ChipMotion.SEEK: ChipReason.SOUGHT}


def _reason(unit: ChipUnit, motion: ChipMotionCommand | None, counter: int, over_at: Nanos) -> tuple[ChipReason, str]:
    """The reason of the end, and details. ``over_at``: the time at which the end was detected."""
    if motion is None:
        return ChipReason.REST, ""
    if motion.stops != unit.shared.stops:
        return ChipReason.STOPPED, ""
    if motion.kind is ChipMotion.BLOCK:
        if unit.talk.spoilt.get(unit.address, 0) != motion.spoilt:
            return ChipReason.CUT, "by the driver: what drops a command that did not come back as it was sent ends a program, too"
        if motion.label is not None:
            return ChipReason.CUT, "a program that is started at a label has no end: wrong data or another program have ended it"
        if motion.is_unfinished:
            return ChipReason.CUT, "a command was wrong data when it was executed, or its end was not received"
        return ChipReason.DONE, ""
    if motion.kind in _ENDS:
        return _ENDS[motion.kind], ""
    if motion.target_u is not None and counter != motion.target_u:
        return ChipReason.DIVERTED, ""
    return _end_of_move(motion, over_at)


def _end_of_move(motion: ChipMotionCommand, over_at: Nanos) -> tuple[ChipReason, str]:
    """The reason of the end of a move whose counter shows the target, as it does after a stop, too (M-16): only one that still
    moved shortly before its computed end is known to have reached it."""
    duration_s = motion.duration_s
    if duration_s is None:
        return ChipReason.CAME_TO_REST, "its duration is not known without all settings, so LIMIT may have ended it"
    if over_at < early_ns(motion):
        return ChipReason.EARLY, f"after at most {(over_at - motion.at) / SECOND:.2f} s of {duration_s:.2f} s"
    asked_at = over_at if motion.asked_at is None else motion.asked_at
    if duration_s > 0.0 and asked_at > early_ns(motion) and over_at - asked_at < ANSWERED_NS:
        return ChipReason.CAME_TO_REST, "it was asked only at its computed end, so LIMIT may have ended it before"
    return ChipReason.TARGET, ""
