"""The motion of an axis and the levels of a pin over time."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field
from operator import attrgetter

from steptwin.controller import Nanos
from steptwin.motion import Profile, at_rest
from steptwin.motion.divisions import Plan, profile_of
from steptwin.simulation.mechanics.channels import AxisChannel, Mechanics
from steptwin.simulation.mechanics.trajectory import LoadSection


@dataclass(slots=True)
class AxisTrack:
    """The plans of an axis: each counts from its moment to that of the next. There is one at the beginning of the window."""

    controller: str
    view: AxisChannel
    times: list[Nanos] = field(default_factory=list)
    plans: list[Plan] = field(default_factory=list)
    loads: list[LoadSection] = field(default_factory=list)
    """Positions of the load by moment, if it does not follow the pulses throughout."""
    coasting: dict[Nanos, Profile] = field(default_factory=dict)
    """Motions of the load without current, by the moments of ``loads`` in whose place they are."""
    origins: list[tuple[Nanos, int]] = field(default_factory=list)
    """By how many pulses the coordinate is above the count, by moments."""

    @property
    def name(self) -> str:
        return f"{self.controller}.{self.view.name}"

    @property
    def plain_name(self) -> str:
        """Kind of what an axis moves, as one word."""
        return f"{self.view.name.replace(' ', '_')}_{self.view.unit}"

    def plan(self, now: Nanos) -> Plan:
        return self.plans[max(bisect_right(self.times, now) - 1, 0)]

    def intervals(self, after: Nanos, until: Nanos) -> Iterator[tuple[Plan, Nanos, Nanos]]:
        """(plan, after, until) of every plan in force between; pulses at ``until`` belong to the plan before it."""
        for i in range(max(bisect_right(self.times, after) - 1, 0), len(self.plans)):
            end = min(self.times[i + 1], until) if i + 1 < len(self.times) else until
            if after < end:
                yield self.plans[i], after, end
            after = max(after, end)
            if after >= until:
                return

    def coordinate(self) -> AxisTrack | None:
        """The position that registers show, which jumps where it is set; None where it is the count since power-on."""
        if not self.origins:
            return None
        track = AxisTrack(self.controller, self.view)
        moments = [moment for moment, _ in self.origins]
        for begin in sorted({*self.times, *(moment for moment in moments if moment >= self.times[0])}):
            past = bisect_right(moments, begin) - 1
            track.add(begin, profile_of(self.plan(begin)), self.origins[past][1] if past >= 0 else 0)
        return track

    def add(self, begin: Nanos, profile: Profile, above_p: int) -> None:
        """From ``begin`` on it is ``above_p`` pulses above where ``profile`` has it."""
        self.times.append(begin)
        self.plans.append(type(profile)(profile.start, profile.base + above_p, profile.segments, profile.final_p))

    def place(self, time: Nanos, loads: list[LoadSection], coasting: Profile | None = None) -> None:
        """From ``time`` on the load is otherwise than was known before: at ``loads``, or it moves freely."""
        while self.loads and self.loads[-1].begin >= time:
            self.coasting.pop(self.loads.pop().begin, None)
        self.loads += loads
        if coasting is not None:
            self.coasting[time] = coasting

    def true(self) -> AxisTrack | None:
        """The motion of the load, ``zero_p`` included; None where it is not known, or can only be that of the drive."""
        mechanics = self.view.mechanics
        return None if mechanics is None or (mechanics.is_ideal and not self.loads) else self.load(mechanics)

    def load(self, mechanics: Mechanics) -> AxisTrack:
        """The motion of the load, ``zero_p`` included."""
        view = AxisChannel(f"{mechanics.name} true", mechanics.unit, mechanics.pulses_per_unit)
        track = AxisTrack(self.controller, view)
        for begin in sorted({*self.times, *(load.begin for load in self.loads if load.begin >= self.times[0])}):
            past = bisect_right(self.loads, begin, key=attrgetter("begin")) - 1
            since, follows, pulses = self.loads[past] if past >= 0 else LoadSection(begin, True, 0)
            profile = profile_of(self.plan(begin)) if follows else self.coasting.get(since) or at_rest(begin, pulses)
            off = mechanics.zero_p + (pulses if follows else 0)
            track.add(begin, profile, off)
        return track

    def most_pulses(self, after: Nanos, until: Nanos) -> int:
        """How many pulses there are, or more: the whole positions passed."""
        return sum(_passed(profile_of(plan), begin, end) for plan, begin, end in self.intervals(after, until))


def _passed(profile: Profile, after: Nanos, until: Nanos) -> int:
    count = profile.count(max(after, profile.start))
    passed = 0
    for end, reached in zip(profile.ends, profile.counts[1:], strict=False):
        if after < profile.start + end < until:
            passed += abs(profile.base + reached - count)
            count = profile.base + reached
    return passed + abs(profile.count(max(until, profile.start)) - count)


@dataclass(slots=True)
class PinTrack:
    """The levels of a pin: each counts from its moment to that of the next."""

    controller: str
    pin: str
    times: list[Nanos] = field(default_factory=list)
    levels: list[float] = field(default_factory=list)

    @property
    def name(self) -> str:
        return f"{self.controller}.{self.pin}"

    @property
    def analog(self) -> bool:
        return self.pin.startswith("AIN") or any(level not in (0.0, 1.0) for level in self.levels)

    def level(self, now: Nanos) -> float | None:
        """The level at ``now``. Before its first change a digital pin had the other one; that of an analog pin is unknown."""
        i = bisect_right(self.times, now)
        if i:
            return self.levels[i - 1]
        return None if self.analog else 1.0 - self.levels[0]

    def changes(self, after: Nanos, until: Nanos) -> Iterator[tuple[Nanos, float]]:
        """Changes with ``after`` < time <= ``until``; of several at one moment the last."""
        for i in range(bisect_right(self.times, after), bisect_right(self.times, until)):
            if i + 1 == len(self.times) or self.times[i + 1] != self.times[i]:
                yield self.times[i], self.levels[i]
