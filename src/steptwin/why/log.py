"""What happened in a world, with all that can be a cause: its trace, the statements of its programs, the steps of its scripts.

A running world does not note this. Its past is run again, from its beginning, with the inputs that it kept.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import defaultdict
from collections.abc import Iterable, Iterator
from itertools import takewhile
from typing import NamedTuple

from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.statements import StatementHook
from steptwin.world.actions import Download, ExternalInput
from steptwin.world.history import replay
from steptwin.world.plant import Plant, RecordedInput
from steptwin.world.programs import Place, Programs
from steptwin.world.trace import TraceRecord

MOST_NOTED = 20_000_000
"""Limit of what is noted, because it is kept in memory."""


class Executed(NamedTuple):
    """A statement of a program. ``position``: how many records of its group were noted before it."""

    time: Nanos
    machine: str
    place: Place
    position: int


class Act(NamedTuple):
    """An action of a script; from outside if ``script`` is empty."""

    time: Nanos
    script: str
    what: ExternalInput


class Change(NamedTuple):
    """A signal took a value. ``position``: its number among the records of its group."""

    time: Nanos
    value: float
    group: int
    position: int


class CauseLog:
    """Notes what happens in ``world``, which is at its beginning, while that runs.

    Records are in groups: what is joined is in one group, whose records come in the order of their causes.
    """

    def __init__(self, world: Plant) -> None:
        self.world = world
        parts = world.parts
        numbers = {id(kernel): number for number, kernel in enumerate(world.kernels)}
        self._group_of = {name: numbers[id(kernel)] for name, kernel in parts.kernel_of.items()}
        self._pins = {name: frozenset(machine.pins()) for name, machine in world.machines.items()}
        self.begin = world.now
        self.first_levels = {
            f"{name}.{pin}": level for name, machine in world.machines.items() for pin, level in machine.pins().items()
        }
        self.records: dict[int, list[TraceRecord]] = defaultdict(list)
        self.changes: dict[str, list[Change]] = defaultdict(list)
        self.executed: dict[str, list[Executed]] = defaultdict(list)
        self.plans: dict[tuple[str, str], list[Change]] = defaultdict(list)
        """Moments and positions of the plans of an axis, by controller and number."""
        self.acts: list[Act] = []
        self._replaced: dict[str, Nanos] = {}
        """When the program of a controller was last replaced by a download."""
        self._noted = 0
        for record in world.trace:
            self._take(record)
        self._built = {group: len(records) for group, records in self.records.items()}
        world.trace.watchers.append(self._take)
        world.act_watchers.append(self._act)
        for name, programs in world.programs.items():
            programs.hook(self._hook(name, programs))

    def run(self, inputs: Iterable[RecordedInput], end: Nanos) -> None:
        """Run to the moment ``end`` with these inputs. Raises `Misuse` for inputs that do not fit."""
        for _ in replay(self.world, inputs, end):
            pass

    def _count(self) -> None:
        self._noted += 1
        if self._noted > MOST_NOTED:
            raise Misuse(f"more than {MOST_NOTED} records and statements: ask about a shorter time")

    def _take(self, record: TraceRecord) -> None:
        self._count()
        group = self._group_of.get(record.machine, -1)
        records = self.records[group]
        match record.kind:
            case "edge":
                change = Change(record.time, float(record.value), group, len(records))  # type: ignore[arg-type]
                self.changes[self.signal_of(record)].append(change)
            case "plan":
                self.plans[record.machine, record.subject].append(Change(record.time, 0.0, group, len(records)))
        records.append(record)

    def _act(self, script: str, what: ExternalInput) -> None:
        self._count()
        self.world.settle_all()
        self.acts.append(Act(self.world.now, script, what))
        match what:
            case Download(machine=machine):
                self._replaced[machine] = self.world.now

    def _hook(self, name: str, programs: Programs) -> StatementHook:
        executed, records = self.executed[name], self.records[self._group_of[name]]

        def hook(now: Nanos, number: int) -> None:
            place = programs.place(number)
            if place is not None:
                self._count()
                executed.append(Executed(now, name, place, len(records)))

        return hook

    # ------------------------------------------------------------------ questions

    def signal_of(self, record: TraceRecord) -> str:
        """The name of what has an edge: ``table.OUT1``, ``valve.out``, or the lane of a contact."""
        is_pin = record.subject in self._pins.get(record.machine, ())
        return f"{record.machine}.{record.subject}" if is_pin else record.subject

    def is_recorded(self, signal: str) -> bool:
        """Whether every change of a signal is noted."""
        owner, _, pin = signal.partition(".")
        return pin in self._pins.get(owner, ()) or signal in self.changes

    def level(self, signal: str, now: Nanos) -> float:
        """The level of a signal at a moment."""
        last = self.last_change(signal, now)
        return self.first_levels.get(signal, 0.0) if last is None else last.value

    def last_change(self, signal: str, until: Nanos, before: int | None = None) -> Change | None:
        """The last change of a signal by a moment; ``before``: before a position of its group at that moment."""
        changes = self.changes.get(signal, [])
        index = bisect_right(changes, until, key=lambda change: change.time)
        while index and before is not None and changes[index - 1].time == until and changes[index - 1].position >= before:
            index -= 1
        return changes[index - 1] if index else None

    def is_first(self, signal: str, change: Change) -> bool:
        """Whether a signal has a level because the world began with it."""
        is_same = change is self.changes[signal][0] and change.value == self.first_levels.get(signal, 0.0)
        return is_same or change.position < self._built.get(change.group, 0)

    def since(self, signal: str, until: Nanos) -> Nanos | None:
        """Since when a signal has the level of a moment; None: from the beginning."""
        last = self.last_change(signal, until)
        return None if last is None or self.is_first(signal, last) else last.time

    def last_plan(self, machine: str, axis: str, until: Nanos) -> Change | None:
        """The plan of an axis that is in force at a moment; of the axis planned last, if ``axis`` is empty."""
        found: Change | None = None
        for (name, number), plans in self.plans.items():
            if name == machine and axis in ("", number):
                index = bisect_right(plans, until, key=lambda plan: plan.time)
                if index and (found is None or plans[index - 1].time >= found.time):
                    found = plans[index - 1]
        return found

    def record(self, change: Change) -> TraceRecord:
        return self.records[change.group][change.position]

    def at(self, group: int, time: Nanos) -> Iterator[tuple[int, TraceRecord]]:
        """The records of a group at a moment, with their positions, the last one first."""
        records = self.records[group]
        for position in range(bisect_right(records, time, key=lambda record: record.time) - 1, -1, -1):
            if records[position].time < time:
                break
            yield position, records[position]

    def group(self, name: str) -> int:
        """The group of a controller, line or element."""
        return self._group_of.get(name, -1)

    def acts_at(self, time: Nanos) -> Iterator[Act]:
        """What scripts did at a moment, and what came from outside, the last one first."""
        return takewhile(lambda act: act.time == time, self.acts_before(time, len(self.acts)))

    def acts_before(self, until: Nanos, most: int) -> Iterator[Act]:
        """What scripts did by a moment, and what came from outside, the last one first; ``most`` of them."""
        last = bisect_right(self.acts, until, key=lambda act: act.time) - 1
        return (self.acts[index] for index in range(last, max(-1, last - most), -1))

    def is_of_present_text(self, executed: Executed) -> bool:
        """Whether the text of a statement is still in its controller."""
        programs = self.world.programs[executed.machine]
        return executed.time > self._replaced.get(executed.machine, -1) and executed.place.text in programs.texts

    def last_executed(self, machine: str, until: Nanos) -> int:
        """The number of the last statement of a controller by a moment; -1 if there is none."""
        return bisect_right(self.executed.get(machine, []), until, key=lambda executed: executed.time) - 1
