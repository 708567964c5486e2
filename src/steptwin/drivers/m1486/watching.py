"""Several chips that move at once on one line: a wait for one of them watches the ends of all whose duration is known.

A chip answers ``U20`` when it is at rest, but the answer carries no sender and may collide with other exchanges. So the line
is free for all until shortly before the computed end of a move. Then the watch holds the line and queries each chip whose end
is near. An answer at the computed time of a chip is assigned to it. An answer at another time is from a chip that was stopped
early: the chips are queried again one by one, and the one at rest answers at once.
"""

from __future__ import annotations

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.drivers.m1486.failures import Restarted
from steptwin.drivers.m1486.motion import EARLY, EARLY_S, ChipMotionCommand
from steptwin.drivers.m1486.sharedstate import SharedChipState
from steptwin.drivers.m1486.talk import TYPE_QUERY
from steptwin.drivers.m1486.unit import SLICE_NS, ChipUnit
from steptwin.errors import LineFailure, Refusal

ASK_NS: Nanos = 80 * MILLISECOND
"""Duration of a query in addition to the time on the wire, ns: each step waits for an echo."""
PEEK_NS: Nanos = 60 * MILLISECOND
"""Longest response time of a chip at rest, with adapters that delay bytes, ns."""
BURST_NS: Nanos = 20 * MILLISECOND
"""Longest gap between letters of one burst, ns."""
GRACE_NS: Nanos = 300 * MILLISECOND
"""A move that lasts this much longer than computed is overdue and no longer watched, ns."""


def early_ns(motion: ChipMotionCommand) -> Nanos:
    """A move that ends before this time ended early, ns."""
    duration_s = motion.duration_s or 0.0
    return motion.at + round((EARLY * duration_s - EARLY_S) * SECOND)


def _is_watched(shared: SharedChipState, now: Nanos) -> bool:
    """Whether the chip makes a move with a computed end that has not been detected yet."""
    motion = shared.motion
    return (
        motion is not None
        and bool(motion.duration_s)
        and motion.over_at is None
        and motion.stops == shared.stops
        and now < motion.end + GRACE_NS
    )


async def watch(unit: ChipUnit, motion: ChipMotionCommand, limit: Nanos) -> None:
    """Watch until the end of ``motion`` is detected (`ChipMotionCommand.over_at`), until ``limit``, or until nothing is left to
    watch."""
    line = unit.line
    while _is_watched(unit.shared, now := line.now()) and unit.shared.motion is motion and now < limit:
        due = min(_Watch(unit).begins().values(), default=now)  # none where the program was suspended meanwhile
        if due > now:
            await line.sleep(min(due - now, limit - now, 2 * SLICE_NS) / SECOND)
        else:
            async with unit.turn():
                if _is_watched(unit.shared, line.now()):
                    await _Watch(unit).run(limit)


class _Mover:
    """A chip whose end is near."""

    def __init__(self, unit: ChipUnit, motion: ChipMotionCommand) -> None:
        self.unit = unit
        self.motion = motion
        self.owed = 0

    def rest_at(self, at: Nanos) -> Nanos:
        """The time since which it is at rest, if this is its answer: an E type first writes the query into its EEPROM."""
        return at - self.unit.write_ns

    def is_near(self, at: Nanos) -> bool:
        """Whether its end is expected at that time."""
        if self.motion.stops != self.unit.shared.stops:
            return True
        return early_ns(self.motion) <= self.rest_at(at) < self.motion.end + GRACE_NS

    @property
    def has_room(self) -> bool:
        """Whether one more query fits into its input buffer, which is not emptied while it moves."""
        return 8 * (self.owed + 2) * (len(TYPE_QUERY) + 1) <= self.unit.variant.input_bits

    def is_late(self, now: Nanos) -> bool:
        return self.rest_at(now) >= self.motion.end + GRACE_NS


class _Watch:
    """One watch, which holds the line."""

    def __init__(self, own: ChipUnit) -> None:
        self._own = own
        self._movers: dict[int | None, _Mover] = {}
        self._given_up: set[int | None] = set()
        self._asked_last: _Mover | None = None
        self._left = 0
        """Number of pending answers from chips known to be at rest."""
        self._unclear: list[Nanos] = []
        """Times of answers that may be from any of the chips whose end is expected."""

    def begins(self) -> dict[int | None, Nanos]:
        """The times at which the remaining chips are to be queried."""
        line = self._own.line
        now = line.now()
        moving: dict[int | None, ChipMotionCommand] = {}
        for address in line.shared["m1486 chips"]:
            shared: SharedChipState = line.shared[("m1486", address)]
            if shared.motion is not None and _is_watched(shared, now):
                moving[address] = shared.motion
        lead = len(moving) * (ASK_NS + self._own.talk.wire_ns(20))
        known = self._movers.keys() | self._given_up
        return {address: early_ns(motion) - lead for address, motion in moving.items() if address not in known}

    async def run(self, limit: Nanos) -> None:
        """Watch until all queried chips are at rest or overdue."""
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
                await self._own.receive_letter(SLICE_NS)
                await self._attribute()
        finally:
            talk.end_watch({address: mover.owed for address, mover in self._movers.items()}, self._left)

    def _waited_for(self) -> list[_Mover]:
        return [mover for mover in self._movers.values() if mover.motion.over_at is None]

    async def _begin(self, address: int | None) -> None:
        own = self._own
        unit = own if address == own.address else ChipUnit(own.line, address, timeout_ns=own.timeout_ns)
        motion = unit.shared.motion
        if motion is None:
            return
        mover = self._movers[address] = _Mover(unit, motion)
        try:
            await self._ask(mover)
        except (LineFailure, Refusal) as failure:
            self._give_up(unit, failure)
            return
        if not self._own.talk.letters:
            await self._own.receive_letter(PEEK_NS + unit.write_ns)
        self._asked_last = mover
        await self._attribute()
        self._asked_last = None

    def _give_up(self, unit: ChipUnit, failure: LineFailure | Refusal) -> None:
        """Only the driver of that chip gets the error."""
        if unit is self._own:
            raise failure
        if isinstance(failure, Restarted):
            unit.shared.restarted = failure
        del self._movers[unit.address]
        self._given_up.add(unit.address)

    async def _ask(self, mover: _Mover) -> None:
        await mover.unit.ask()
        mover.owed = self._own.talk.owes(mover.unit.address)

    # ------------------------------------------------------------------ whose answer it is

    async def _attribute(self) -> None:
        """Assign the received letters to chips."""
        talk = self._own.talk
        while talk.letters:
            at = self._own.line.now()
            count = await self._burst()
            waited_for = sorted(self._waited_for(), key=lambda mover: mover.motion.end)
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
            # The chip of the last question is the likeliest, since it may have been at rest before; then those near their end.
            alike.sort(key=lambda m: (m is not self._asked_last, not m.is_near(at)))
            await self._search(alike, at, count)

    async def _burst(self) -> int:
        """Number of letters in a burst, without those pending from chips known to be at rest."""
        talk = self._own.talk
        count = talk.letters or 0
        while count:
            await self._own.receive_letter(BURST_NS + talk.wire_ns(2))
            if talk.letters == count:
                break
            count = talk.letters or 0
        talk.letters = 0
        known = min(count, self._left)
        self._left -= known
        return count - known

    async def _sort_out(self) -> None:
        """Find out which of the expected chips have answered."""
        while self._unclear:
            await self._search(self._waited_for(), self._unclear.pop(0), 1)

    async def _search(self, movers: list[_Mover], at: Nanos, count: int) -> None:
        """Find the chips that have answered ``count`` times: query one after the other; a chip at rest answers at once, and has
        given all its answers. Several may have stopped at the same moment, by one switch."""
        talk = self._own.talk
        for mover in movers:
            if mover is movers[-1]:
                self._is_over(mover, at, count)
            elif mover.has_room:
                owed = mover.owed
                try:
                    await self._ask(mover)
                except Restarted as failure:
                    self._give_up(mover.unit, failure)
                    continue
                except (LineFailure, Refusal):
                    continue
                if not talk.letters:
                    await self._own.receive_letter(PEEK_NS + mover.unit.write_ns)
                if talk.letters:
                    self._is_over(mover, at, count)
                    count -= owed
                    if count <= 0:
                        return
                    await self._burst()

    def _is_over(self, mover: _Mover, at: Nanos, count: int = 1) -> None:
        mover.motion.over_at = mover.rest_at(at)
        self._left += max(mover.owed - count, 0)
        mover.owed = 0
