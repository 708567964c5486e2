"""A running world: its kernels, each advanced on demand, and its scripts.

Machines without a connection are in separate kernels. A kernel is advanced to the present before it is read or changed; the
kernels that a condition depends on are advanced event by event. The result therefore does not depend on the order in which
kernels are advanced.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from itertools import groupby
from operator import itemgetter
from typing import Any

from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse, Runaway, TimeReversal
from steptwin.machine import Nanos
from steptwin.motioncontroller import MotionController
from steptwin.nearmiss import NearMiss
from steptwin.world import script as do
from steptwin.world.actions import ExternalInput, act, is_release
from steptwin.world.blueprint import Blueprint, FileContents
from steptwin.world.build import Keep, build
from steptwin.world.condition import SignalCondition
from steptwin.world.contacts import Button
from steptwin.world.elements.axis import BuiltAxis
from steptwin.world.faults import Fault
from steptwin.world.kernel import Kernel
from steptwin.world.kind import AnyKind, EncoderInputs, NamedRegisters, NewValues, Vision, lacks
from steptwin.world.lines import Line
from steptwin.world.names import Unknown
from steptwin.world.observing import WorldObserver
from steptwin.world.overrides import Overrides
from steptwin.world.parts import WorldParts
from steptwin.world.plantsnapshot import PlantSnapshot, RecordedInput
from steptwin.world.programs import Programs
from steptwin.world.programtexts import GivenFiles
from steptwin.world.references import check_faults, check_scripts, check_step
from steptwin.world.reports import Reports
from steptwin.world.rigging import Rigging
from steptwin.world.running import Script
from steptwin.world.scripts import MOST_STEPS_PER_INSTANT, Scripts
from steptwin.world.signals import Idle, SignalOf, find_signal
from steptwin.world.spec import ScriptSpec
from steptwin.world.trace import Trace, TraceRecord

WORLD = "world"
"""The machine name in records that belong to no machine."""

MOST_REMEMBERED = 10_000
"""Size limit of each cache of requests, signals and conditions, which scripts use repeatedly."""


class Plant:
    """A world, independent of files and clocks."""

    def __init__(
        self,
        blueprint: Blueprint,
        *,
        keep_trace: bool = True,
        keep_inputs: bool = True,
        keep_memory: Keep | None = None,
        at: PlantSnapshot | None = None,
    ) -> None:
        """The world of a description at time 0, or ``at`` a snapshot of one with the same description."""
        self.blueprint, spec = blueprint, blueprint.spec
        names = [*(controller.name for controller in spec.controllers), *(line.name for line in spec.lines), WORLD]
        self.spec = spec
        self.files = blueprint.files
        self.trace = Trace(names, keep=keep_trace)
        self.parts: WorldParts = build(blueprint, self.trace.add, keep_memory, is_blank=at is not None)
        self.trace.read_together(blueprint.joined or ())
        self.now: Nanos = 0
        self.stopped: str | None = None
        """The reason a script gave for ending the run; None if none did."""
        self.failures = Reports()
        """Expectations that did not hold."""
        self.overdue = Reports()
        """Conditions that scripts of the description waited for until their time-out."""
        self.keeps_inputs = keep_inputs
        """Whether external inputs are kept, as a session needs; off for worlds that run for weeks, where memory would fill up."""
        self.inputs: list[RecordedInput] = []
        """All external inputs so far, if they are kept."""
        self.input_watchers: list[Callable[[RecordedInput], None]] = []
        """Called with everything from outside as it comes."""
        self.act_watchers: list[Callable[[str, ExternalInput], None]] = []
        """Called before each action at the present moment, with the script that does it; empty: what comes from outside."""
        self.settled_first: Sequence[Kernel] = ()
        """Kernels that are advanced before the others where the order is free, so that what observes them can read the others."""
        self.is_settled = False
        """Whether the scripts of the description have run since the last external input."""
        self._encoded: dict[object, tuple[bytes, ...]] = {}
        self._signals: dict[str, SignalOf | Idle] = {}
        self._conditions: dict[str, SignalCondition] = {}
        self._scripts = Scripts(self)
        self.downloaded: dict[tuple[str, str], SourceText] = {}
        """What has been put into controllers since the beginning, by machine and place, as it was written."""
        self._scheduled: dict[str, Script] = {}
        """Scheduled steps that can be cancelled, by name."""
        self.rigging = Rigging(self.parts)
        if at is None:
            check_faults(self, spec.faults)
        if not blueprint.is_checked:
            check_scripts(self, spec.scripts)
        spec.text.check()
        blueprint.is_checked = True
        if at is not None:
            self.restore(at)
            return
        for line in spec.scripts:
            self._begin(line)

    # ------------------------------------------------------------------ what is in it

    @property
    def machines(self) -> Mapping[str, MotionController]:
        return self.parts.machines

    @property
    def lines(self) -> Mapping[str, Line]:
        return self.parts.lines

    @property
    def axes(self) -> Mapping[str, BuiltAxis]:
        return self.parts.axes

    @property
    def kernels(self) -> list[Kernel]:
        return self.parts.kernels

    @property
    def scripts(self) -> list[Script]:
        """The scripts that have not ended: those of the description, then those started later, in order."""
        return list(self._scripts)

    def touch(self, name: str) -> Kernel:
        """The kernel of a machine or line, advanced to the present. Raises `Misuse` with the existing names."""
        kernel = self.parts.kernel_of.get(name)
        if kernel is None:
            raise self.unknown("machine or line", name, self.parts.kernel_of)
        kernel.advance(self.now)
        return kernel

    @staticmethod
    def unknown(what: str, name: str, known: Iterable[str]) -> Unknown:
        near = NearMiss()
        text = f"no {what} is called {name!r}{near.hint(name, known)}; there are {', '.join(known) or 'none'}"
        return Unknown(name, text, near.of(name, known))

    def condition(self, text: str) -> SignalCondition:
        """The condition with this text. Raises `Misuse` for invalid text and for unknown signals."""
        found = self._conditions.get(text)
        if found is None:
            if len(self._conditions) >= MOST_REMEMBERED:
                self._conditions.clear()
            found = self._conditions[text] = SignalCondition(text, self.watched)
        return found

    def watched(self, name: str) -> SignalOf | Idle:
        """A signal for a condition. Raises `Misuse` with the existing names, and for one that conditions cannot use."""
        found = self.signal(name)
        found.watch(name)
        return found

    def signal(self, name: str) -> SignalOf | Idle:
        """The signal called ``name``. Raises `Misuse` with the existing names."""
        found = self._signals.get(name)
        if found is None:
            if len(self._signals) >= MOST_REMEMBERED:
                self._signals.clear()
            found = self._signals[name] = find_signal(self.parts, name)
        return found

    def read(self, name: str) -> float:
        """The present value of a signal. Raises `Misuse` for a write-only one."""
        found = self.signal(name)
        found.bring(self.now)
        return float(found.value(self.now))

    @cached_property
    def programs(self) -> Mapping[str, Programs]:
        """The programs of controllers that have any, by name of the controller."""
        given = GivenFiles(self)
        found = {one.name: one.kind.programs(one, self.machines[one.name], given) for one in self.spec.controllers}
        return {name: programs for name, programs in found.items() if programs is not None}

    # ------------------------------------------------------------------ scripts

    def _begin(self, spec: ScriptSpec) -> None:
        if spec.when is not None:
            text, once = spec.when, spec.once
            self.start(spec.name, partial(do.run_when, spec.steps, text, once=once))
        elif spec.every is not None:
            period = spec.every
            self.start(spec.name, partial(do.run_every, spec.steps, period, 0))
        else:
            steps = (do.At(spec.at or 0), *spec.steps)
            self.start(spec.name, partial(do.run_through, steps, spec.repeat))

    def observe(self, observer: WorldObserver) -> None:
        """Let it look at the world from now on, until `unobserve`."""
        self._scripts.observe(observer)

    def unobserve(self, observer: WorldObserver) -> None:
        self._scripts.unobserve(observer)

    def start(self, name: str, make: Callable[[], do.Steps | do.Walk], *, is_external: bool = False) -> Script:
        """Start a script now. ``make`` creates its steps; it is called again when a snapshot is restored."""
        return self._scripts.start(name, make, is_external=is_external)

    def expect(self, text: str) -> None:
        """Report a condition that does not hold, with the values that it has instead."""
        if not self.holds(self.condition(text)):
            self._report(self.failures, "expectation", self.told(text))

    def holds(self, condition: SignalCondition) -> bool:
        """Whether a condition is true now."""
        condition.bring(self.now)
        return condition.holds(self.now)

    def told(self, text: str) -> str:
        """A condition with what its signals are now: ``lift.count == 3; lift.count is 0``."""
        condition = self.condition(text)
        condition.bring(self.now)
        return condition.told(self.now)

    def report_refused(self, text: str) -> None:
        """Report a command of a script that cannot be done."""
        self._report(self.failures, "expectation", text)

    def report_overdue(self, text: str) -> None:
        """Report that a wait of a script of the description timed out."""
        self._report(self.overdue, "overdue", text)

    def _report(self, reports: Reports, code: str, text: str) -> None:
        record = TraceRecord(self.now, WORLD, "event", code, text)
        reports.add(record)
        self.trace.add(record)

    # ------------------------------------------------------------------ external inputs

    def apply_input(self, what: ExternalInput) -> None:
        """Apply an external input at the present moment and record it for replay. If it raises `Misuse`, nothing has changed."""
        check_step(self, what)
        self.perform(what)
        self.note(what)

    @property
    def notes_inputs(self) -> bool:
        """Whether anything wants to know of what comes from outside."""
        return self.keeps_inputs or bool(self.input_watchers)

    def note(self, what: ExternalInput) -> None:
        """Keep what was done from outside at the present moment, where inputs are kept, and tell watchers."""
        if self.notes_inputs:
            given = RecordedInput(self.now, what, self.is_settled)
            if self.keeps_inputs:
                self.inputs.append(given)
            for watcher in self.input_watchers:
                watcher(given)
        self.is_settled = False

    def perform(self, what: ExternalInput, by: str = "") -> None:
        """Execute an action at the present moment; ``by``: its script. Raises `Misuse` for names that do not exist."""
        for watcher in self.act_watchers:
            watcher(by, what)
        act(self, what)

    def machine(self, name: str) -> MotionController:
        """The machine called ``name``. Raises `Misuse` with the existing ones."""
        machine = self.machines.get(name)
        if machine is None:
            raise self.unknown("machine", name, self.machines)
        return machine

    def kind(self, name: str) -> AnyKind:
        """The kind of a machine. Raises `Misuse` with the existing machines."""
        kind = self.parts.kind_of.get(name)
        if kind is None:
            raise self.unknown("machine", name, self.machines)
        return kind

    def input_pin(self, name: str, pin: str, level: float) -> str:
        """The name of the input that ``pin`` means. Raises `Misuse` with the existing inputs, and for a level out of range."""
        kind = self.kind(name)
        found = kind.input_pin(pin, level)
        kind.refuse_taken(self.machine(name), found)
        return found

    def registers(self, name: str) -> NamedRegisters[Any]:
        """The registers of a machine. Raises `Misuse` if it has none."""
        kind = self.kind(name)
        if kind.registers is None:
            raise lacks(name, kind, "registers")
        return kind.registers

    def encoders(self, name: str) -> EncoderInputs[Any]:
        """The encoder inputs of a machine. Raises `Misuse` if it has none."""
        kind = self.kind(name)
        if kind.encoders is None:
            raise lacks(name, kind, "encoder")
        return kind.encoders

    def vision(self, name: str) -> Vision[Any, Any]:
        """The vision registers of a machine. Raises `Misuse` if it has none."""
        kind = self.kind(name)
        if kind.vision is None:
            raise lacks(name, kind, "vision registers")
        return kind.vision

    @staticmethod
    def by_machine(step: do.Write) -> Iterator[tuple[str, NewValues]]:
        """The values that a step writes, grouped by machine."""
        for name, group in groupby(step.values, key=itemgetter(0)):
            yield name, tuple([(register, value) for _, register, value in group])

    def requests(self, name: str, registers: NamedRegisters[Any], values: NewValues) -> tuple[bytes, ...]:
        """The PDUs that write ``values`` to `registers` of a machine. Raises `Misuse` for values that one does not accept."""
        machine = self.parts.machines[name]
        key = (self.parts.kind_of[name].name, registers.dialect(machine), values)
        found = self._encoded.get(key)
        if found is None:
            if len(self._encoded) >= MOST_REMEMBERED:
                self._encoded.clear()
            found = self._encoded[key] = registers.requests(machine, values)
        return found

    def programs_of(self, name: str) -> Programs:
        """The programs of a machine. Raises `Misuse` for a machine without."""
        kind = self.kind(name)
        if name not in self.programs:
            raise lacks(name, kind, "program whose text is known")
        return self.programs[name]

    def button(self, name: str) -> tuple[Button, Kernel]:
        """The button called ``name`` and its kernel. Raises `Misuse` with the existing buttons."""
        found = self.parts.buttons.get(name)
        if found is None:
            raise self.unknown("button", name, self.parts.buttons)
        return found

    def line_called(self, name: str) -> Line:
        """The line called ``name``. Raises `Misuse` with the existing lines."""
        line = self.lines.get(name)
        if line is None:
            raise self.unknown("line", name, self.lines)
        return line

    def put_fault(self, fault: Fault) -> None:
        """Set a fault now. Raises `Misuse` for one that cannot occur in this world."""
        self.settle_all()
        self.rigging.put(fault, self.now)

    # ------------------------------------------------------------------ time

    def next(self) -> Nanos | None:
        """The time of the next event of a script; None if there is none."""
        return _first(_first(*self._scripts.first()), self._scripts.first_observed(), None)

    def advance(self, now: Nanos) -> None:
        """Advance the scripts, and the kernels they depend on, to ``now``, or to the moment at which a script stops the run.

        All events of that moment are processed, so that the result depends on the duration of a run only.
        """
        if now < self.now:
            raise TimeReversal(self.now, now)
        rounds, at = 0, -1
        while True:
            kernels, own, guests = self._scripts.first()
            due = _first(kernels, own, guests)
            observed = self._scripts.first_observed()
            if observed is not None and (due is None or observed < due):
                due = observed
            if due is None or due > (now if self.stopped is None else self.now):
                break
            if due > self.now:
                self._scripts.leave(due)
                self.now = due
            rounds, at = (rounds + 1, at) if self.now == at else (0, self.now)
            if rounds > MOST_STEPS_PER_INSTANT:
                raise Runaway(f"scripts loop without end at {self.now} ns")
            if kernels is not None and kernels <= self.now:
                self._scripts.advance_kernels()
            elif own is not None and own <= self.now:
                self._scripts.run_described()
            elif guests is not None and guests <= self.now:
                self.is_settled = True
                self._scripts.run_external()
            else:
                self._scripts.look()
        self.is_settled = True
        if self.stopped is None:
            if now > self.now:
                self._scripts.leave(now)
            self.now = now

    def watch_kernels(self, watch: Callable[[Kernel], None]) -> None:
        """Call ``watch`` from now on with every kernel that has changed, as `Kernel.on_change`."""
        self._scripts.watch_kernels(self.kernels, watch)

    def stop_recording(self) -> None:
        """Record nothing from now on: no trace, digest or session. Watchers of the trace are called, but not with frames."""
        self.keeps_inputs = False
        self.inputs.clear()
        self.trace.stop()
        for line in self.lines.values():
            line.stop_recording()

    def settle_all(self) -> None:
        """Advance every kernel to the present."""
        for kernel in (*self.settled_first, *self.kernels):
            kernel.advance(self.now)

    def run_to(self, end: Nanos, until: str | None = None) -> str | None:
        """Run to the moment ``end``, or until a condition is true. Returns the reason for ending before ``end``, or None."""
        self.go_on()
        watch = None
        if until is not None:
            steps = (do.Until(until), do.Stop(until))
            watch = self.start("until", partial(do.run_through, steps))
        self.advance(end)
        if watch is not None:
            self._scripts.end(watch)
        self.settle_all()
        return self.stopped

    def schedule(self, name: str, steps: tuple[do.Step, ...]) -> None:
        """Start steps as a script of the description; they replace steps scheduled under the same name."""
        self.unschedule(name)
        self._scheduled[name] = self.start(name, partial(do.run_through, steps))

    def unschedule(self, name: str) -> None:
        """Cancel the steps scheduled under a name, if any."""
        script = self._scheduled.pop(name, None)
        if script is not None:
            self._scripts.end(script)

    def end_scripts(self) -> None:
        """End the scripts of the description, and texts that are being typed into controllers; buttons are released in time."""
        kept = {script for name, script in self._scheduled.items() if is_release(name)}
        for script in [one for one in self._scripts if not one.is_external and one not in kept]:
            self.trace.add(TraceRecord(self.now, WORLD, "event", "script-ended", f"script {script.name} was ended"))
            self._scripts.end(script)
        self._scheduled = {name: script for name, script in self._scheduled.items() if script in kept}

    def go_on(self) -> None:
        """Let a stopped world continue."""
        self.stopped = None

    # ------------------------------------------------------------------ snapshots

    def snapshot(self, *, with_inputs: bool = True) -> PlantSnapshot:
        """Everything at the present moment, ``with_inputs`` also what came from outside before, where it is kept."""
        self.settle_all()
        return PlantSnapshot(
            self._description(),
            self.now,
            tuple(kernel.snapshot() for kernel in self.kernels),
            tuple((active.fault, active.name, active.since) for active in self.parts.faults.active),
            tuple(self.parts.faults.machines),
            self.parts.faults.copy_state(),
            self._scripts.state(),
            tuple(self.inputs) if with_inputs else (),
            self.is_settled,
            self.failures.state(),
            self.overdue.state(),
            self.trace.mark(),
            frozenset(self._scheduled),
            tuple(self.downloaded.items()),
        )

    def _description(self) -> tuple[str, int, Overrides, FileContents]:
        return self.spec.text.source.text, self.spec.seed, self.spec.overrides, self.files

    def restore(self, snapshot: PlantSnapshot) -> None:
        """Continue from a snapshot of this world, or of one with the same description.


        Raises `Misuse` for a snapshot of another world.
        """
        if snapshot.description != self._description():
            raise Misuse("the snapshot is of another world")
        self.now = snapshot.now
        self.stopped = None
        self.trace.rewind(snapshot.trace)
        self.rigging.put_back(snapshot.faults, snapshot.rigged, snapshot.faults_state)
        for kernel, state in zip(self.kernels, snapshot.kernels, strict=True):
            kernel.restore(state)
        self.inputs, self.is_settled = list(snapshot.inputs), snapshot.is_settled
        self.failures, self.overdue = Reports(snapshot.failures), Reports(snapshot.overdue)
        self.downloaded = dict(snapshot.downloaded)
        self._conditions.clear()
        self._scripts.restore(snapshot.scripts)
        self._scheduled = {
            script.name: script for script in self._scripts if script.name in snapshot.scheduled and not script.is_external
        }


def _first(one: Nanos | None, other: Nanos | None, third: Nanos | None) -> Nanos | None:
    due = other if one is None or (other is not None and other < one) else one
    return third if due is None or (third is not None and third < due) else due
