"""Several chips that move at once on one line: whoever waits for one of them watches the ends of all whose time is known.

A chip says when it is at rest (it answers ``U20``), but its answer does not say whose it is, and it may come into what others
say. So the line is left to all until shortly before a move should be over. Then, with the line to itself, the watch asks each
chip whose end is near, and listens. An answer at the time computed for a chip is taken for its. One that comes at any other
time is somebody's who was stopped early: the chips are asked again one by one, and who is at rest answers at once.
"""

from __future__ import annotations

from steptwin.drivers.m1486.failures import Restarted
from steptwin.drivers.m1486.motion import EARLY, EARLY_S, ChipMotionCommand
from steptwin.drivers.m1486.talk import WHO
from steptwin.drivers.m1486.unit import SLICE_NS, ChipNotes, ChipUnit
from steptwin.errors import LineFailure, Refusal
from steptwin.machine import MILLISECOND, SECOND, Nanos

ASK_NS: Nanos = 80 * MILLISECOND
"""What asking takes beside the time on the wire: each of its steps waits for an echo."""
PEEK_NS: Nanos = 60 * MILLISECOND
"""A chip that is at rest answers so soon, through adapters that hold bytes back too."""
BURST_NS: Nanos = 20 * MILLISECOND
"""Letters that come one behind the other are no farther apart."""
GRACE_NS: Nanos = 300 * MILLISECOND
"""A move that goes on for so long after its time is overdue; it is not watched any more."""


def early_ns(motion: ChipMotionCommand) -> Nanos:
    """A move that is over before did not go all its way."""
    duration_s = motion.duration_s or 0.0
    return motion.at + round((EARLY * duration_s - EARLY_S) * SECOND)


def end_ns(motion: ChipMotionCommand) -> Nanos:
    return motion.at + round((motion.duration_s or 0.0) * SECOND)


def _is_watched(notes: ChipNotes, now: Nanos) -> bool:
    """Whether the chip makes a move whose end is known in advance and has not been seen."""
    motion = notes.motion
    return (
        motion is not None
        and bool(motion.duration_s)
        and motion.over_at is None
        and motion.stops == notes.stops
        and now < end_ns(motion) + GRACE_NS
    )


async def watch(unit: ChipUnit, motion: ChipMotionCommand, limit: Nanos) -> None:
    """Until the end of ``motion`` was seen (`ChipMotionCommand.over_at`), until ``limit``, or until nothing is left to watch."""
    line = unit.line
    while _is_watched(unit.notes, now := line.now()) and unit.notes.motion is motion and now < limit:
        due = min(_Watch(unit).begins().values(), default=now)
        if due > now:
            await line.sleep(min(due - now, limit - now, 2 * SLICE_NS) / SECOND)
            continue
        async with unit.turn():
            if _is_watched(unit.notes, line.now()):
                await _Watch(unit).run(limit)


class _Mover:
    """A chip whose end is near."""

    def __init__(self, unit: ChipUnit, motion: ChipMotionCommand) -> None:
        self.unit = unit
        self.motion = motion
        self.owed = 0

    def rest_at(self, at: Nanos) -> Nanos:
        """When it was at rest if this is its answer: an E type writes the question into its EEPROM before."""
        return at - self.unit.write_ns

    def is_near(self, at: Nanos) -> bool:
        """Whether its end is to be expected at that time."""
        if self.motion.stops != self.unit.notes.stops:
            return True
        return early_ns(self.motion) <= self.rest_at(at) < end_ns(self.motion) + GRACE_NS

    @property
    def has_room(self) -> bool:
        """Whether one more question can lie in its input buffer, which is not emptied while it moves."""
        return 8 * (self.owed + 2) * (len(WHO) + 1) <= self.unit.variant.input_bits

    def is_late(self, now: Nanos) -> bool:
        return self.rest_at(now) >= end_ns(self.motion) + GRACE_NS


class _Watch:
    """One watch, with the line to itself."""

    def __init__(self, own: ChipUnit) -> None:
        self._own = own
        self._movers: dict[int | None, _Mover] = {}
        self._given_up: set[int | None] = set()
        self._asked_last: _Mover | None = None
        self._left = 0
        """Answers still to come from chips that are known to be at rest."""
        self._unclear: list[Nanos] = []
        """When answers came that may be of any of those whose end is to be expected."""

    def begins(self) -> dict[int | None, Nanos]:
        """When each chip is to be asked, who was not yet."""
        line = self._own.line
        now = line.now()
        moving: dict[int | None, ChipMotionCommand] = {}
        for address in line.notes["m1486 chips"]:
            notes: ChipNotes = line.notes[("m1486", address)]
            if notes.motion is not None and _is_watched(notes, now):
                moving[address] = notes.motion
        lead = len(moving) * (ASK_NS + self._own.talk.wire_ns(20))
        known = self._movers.keys() | self._given_up
        return {address: early_ns(motion) - lead for address, motion in moving.items() if address not in known}

    async def run(self, limit: Nanos) -> None:
        """Until all chips that were asked are at rest, or overdue."""
        line, talk = self._own.line, self._own.talk
        talk.letters = 0
        try:
            while True:
                for address, due in self.begins().items():
                    if due <= line.now():
                        await self._begin(address)
                now = line.now()
                if all(mover.is_late(now) for mover in self._waited_for()) or now >= limit:
                    await self._sort_out()
                    return
                await self._own.hear_letter(SLICE_NS)
                await self._attribute()
        finally:
            talk.end_watch({address: mover.owed for address, mover in self._movers.items()}, self._left)

    def _waited_for(self) -> list[_Mover]:
        return [mover for mover in self._movers.values() if mover.motion.over_at is None]

    async def _begin(self, address: int | None) -> None:
        own = self._own
        unit = own if address == own.address else ChipUnit(own.line, address, timeout_ns=own.timeout_ns)
        motion = unit.notes.motion
        if motion is None:
            return
        mover = self._movers[address] = _Mover(unit, motion)
        try:
            await self._ask(mover)
        except (LineFailure, Refusal) as failure:
            # Who uses that chip is told; others are not troubled with it.
            if unit is own:
                raise
            if isinstance(failure, Restarted):
                unit.notes.restarted = failure
            del self._movers[address]
            self._given_up.add(address)
            return
        if not self._own.talk.letters:
            await self._own.hear_letter(PEEK_NS + unit.write_ns)
        self._asked_last = mover
        await self._attribute()
        self._asked_last = None

    async def _ask(self, mover: _Mover) -> None:
        await mover.unit.ask()
        mover.owed = self._own.talk.owes(mover.unit.address)

    # ------------------------------------------------------------------ whose answer it is

    async def _attribute(self) -> None:
        """Find out whose the letters are that have come."""
        talk = self._own.talk
        while talk.letters:
            at = self._own.line.now()
            count = await self._burst()
            waited_for = sorted(self._waited_for(), key=lambda mover: end_ns(mover.motion))
            if not waited_for or not count:
                continue
            if all(mover.is_near(at) and mover.owed == 1 for mover in waited_for):
                self._unclear += [at] * count
                if len(self._unclear) >= len(waited_for):
                    for mover in waited_for:
                        self._is_over(mover, self._unclear.pop(0))
                    self._unclear.clear()
                continue
            # Who was asked several times answers several times.
            alike = [mover for mover in waited_for if mover.owed == count] or waited_for
            # Likeliest is who was asked just now, for it may have been at rest before; then those whose end is near.
            alike.sort(key=lambda m: (m is not self._asked_last, not m.is_near(at)))
            await self._search(alike, at, count)

    async def _burst(self) -> int:
        """How many letters have come one behind the other, beside those still to come from chips known to be at rest."""
        talk = self._own.talk
        count = talk.letters or 0
        while count:
            await self._own.hear_letter(BURST_NS + talk.wire_ns(2))
            if talk.letters == count:
                break
            count = talk.letters or 0
        talk.letters = 0
        known = min(count, self._left)
        self._left -= known
        return count - known

    async def _sort_out(self) -> None:
        """Not all of those have answered of whom it was to be expected: find out who has."""
        while self._unclear:
            await self._search(self._waited_for(), self._unclear.pop(0), 1)

    async def _search(self, movers: list[_Mover], at: Nanos, count: int) -> None:
        """One of these has answered ``count`` times: ask again, one after the other; who is at rest answers at once."""
        talk = self._own.talk
        for mover in movers:
            if mover is movers[-1]:
                self._is_over(mover, at, count)
            elif mover.has_room:
                try:
                    await self._ask(mover)
                except (LineFailure, Refusal):
                    continue
                if not talk.letters:
                    await self._own.hear_letter(PEEK_NS + mover.unit.write_ns)
                if talk.letters:
                    self._is_over(mover, at, count)
                    return

    def _is_over(self, mover: _Mover, at: Nanos, count: int = 1) -> None:
        mover.motion.over_at = mover.rest_at(at)
        mover.unit.notes.is_killed = False
        self._left += max(mover.owed - count, 0)
        mover.owed = 0
