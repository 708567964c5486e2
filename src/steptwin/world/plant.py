"""A world that runs: its kernels, each advanced on demand, and the scripts that act on them.

Machines that share nothing are in kernels of their own. A kernel is advanced to the present when something reads it or does
something to it; conditions keep the kernels they speak of up to date, event by event. So the order in which kernels are
advanced never matters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from operator import itemgetter
from typing import Any, NamedTuple

from steptwin.errors import Misuse, Runaway, TimeReversal
from steptwin.machine import MotionController, Nanos
from steptwin.nearmiss import NearMiss
from steptwin.world import script as do
from steptwin.world.actions import Outside, act
from steptwin.world.build import Files, Keep, build
from steptwin.world.contacts import Button
from steptwin.world.elements.axis import Fitted
from steptwin.world.expression import SignalCondition
from steptwin.world.faults import Fault
from steptwin.world.kernel import Kernel, KernelState
from steptwin.world.kind import AnyKind, Encoders, NamedRegisters, Values, Vision, lacks
from steptwin.world.lines import Line
from steptwin.world.names import Unknown
from steptwin.world.overrides import Overrides
from steptwin.world.parts import WorldParts
from steptwin.world.references import check_faults, check_scripts, check_step
from steptwin.world.reports import Reports, ReportsState
from steptwin.world.rigging import Rigging
from steptwin.world.running import Script
from steptwin.world.scripts import MOST_STEPS_PER_INSTANT, Scripts, ScriptsState
from steptwin.world.signals import Idle, SignalOf, find_signal
from steptwin.world.spec import ScriptSpec, WorldSpec
from steptwin.world.trace import Mark, Trace, TraceRecord

WORLD = "world"
"""What happens to no machine happens to the world."""

MOST_REMEMBERED = 10_000
"""Requests, signals and conditions are remembered, for scripts use the same again and again; not more of each than these."""


class Given(NamedTuple):
    """Something from outside, and when it came. ``settled``: the scripts of the description had done what they had to do then."""

    time: Nanos
    what: Outside
    settled: bool = False


@dataclass(frozen=True, slots=True)
class PlantSnapshot:
    """All state of a world at a moment."""

    description: tuple[str, int, Overrides, Files]
    now: Nanos
    kernels: tuple[KernelState, ...]
    faults: tuple[tuple[Fault, str, Nanos], ...]
    """Those that were set, with their names and moments."""
    faults_state: Any
    scripts: ScriptsState
    inputs: tuple[Given, ...]
    is_settled: bool
    failures: ReportsState
    overdue: ReportsState
    trace: Mark
    later: frozenset[str]
    """Names of what is done later, and may be called off."""


class Plant:
    """A world without files and clocks."""

    def __init__(
        self,
        spec: WorldSpec,
        files: Files,
        *,
        keep_trace: bool = True,
        keep_inputs: bool = True,
        keep_memory: Keep | None = None,
    ) -> None:
        names = [*(controller.name for controller in spec.controllers), *(line.name for line in spec.lines), WORLD]
        self.spec = spec
        self.files = files
        self.trace = Trace(names, keep=keep_trace)
        self.plan: WorldParts = build(spec, files, self.trace.add, keep_memory)
        self.now: Nanos = 0
        self.stopped: str | None = None
        """Why the run ended, where a script gave a reason."""
        self.failures = Reports()
        """Expectations that did not hold."""
        self.overdue = Reports()
        """What scripts of the description waited for in vain."""
        self.keeps_inputs = keep_inputs
        """Whether everything from outside is kept, as a session needs it; a world that runs for weeks has no room for that."""
        self.inputs: list[Given] = []
        """Everything from outside so far, where it is kept."""
        self.is_settled = False
        """Whether the scripts of the description have done what they had to do since the last of that."""
        self._encoded: dict[object, tuple[bytes, ...]] = {}
        self._signals: dict[str, SignalOf | Idle] = {}
        self._conditions: dict[str, SignalCondition] = {}
        self._scripts = Scripts(self)
        self._later: dict[str, Script] = {}
        """What is done later, and may be called off, by name."""
        self.rigging = Rigging(self.plan)
        check_faults(self, spec.faults)
        check_scripts(self, spec.scripts)
        spec.text.check()
        for line in spec.scripts:
            self._begin(line)

    # ------------------------------------------------------------------ what is in it

    @property
    def machines(self) -> Mapping[str, MotionController]:
        return self.plan.machines

    @property
    def lines(self) -> Mapping[str, Line]:
        return self.plan.lines

    @property
    def axes(self) -> Mapping[str, Fitted]:
        return self.plan.axes

    @property
    def kernels(self) -> list[Kernel]:
        return self.plan.kernels

    @property
    def scripts(self) -> list[Script]:
        """Scripts that have not ended, in their order: those of the description, then those started later."""
        return list(self._scripts)

    def touch(self, name: str) -> Kernel:
        """The kernel of a machine or line, brought to the present. `Misuse` with the names there are."""
        kernel = self.plan.kernel_of.get(name)
        if kernel is None:
            raise self.unknown("machine or line", name, self.plan.kernel_of)
        kernel.advance(self.now)
        return kernel

    @staticmethod
    def unknown(what: str, name: str, known: Iterable[str]) -> Unknown:
        hint = NearMiss().hint(name, known)
        return Unknown(name, f"no {what} is called {name!r}{hint}; there are {', '.join(known) or 'none'}")

    def condition(self, text: str) -> SignalCondition:
        """Raises `Misuse` for what is not a condition, and for unknown signals."""
        found = self._conditions.get(text)
        if found is None:
            if len(self._conditions) >= MOST_REMEMBERED:
                self._conditions.clear()
            found = self._conditions[text] = SignalCondition(text, self._watched)
        return found

    def _watched(self, name: str) -> SignalOf | Idle:
        found = self.signal(name)
        found.watch(name)
        return found

    def signal(self, name: str) -> SignalOf | Idle:
        """The signal called ``name``. Raises `Misuse` with what there is."""
        found = self._signals.get(name)
        if found is None:
            if len(self._signals) >= MOST_REMEMBERED:
                self._signals.clear()
            found = self._signals[name] = find_signal(self.plan, name)
        return found

    def read(self, name: str) -> float:
        """The present value of a signal. Raises `Misuse` for one that can only be written."""
        found = self.signal(name)
        found.bring(self.now)
        return float(found.value(self.now))

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

    def start(self, name: str, make: Callable[[], do.Steps | do.Walk], *, is_outside: bool = False) -> Script:
        """Let a script run from now on. ``make`` makes its steps, again whenever a snapshot is restored."""
        return self._scripts.start(name, make, is_outside=is_outside)

    def expect(self, text: str) -> None:
        """Report a condition that does not hold."""
        if not self.holds(self.condition(text)):
            self._report(self.failures, "expectation", text)

    def holds(self, condition: SignalCondition) -> bool:
        """Whether a condition is true now."""
        condition.bring(self.now)
        return condition.holds(self.now)

    def report_overdue(self, text: str) -> None:
        """A script of the description has waited for something in vain."""
        self._report(self.overdue, "overdue", text)

    def _report(self, reports: Reports, code: str, text: str) -> None:
        record = TraceRecord(self.now, WORLD, "event", code, text)
        reports.add(record)
        self.trace.add(record)

    # ------------------------------------------------------------------ what comes from outside

    def outside(self, what: Outside) -> None:
        """Do something from outside at the present moment, and keep it for a replay. A `Misuse` changes nothing."""
        check_step(self, what)
        self.perform(what)
        self.note(what)

    def note(self, what: Outside) -> None:
        """Keep what was done from outside at the present moment, where inputs are kept."""
        if self.keeps_inputs:
            self.inputs.append(Given(self.now, what, self.is_settled))
        self.is_settled = False

    def perform(self, what: Outside) -> None:
        """Do something at the present moment. Raises `Misuse` for what is not there."""
        act(self, what)

    def machine(self, name: str) -> MotionController:
        """Raises `Misuse` with the machines there are."""
        machine = self.machines.get(name)
        if machine is None:
            raise self.unknown("machine", name, self.machines)
        return machine

    def kind(self, name: str) -> AnyKind:
        """The kind of a machine. Raises `Misuse` with the machines there are."""
        self.machine(name)
        return self.plan.kind_of[name]

    def input_pin(self, name: str, pin: str, level: float) -> str:
        """The input of a machine that ``pin`` means. Raises `Misuse` with those there are, and for a level it does not take."""
        kind = self.kind(name)
        found = kind.input_pin(pin, level)
        kind.refuse_taken(self.machine(name), found)
        return found

    def registers(self, name: str) -> NamedRegisters[Any]:
        """Raises `Misuse` for a machine without."""
        kind = self.kind(name)
        if kind.registers is None:
            raise lacks(name, kind, "registers")
        return kind.registers

    def encoders(self, name: str) -> Encoders[Any]:
        """Raises `Misuse` for a machine without."""
        kind = self.kind(name)
        if kind.encoders is None:
            raise lacks(name, kind, "encoder")
        return kind.encoders

    def vision(self, name: str) -> Vision[Any, Any]:
        """Raises `Misuse` for a machine without."""
        kind = self.kind(name)
        if kind.vision is None:
            raise lacks(name, kind, "vision registers")
        return kind.vision

    @staticmethod
    def by_machine(step: do.Write) -> Iterator[tuple[str, Values]]:
        """What a step writes to one machine after the other."""
        for name, group in groupby(step.values, key=itemgetter(0)):
            yield name, tuple((register, value) for _, register, value in group)

    def requests(self, name: str, values: Values) -> tuple[bytes, ...]:
        """The PDUs that write ``values`` to a machine. Raises `Misuse` for what a register does not take."""
        registers, machine = self.registers(name), self.machine(name)
        key = (self.kind(name).name, registers.dialect(machine), values)
        found = self._encoded.get(key)
        if found is None:
            if len(self._encoded) >= MOST_REMEMBERED:
                self._encoded.clear()
            found = self._encoded[key] = registers.requests(machine, values)
        return found

    def button(self, name: str) -> tuple[Button, Kernel]:
        """Raises `Misuse` with the buttons there are."""
        found = self.plan.buttons.get(name)
        if found is None:
            raise self.unknown("button", name, self.plan.buttons)
        return found

    def line_called(self, name: str) -> Line:
        """Raises `Misuse` with the lines there are."""
        line = self.lines.get(name)
        if line is None:
            raise self.unknown("line", name, self.lines)
        return line

    def put_fault(self, fault: Fault) -> None:
        """Set a fault now. Raises `Misuse` for one that cannot happen here."""
        self.settle_all()
        self.rigging.put(fault, self.now)

    # ------------------------------------------------------------------ time

    def next(self) -> Nanos | None:
        """When something happens to a script."""
        return _first(*self._scripts.first())

    def advance(self, now: Nanos) -> None:
        """Bring the scripts, and the kernels they need, to ``now``, or to the end of the moment at which a script stops the run.

        What ends at a moment has seen all of it, so that its length determines what happened.
        """
        if now < self.now:
            raise TimeReversal(self.now, now)
        rounds, at = 0, -1
        while True:
            own, guests = self._scripts.first()
            due = _first(own, guests)
            if due is None or due > (now if self.stopped is None else self.now):
                break
            self.now = max(due, self.now)
            rounds, at = (rounds + 1, at) if self.now == at else (0, self.now)
            if rounds > MOST_STEPS_PER_INSTANT:
                raise Runaway(f"scripts go round for ever at {self.now} ns")
            if own is not None and own <= self.now:
                self._scripts.run_own()
            else:
                self.is_settled = True
                self._scripts.run_guests()
        self.is_settled = True
        if self.stopped is None:
            self.now = now

    def watch_kernels(self, watch: Callable[[Kernel], None]) -> None:
        """Call ``watch`` from now on with every kernel in which something has happened, as `Kernel.on_change`."""
        self._scripts.watch_kernels(self.kernels, watch)

    def stop_recording(self) -> None:
        """Record nothing from now on: no trace, digest or session. Watchers of the trace are called, but not with frames."""
        self.keeps_inputs = False
        self.inputs.clear()
        self.trace.stop()
        for line in self.lines.values():
            line.stop_recording()

    def settle_all(self) -> None:
        """Bring every kernel to the present."""
        for kernel in self.kernels:
            kernel.advance(self.now)

    def run_to(self, end: Nanos, until: str | None = None) -> str | None:
        """Run to the moment ``end``, or until a condition is true; gives why it ended before ``end``, else None."""
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

    def do_later(self, name: str, steps: tuple[do.Step, ...]) -> None:
        """Steps that are taken as those of the description, instead of others begun under the same name."""
        self.call_off(name)
        self._later[name] = self.start(name, partial(do.run_through, steps))

    def call_off(self, name: str) -> None:
        """What was to be done later under a name is not done."""
        script = self._later.pop(name, None)
        if script is not None:
            self._scripts.end(script)

    def go_on(self) -> None:
        """A world that was stopped may go on."""
        self.stopped = None

    # ------------------------------------------------------------------ snapshots

    def snapshot(self) -> PlantSnapshot:
        """Everything at the present moment."""
        self.settle_all()
        return PlantSnapshot(
            self._description(),
            self.now,
            tuple(kernel.snapshot() for kernel in self.kernels),
            tuple((active.fault, active.name, active.since) for active in self.plan.faults.active),
            self.plan.faults.copy_state(),
            self._scripts.state(),
            tuple(self.inputs),
            self.is_settled,
            self.failures.state(),
            self.overdue.state(),
            self.trace.mark(),
            frozenset(self._later),
        )

    def _description(self) -> tuple[str, int, Overrides, Files]:
        return self.spec.text.source.text, self.spec.seed, self.spec.overrides, self.files

    def restore(self, snapshot: PlantSnapshot) -> None:
        """Go on where a snapshot of this world, or of one with the same description, was taken.

        Raises `Misuse` for a snapshot of another world.
        """
        if snapshot.description != self._description():
            raise Misuse("the snapshot is of another world")
        self.now = snapshot.now
        self.stopped = None
        self.trace.rewind(snapshot.trace)
        self.rigging.put_back(snapshot.faults, snapshot.faults_state)
        for kernel, state in zip(self.kernels, snapshot.kernels, strict=True):
            kernel.restore(state)
        self.inputs, self.is_settled = list(snapshot.inputs), snapshot.is_settled
        self.failures, self.overdue = Reports(snapshot.failures), Reports(snapshot.overdue)
        self._conditions.clear()
        self._scripts.restore(snapshot.scripts)
        self._later = {script.name: script for script in self._scripts if script.name in snapshot.later and not script.is_outside}


def _first(one: Nanos | None, other: Nanos | None) -> Nanos | None:
    return other if one is None else one if other is None else min(one, other)
