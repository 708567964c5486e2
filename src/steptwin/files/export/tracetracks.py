"""A trace sorted into tracks, one for every axis and pin, in a window of time: the input of all exports."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass, replace

from steptwin.controller import MILLISECOND, Nanos
from steptwin.errors import Misuse
from steptwin.files.export.moved import moved_track
from steptwin.files.export.tracks import AxisTrack, PinTrack
from steptwin.motion import Profile, at_rest
from steptwin.motion.divisions import StepTrain, profile_of
from steptwin.simulation.mechanics.channels import AxisViews, plain_view
from steptwin.simulation.mechanics.trajectory import LoadSection
from steptwin.simulation.scheduler.trace import Trace, TraceRecord


@dataclass(slots=True)
class TraceTracks:
    """The tracks from ``begin`` to ``until``."""

    begin: Nanos
    until: Nanos
    controllers: list[str]
    axes: list[AxisTrack]
    pins: list[PinTrack]
    marks: list[TraceRecord]
    """Frames, statements, events, inputs and faults, in order."""
    moved: list[AxisTrack]
    """Positions of the elements that axes move, in their units."""
    last: Nanos
    """When something changed last, analog inputs apart: their sources never end; ``until`` where something moves on."""
    title: str = ""

    def to_last_change(self) -> TraceTracks:
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
    controllers: Collection[str] | None = None,
) -> TraceTracks:
    """The tracks of ``controllers`` (all of them by default) in a window of time; without ``until`` up to where all is at rest.

    Raises `Misuse` for controllers that are not in the trace and for a window that ends before it begins.
    """
    unknown = sorted(set(controllers or ()) - set(trace.controllers))
    if unknown:
        raise Misuse(f"no controller {unknown[0]!r} in the trace: there are {', '.join(trace.controllers) or 'none'}")
    chosen = [name for name in trace.controllers if controllers is None or name in controllers]
    sorting, included = _Sorting(views, begin), frozenset(chosen)
    for record in trace:
        if record.controller not in included:
            continue
        if until is not None and record.time > until:
            break
        sorting.add(record)
    return sorting.tracks(chosen, until)


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
        time, controller, kind, subject, value, _ = record
        self._last = max(self._last, time)
        if not subject.startswith("AIN"):
            self._changed = max(self._changed, time)
        if isinstance(value, (Profile, StepTrain)) and kind == "plan":
            track = self._axis(controller, subject)
            track.times.append(time)
            track.plans.append(value)
        elif isinstance(value, tuple) and kind == "load":
            self._axis(controller, subject).place(time, [LoadSection(*one) for one in value])
        elif isinstance(value, Profile) and kind == "free":
            self._axis(controller, subject).place(time, [LoadSection(time, False, value.base)], value)
        elif isinstance(value, int) and kind == "coordinate":
            self._axis(controller, subject).origins.append((time, value))
        elif isinstance(value, (int, float)) and kind == "edge":
            pin = self._pins.setdefault((controller, subject), PinTrack(controller, subject))
            pin.times.append(time)
            pin.levels.append(float(value))
        elif time >= self._begin:
            self._marks.append(record)

    def _axis(self, controller: str, subject: str) -> AxisTrack:
        track = self._axes.get((controller, subject))
        if track is None:
            view = self._views.get((controller, subject)) or plain_view(subject)
            track = self._axes[controller, subject] = AxisTrack(controller, view)
        return track

    def tracks(self, controllers: list[str], until: Nanos | None) -> TraceTracks:
        """Raises `Misuse` for a window that ends before it begins."""
        for track in self._axes.values():
            _stand_before(track, self._begin)
        rests = self._rests()
        at_rest_by = max((rest for rest in rests if rest is not None), default=self._begin)
        last, changed = max(self._last, at_rest_by), max(self._changed, at_rest_by)
        end = last if until is None else until
        if end < self._begin:
            raise Misuse(f"the window of time ends at {end} ns and begins at {self._begin} ns: it must not end before it begins")
        moved = self._moved(end)
        changed = max([changed, *(_last_motion(track, end) for track in moved)])
        order = {name: i for i, name in enumerate(controllers)}
        return TraceTracks(
            self._begin,
            end,
            controllers,
            sorted(self._axes.values(), key=lambda track: (order[track.controller], _numbers(track.view.name))),
            sorted(self._pins.values(), key=lambda track: (order[track.controller], _numbers(track.pin))),
            self._marks,
            moved,
            end if None in rests else min(changed if changed > self._begin else last, end),
        )

    def _moved(self, until: Nanos) -> list[AxisTrack]:
        """Elements that the axes move besides their loads; not a gantry of which one axis is not chosen."""
        found: list[AxisTrack] = []
        loads = {place: track.load(its) for place, track in self._axes.items() if (its := track.view.mechanics) is not None}
        for (controller, subject), track in self._axes.items():
            pins = {pin: one for (of, pin), one in self._pins.items() if of == controller}
            for channel in () if track.view.mechanics is None else track.view.mechanics.moved:
                other = None if channel.other is None else loads.get(channel.other)
                if until > self._begin and (channel.other is None or other is not None):
                    found.append(moved_track(channel, loads[controller, subject], other, pins, until))
        return found

    def _rests(self) -> list[Nanos | None]:
        """When each axis, and each load that moves without its drive, comes to rest; None: never."""
        drives = [profile_of(track.plans[-1]).end for track in self._axes.values()]
        return drives + [
            coasting.end
            for track in self._axes.values()
            for begin, coasting in track.coasting.items()
            if begin == track.loads[-1].begin
        ]


def _last_motion(track: AxisTrack, until: Nanos) -> Nanos:
    """When it is in motion for the last time; 0 if it never is."""
    ends = [*track.times[1:], until]
    return max((end for plan, end in zip(track.plans, ends, strict=True) if profile_of(plan).segments), default=0)


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
