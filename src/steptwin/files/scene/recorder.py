"""Recording of a machine in space while its world runs: motions as they are planned, levels and workpieces as they change."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from functools import partial
from itertools import islice
from math import isfinite
from typing import TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.files.scene.cubics import Cubic, cubics_of
from steptwin.files.scene.recordedscene import RecordedScene, Stint, machine_of
from steptwin.simulation.components.signals import Idle
from steptwin.simulation.logic.condition import SignalCondition
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.drawing import BELT
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.space.frames import NM_PER_MM, Joint
from steptwin.simulation.space.pieces import Motion
from steptwin.simulation.world.simulation import Simulation
from steptwin.subject.describe import describe, workpiece_states

SLACK_NM = 100.0
"""Motions along a way are recorded as exactly as this."""
SLACK_Q = 1e-6
"""Those about an axis, quarter turns."""
_AT_ONCE = 16
"""Polynomials of a plan that are computed as soon as it is there. Pieces that read from what changes are among these."""
_MOST_TURNS = 64
DEGREES_PER_Q = 90.0


def _cut(spans: list[Cubic], now: Nanos) -> None:
    """Drop what was expected from a moment on."""
    while spans and spans[-1].begin >= now:
        spans.pop()


class _Planned:
    """A motion in units of its signal; its pieces are ``per_unit`` of theirs for one."""

    def __init__(self, motion: Motion, per_unit: float, slack: float) -> None:
        self.spans: list[Cubic] = []
        self._motion, self._per_unit, self._slack = motion, per_unit, slack
        self._version: object = self
        self._more: Iterator[Cubic] = iter(())

    def look(self, now: Nanos) -> None:
        while self.spans and self.spans[-1].begin < now and (span := next(self._more, None)) is not None:
            self.spans.append(span)  # as it was planned before this moment
        version = self._motion.version()
        if version == self._version:
            return
        self._version = version
        _cut(self.spans, now)
        self._more = (one.scaled(1.0 / self._per_unit) for one in cubics_of(self._motion.pieces(now), self._slack))
        self.spans += islice(self._more, _AT_ONCE)


class _Turning:
    """A signal that is straight between its turning points."""

    def __init__(self, signal: SignalOf) -> None:
        self.spans: list[Cubic] = []
        self._signal = signal
        self._version: object = self

    def look(self, now: Nanos) -> None:
        signal = self._signal
        version = signal.version()
        if version is not None and version == self._version:
            return
        self._version = version
        ends = [now, *islice((moment for moment in signal.turning_points(now) if moment > now), _MOST_TURNS)]
        values = [signal.value(moment) for moment in ends]
        _cut(self.spans, now)
        for n, begin in enumerate(ends):
            seconds = (ends[n + 1] - begin) / 1e9 if n + 1 < len(ends) else 1.0
            self.spans.append(Cubic(begin, values[n], (values[min(n + 1, len(ends) - 1)] - values[n]) / seconds))


class _Condition:
    """1 while a condition holds, which may change without an event."""

    def __init__(self, world: Simulation, text: str) -> None:
        self.spans: list[Cubic] = []
        self._signals: list[SignalOf | Idle] = []

        def signal(name: str) -> SignalOf | Idle:
            self._signals.append(world.signal(name))
            return self._signals[-1]

        self._condition = SignalCondition(text, signal)
        self._version: object = self
        self._more: Iterator[Cubic] = iter(())
        sources = [source for one in self._signals if isinstance(one, SignalOf) for source in one.sources]
        self.scheduler = sources[0].scheduler if sources else None
        """None: it depends on the time only."""

    def look(self, now: Nanos) -> None:
        version = tuple(one.version() if one.continuous else one.value(now) for one in self._signals)
        while self.spans and self.spans[-1].begin < now and (span := next(self._more, None)) is not None:
            self.spans.append(span)
        if version == self._version and None not in version:
            return
        self._version = version
        _cut(self.spans, now)
        self.spans.append(Cubic(now, float(self._condition.holds(now))))
        self._more = self._changes(now)
        self.spans += islice(self._more, _MOST_TURNS)

    def _changes(self, now: Nanos) -> Iterator[Cubic]:
        while (change := self._condition.change(now)) is not None:
            now = change
            yield Cubic(now, float(self._condition.holds(now)))


class _Level:
    """A level that changes with events only."""

    def __init__(self, signal: SignalOf) -> None:
        self.changes: list[tuple[Nanos, float]] = []
        self._signal = signal

    def look(self, now: Nanos) -> None:
        level = self._signal.value(now)
        if not isfinite(level) or (self.changes and self.changes[-1][1] == level):
            return
        if self.changes and self.changes[-1][0] == now:
            self.changes.pop()
        self.changes.append((now, level))


_Motion: TypeAlias = _Planned | _Turning | _Condition


class SceneRecorder:
    """Records the scene of a world. It changes nothing there: after each event it looks at what that scheduler computes."""

    def __init__(self) -> None:
        self._world: Simulation | None = None
        self._motions: dict[str, _Motion] = {}
        self._levels: dict[str, _Level] = {}
        self._followed: dict[Scheduler, list[_Motion | _Level]] = {}
        self._with_workpieces: set[Scheduler] = set()
        self._bodies: object = None
        self._stints: dict[str, list[Stint]] = {}

    def follow(self, world: Simulation, *, ends: bool = False) -> None:
        """Record a world from its present moment on, if it has places in space. ``ends``: up to that moment only."""
        if not world.objects.frames:
            return
        self._world = world
        world.sync_all()
        self._follow_frames(world)
        self._follow_elements(world)
        schedulers = world.objects.scheduler_of
        self._with_workpieces = {schedulers[source] for source in world.objects.workpieces.sources if source in schedulers}
        for scheduler in world.schedulers:
            scheduler.deadline()  # which settles it
            self._changed(scheduler)
        if not ends:
            world.subscribe_to_schedulers(self._changed)

    def recorded(self) -> RecordedScene | None:
        """The scene up to the present moment; None without one."""
        world = self._world
        if world is None:
            return None
        now = world.now
        world.sync_all()
        for motion in self._motions.values():
            motion.look(now)
            del motion.spans[max(1, bisect_right(motion.spans, now, key=lambda span: span.begin)) :]
        return RecordedScene(
            machine_of(describe(world)),
            {name: motion.spans for name, motion in self._motions.items()},
            {name: level.changes for name, level in self._levels.items() if level.changes},
            {name: stints for name, stints in self._stints.items() if stints},
        )

    def _follow_frames(self, world: Simulation) -> None:
        for name, mounted in world.objects.frames.items():
            for one in mounted.movements:
                per_unit, slack = (one.per_unit / DEGREES_PER_Q, SLACK_Q) if one.turns else (one.per_unit * NM_PER_MM, SLACK_NM)
                signal = f"{name}.{one.signal}"
                self._follow(_signal(world, signal), self._motions.setdefault(signal, _Planned(one.motion, per_unit, slack)))

    def _follow_elements(self, world: Simulation) -> None:
        """Signals of what moves besides frames, of what is there only sometimes, and all levels that are shown."""
        machine, placed = machine_of(describe(world)), set(world.objects.frames)
        placed |= {axis.brake for axis in machine.axes if axis.name in placed and axis.brake is not None}
        for body in machine.scene.bodies:
            for what, text in (("present", body.when), ("lit", body.lit), ("draws", body.draws)):
                if text is not None:
                    holds = self._motions[f"{body.name}.{what}"] = _Condition(world, text)
                    self._followed.setdefault(holds.scheduler or world.schedulers[0], []).append(holds)
        moves: list[str] = []
        levels: list[str] = []
        for axis in machine.axes:
            if axis.name in placed:
                levels += (f"{axis.name}.stalled", *(switch.pin for switch in axis.switches))
        for element in machine.elements:
            if element.name in placed:
                levels += (f"{element.name}.{terminal}" for terminal in (*element.inputs, *element.outputs))
                if element.drawing is not None:
                    levels += (switch.pin for switch in element.drawing.switches)
                    if element.drawing.shape != BELT:  # places of workpieces are those of one dimension
                        moves += (f"{element.name}.{place}" for place in element.drawing.places)
        for name in moves:
            if name not in self._motions and (signal := _signal(world, name)) is not None:
                self._follow(signal, self._motions.setdefault(name, _Turning(signal)))
        elements = {element.name for element in machine.elements}
        for pin in levels:
            owner, _, terminal = pin.partition(".")
            name = f"{owner}.{terminal.lower()}" if owner in elements else pin
            if name not in self._levels and (signal := _signal(world, name)) is not None:
                self._follow(signal, self._levels.setdefault(name, _Level(signal)))

    def _follow(self, signal: SignalOf | None, followed: _Motion | _Level) -> None:
        if signal is not None:
            self._followed.setdefault(signal.sources[0].scheduler, []).append(followed)

    # ------------------------------------------------------------------ events

    def _changed(self, scheduler: Scheduler) -> None:
        world = self._world
        if world is None or scheduler.is_dirty:  # it is called again when all has settled
            return
        now = scheduler.now
        for followed in self._followed.get(scheduler, ()):
            followed.look(now)
        if scheduler in self._with_workpieces:
            bodies = world.objects.workpieces.bodies()
            if bodies is not self._bodies:
                self._bodies = bodies
                self._place(world, now)

    def _place(self, world: Simulation, now: Nanos) -> None:
        there = {state.name: state for state in workpiece_states(world, now, partial(self._value, world, now))}
        for name in {**self._stints, **there}:
            stints, place = self._stints.setdefault(name, []), there.get(name)
            if stints and stints[-1].begin == now:
                stints.pop()
            if place != (stints[-1].place if stints else None):
                stints.append(Stint(now, place))

    def _value(self, world: Simulation, now: Nanos, joint: Joint) -> float:
        """Value of a joint of a workpiece. A belt counts from when it carries one; only its changes do."""
        name = joint.signal
        if name not in self._motions:
            self._follow(_signal(world, name), self._motions.setdefault(name, _Planned(joint.motion, NM_PER_MM, SLACK_NM)))
        followed = self._motions[name]
        followed.look(now)
        return next(span for span in reversed(followed.spans) if span.begin <= now).at(now)


def _signal(world: Simulation, name: str) -> SignalOf | None:
    """None for what cannot be read."""
    try:
        signal = world.signal(name)
    except Misuse:
        return None
    return signal if isinstance(signal, SignalOf) and signal.is_readable and signal.sources else None
