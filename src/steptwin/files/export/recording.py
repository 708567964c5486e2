"""A trace sorted into tracks, one for every axis and pin, in a window of time: the input of all exports."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from operator import attrgetter

from steptwin.errors import Misuse
from steptwin.machine import MILLISECOND, Nanos
from steptwin.motion import Profile, at_rest
from steptwin.motion.divisions import Plan, StepTrain, profile_of
from steptwin.world.course import LoadPiece
from steptwin.world.lanes import AxisLane, AxisViews, plain_view
from steptwin.world.trace import Trace, TraceRecord


@dataclass(slots=True)
class AxisTrack:
    """The plans of an axis: each counts from its moment to that of the next. There is one at the beginning of the window."""

    machine: str
    view: AxisLane
    times: list[Nanos] = field(default_factory=list)
    plans: list[Plan] = field(default_factory=list)
    loads: list[LoadPiece] = field(default_factory=list)
    """Positions of the load by moment, if it does not follow the pulses throughout."""
    free: dict[Nanos, Profile] = field(default_factory=dict)
    """Motions of the load without current, by the moments of ``loads`` in whose place they are."""
    origins: list[tuple[Nanos, int]] = field(default_factory=list)
    """By how many pulses the coordinate is above the count, by moments."""

    @property
    def name(self) -> str:
        return f"{self.machine}.{self.view.name}"

    def plan(self, now: Nanos) -> Plan:
        return self.plans[max(bisect_right(self.times, now) - 1, 0)]

    def stretches(self, after: Nanos, until: Nanos) -> Iterator[tuple[Plan, Nanos, Nanos]]:
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
        track = AxisTrack(self.machine, self.view)
        moments = [moment for moment, _ in self.origins]
        for begin in sorted({*self.times, *(moment for moment in moments if moment >= self.times[0])}):
            past = bisect_right(moments, begin) - 1
            track.add(begin, profile_of(self.plan(begin)), self.origins[past][1] if past >= 0 else 0)
        return track

    def add(self, begin: Nanos, profile: Profile, above_p: int) -> None:
        """From ``begin`` on it is ``above_p`` pulses above where ``profile`` has it."""
        self.times.append(begin)
        self.plans.append(type(profile)(profile.start, profile.base + above_p, profile.segments, profile.final_p))

    def place(self, time: Nanos, loads: list[LoadPiece], free: Profile | None = None) -> None:
        """From ``time`` on the load is otherwise than was known before: at ``loads``, or it moves freely."""
        while self.loads and self.loads[-1].begin >= time:
            self.free.pop(self.loads.pop().begin, None)
        self.loads += loads
        if free is not None:
            self.free[time] = free

    def true(self) -> AxisTrack | None:
        """The motion of the load, ``zero_p`` included; None where it is not known, or can only be that of the drive."""
        mechanics = self.view.mechanics
        if mechanics is None or (mechanics.is_ideal and not self.loads):
            return None
        view = AxisLane(f"{mechanics.name} true", mechanics.unit, mechanics.pulses_per_unit)
        track = AxisTrack(self.machine, view)
        for begin in sorted({*self.times, *(load.begin for load in self.loads if load.begin >= self.times[0])}):
            past = bisect_right(self.loads, begin, key=attrgetter("begin")) - 1
            since, follows, pulses = self.loads[past] if past >= 0 else LoadPiece(begin, True, 0)
            profile = profile_of(self.plan(begin)) if follows else self.free.get(since) or at_rest(begin, pulses)
            off = mechanics.zero_p + (pulses if follows else 0)
            track.add(begin, profile, off)
        return track

    def most_pulses(self, after: Nanos, until: Nanos) -> int:
        """How many pulses there are, or more: the whole positions passed."""
        return sum(_passed(profile_of(plan), begin, end) for plan, begin, end in self.stretches(after, until))


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

    machine: str
    pin: str
    times: list[Nanos] = field(default_factory=list)
    levels: list[float] = field(default_factory=list)

    @property
    def name(self) -> str:
        return f"{self.machine}.{self.pin}"

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


@dataclass(slots=True)
class Recording:
    """The tracks from ``begin`` to ``until``."""

    begin: Nanos
    until: Nanos
    machines: list[str]
    axes: list[AxisTrack]
    pins: list[PinTrack]
    marks: list[TraceRecord]
    """Frames, statements, events, inputs and faults, in order."""
    last: Nanos
    """When something changed last, analog inputs apart: their sources never end; ``until`` where something moves on."""
    title: str = ""

    def to_last_change(self) -> Recording:
        """The same, ending shortly after the last change; all of it where nothing changes."""
        if self.last == self.begin:
            return self
        return replace(self, until=min(self.until, self.last + (self.last - self.begin) // 32 + MILLISECOND))

    def of(self, kind: str) -> list[TraceRecord]:
        return [record for record in self.marks if record.kind == kind]


def sort_out(
    trace: Trace,
    views: AxisViews,
    begin: Nanos = 0,
    until: Nanos | None = None,
    machines: Collection[str] | None = None,
) -> Recording:
    """The tracks of ``machines`` (all of them by default) in a window of time; without ``until`` up to where all is at rest.

    Raises `Misuse` for machines that are not in the trace and for a window that ends before it begins.
    """
    unknown = sorted(set(machines or ()) - set(trace.machines))
    if unknown:
        raise Misuse(f"no machine {unknown[0]!r} in the trace: there are {', '.join(trace.machines) or 'none'}")
    chosen = [name for name in trace.machines if machines is None or name in machines]
    sorting, included = _Sorting(views, begin), frozenset(chosen)
    for record in trace:
        if record.machine not in included:
            continue
        if until is not None and record.time > until:
            break
        sorting.add(record)
    return sorting.recording(chosen, until)


class _Sorting:
    """The tracks while records are added in order, from any moment; marks only from ``begin`` on."""

    def __init__(self, views: AxisViews, begin: Nanos) -> None:
        self._views = views
        self._begin = begin
        self._axes: dict[tuple[str, str], AxisTrack] = {}
        self._pins: dict[tuple[str, str], PinTrack] = {}
        self._marks: list[TraceRecord] = []
        self._last = self._changed = begin

    def add(self, record: TraceRecord) -> None:
        time, machine, kind, subject, value, _ = record
        self._last = max(self._last, time)
        if not subject.startswith("AIN"):
            self._changed = max(self._changed, time)
        if isinstance(value, (Profile, StepTrain)) and kind == "plan":
            track = self._axis(machine, subject)
            track.times.append(time)
            track.plans.append(value)
        elif isinstance(value, tuple) and kind == "load":
            self._axis(machine, subject).place(time, [LoadPiece(*one) for one in value])
        elif isinstance(value, Profile) and kind == "free":
            self._axis(machine, subject).place(time, [LoadPiece(time, False, value.base)], value)
        elif isinstance(value, int) and kind == "coordinate":
            self._axis(machine, subject).origins.append((time, value))
        elif isinstance(value, (int, float)) and kind == "edge":
            pin = self._pins.setdefault((machine, subject), PinTrack(machine, subject))
            pin.times.append(time)
            pin.levels.append(float(value))
        elif time >= self._begin:
            self._marks.append(record)

    def _axis(self, machine: str, subject: str) -> AxisTrack:
        track = self._axes.get((machine, subject))
        if track is None:
            view = self._views.get((machine, subject)) or plain_view(subject)
            track = self._axes[machine, subject] = AxisTrack(machine, view)
        return track

    def recording(self, machines: list[str], until: Nanos | None) -> Recording:
        """Raises `Misuse` for a window that ends before it begins."""
        for track in self._axes.values():
            _stand_before(track, self._begin)
        rests = self._rests()
        at_rest_by = max((rest for rest in rests if rest is not None), default=self._begin)
        last, changed = max(self._last, at_rest_by), max(self._changed, at_rest_by)
        end = last if until is None else until
        if end < self._begin:
            raise Misuse(f"the window of time ends at {end} ns and begins at {self._begin} ns: it must not end before it begins")
        order = {name: i for i, name in enumerate(machines)}
        return Recording(
            self._begin,
            end,
            machines,
            sorted(self._axes.values(), key=lambda track: (order[track.machine], _numbers(track.view.name))),
            sorted(self._pins.values(), key=lambda track: (order[track.machine], _numbers(track.pin))),
            self._marks,
            end if None in rests else min(changed if changed > self._begin else last, end),
        )

    def _rests(self) -> list[Nanos | None]:
        """When each axis, and each load that moves without its drive, comes to rest; None: never."""
        drives = [profile_of(track.plans[-1]).end for track in self._axes.values()]
        return drives + [
            free.end for track in self._axes.values() for begin, free in track.free.items() if begin == track.loads[-1].begin
        ]


def _stand_before(track: AxisTrack, begin: Nanos) -> None:
    """Adds rest before the first plan: at the position where that begins, or at 0 if there is none."""
    if not track.times:
        track.times.append(begin)
        track.plans.append(at_rest(begin, 0))
    elif track.times[0] > begin:
        first = profile_of(track.plans[0])
        track.times.insert(0, begin)
        track.plans.insert(0, at_rest(begin, first.count(first.start)))


def _numbers(name: str) -> list[str | int]:
    """Orders IN2 before IN10."""
    return [int(part) if i % 2 else part for i, part in enumerate(re.split(r"(\d+)", name))]
