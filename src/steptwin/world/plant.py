"""A world that runs: its kernels, each as far as somebody looked, and the scripts that act on them.

Machines that share nothing are in kernels of their own. A kernel is brought to the present when somebody looks at it or does
something to it; conditions keep the kernels they speak of up to date, event by event. So the order in which kernels are
advanced never matters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from typing import Any, NamedTuple, TypeAlias

from steptwin.errors import Misuse, Runaway, TimeReversal
from steptwin.m1486.chip import M1486
from steptwin.machine import Nanos
from steptwin.mic488.device import Mic488
from steptwin.wbc.nearmiss import NearMiss
from steptwin.wire.rtu import encode_frame
from steptwin.world import script as do
from steptwin.world.actions import Bytes, Outside, act
from steptwin.world.agenda import Agenda
from steptwin.world.build import Files, Fitted, Plan, build
from steptwin.world.contacts import Button
from steptwin.world.expression import Condition
from steptwin.world.faults import Fault
from steptwin.world.kernel import Kernel, KernelState
from steptwin.world.lines import SCRIPTS, Line
from steptwin.world.references import check_scripts, check_step
from steptwin.world.rigging import Rigging
from steptwin.world.running import Script, ScriptState, Waiting
from steptwin.world.signals import find_signal
from steptwin.world.spec import ScriptSpec, WorldSpec
from steptwin.world.trace import Mark, Record, Trace

MOST_STEPS_PER_INSTANT = 10_000
"""More steps of scripts at one moment are a runaway."""
WORLD = "world"
"""What happens to no machine happens to the world."""

Values: TypeAlias = tuple[tuple[str, float], ...]
"""Registers by name, and what they are to take."""
Encode: TypeAlias = Callable[[Mic488, Values], tuple[bytes, ...]]
"""The PDUs of the requests that write registers by name, in order; as few as may be."""
MOST_ENCODED = 10_000
"""Requests are remembered, for scripts write the same again and again; not more than these."""


class Given(NamedTuple):
    """Something from outside, and when it came. ``settled``: the scripts of the description had done what they had to do then."""

    time: Nanos
    what: Outside
    settled: bool = False


@dataclass(frozen=True, slots=True)
class PlantSnapshot:
    """All state of a world at a moment."""

    description: tuple[str, int, Files]
    now: Nanos
    kernels: tuple[KernelState, ...]
    faults: tuple[tuple[Fault, str, Nanos], ...]
    """Those that were set, with their names and moments."""
    faults_state: Any
    scripts: tuple[ScriptState, ...]
    inputs: tuple[Given, ...]
    is_settled: bool
    failures: tuple[Record, ...]
    overdue: tuple[Record, ...]
    trace: Mark


class Plant:
    """A world without files and clocks. ``encode`` makes the requests of `Write` steps."""

    def __init__(
        self, spec: WorldSpec, files: Files, encode: Encode, *, keep_trace: bool = True, keep_inputs: bool = True
    ) -> None:
        names = [*(m.name for m in (*spec.mic488, *spec.m1486)), *(line.name for line in spec.lines), WORLD]
        self.spec = spec
        self.files = files
        self.trace = Trace(names, keep=keep_trace)
        self.plan: Plan = build(spec, files, self.trace.add)
        self.now: Nanos = 0
        self.stopped: str | None = None
        """Why the run ended, where a script says so."""
        self.failures: list[Record] = []
        """Expectations that did not hold."""
        self.overdue: list[Record] = []
        """What scripts of the description waited for in vain."""
        self.keeps_inputs = keep_inputs
        """Whether everything from outside is kept, as a session needs it; a world that runs for weeks has no room for that."""
        self.inputs: list[Given] = []
        """Everything from outside so far, where it is kept."""
        self._is_settled = False
        """Whether the scripts of the description have done what they had to do since the last of that."""
        self.encode = encode
        self._encoded: dict[object, tuple[bytes, ...]] = {}
        self._scripts: list[Script] = []
        self._own, self._guests = Agenda(), Agenda()
        """The scripts of the description, and those from outside: they come when the others have nothing to do at a moment."""
        self.rigging = Rigging(self.plan)
        for n, fault in enumerate(spec.faults):
            try:
                self.put_fault(fault)
            except Misuse as error:
                spec.text.wrong(("fault", n), "D009", str(error))
        check_scripts(self, spec.scripts)
        for line in spec.scripts:
            self._begin(line)

    # ------------------------------------------------------------------ what is in it

    @property
    def machines(self) -> Mapping[str, Mic488 | M1486]:
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
        """All scripts in their order: those of the description, then those started later."""
        return self._scripts

    def touch(self, name: str) -> Kernel:
        """The kernel of a machine or line, brought to the present. `Misuse` with the names there are."""
        kernel = self.plan.kernel_of.get(name)
        if kernel is None:
            raise self.unknown("machine or line", name, self.plan.kernel_of)
        kernel.advance(self.now)
        return kernel

    @staticmethod
    def unknown(what: str, name: str, known: Iterable[str]) -> Misuse:
        near = NearMiss().of(name, known)
        hint = "" if near is None else f" (did you mean {near!r}?)"
        return Misuse(f"no {what} is called {name!r}{hint}; there are {', '.join(known) or 'none'}")

    def condition(self, text: str) -> Condition:
        """Raises `Misuse` for what is no condition, and for unknown signals."""
        return Condition(text, lambda name: find_signal(self.plan, name))

    def read(self, signal: str) -> float:
        """The present value of a signal."""
        found = find_signal(self.plan, signal)
        for kernel in found.kernels:
            kernel.advance(self.now)
        return found.value(self.now)

    # ------------------------------------------------------------------ scripts

    def _begin(self, spec: ScriptSpec) -> None:
        if spec.when is not None:
            text, once = spec.when, spec.once
            self.start(spec.name, lambda: do.run_when(spec.steps, text, once=once))
        elif spec.every is not None:
            period = spec.every
            self.start(spec.name, lambda: do.run_every(spec.steps, period, 0))
        else:
            steps = (do.At(spec.at or 0), *spec.steps)
            self.start(spec.name, lambda: do.run_through(steps, spec.repeat))

    def start(self, name: str, make: Callable[[], do.Steps], *, is_outside: bool = False) -> Script:
        """Let a script run from now on. ``make`` makes its generator, again whenever a snapshot is restored."""
        script = Script(len(self._scripts), name, make, is_outside=is_outside)
        self._scripts.append(script)
        self._wait(script, Waiting(self.now))
        return script

    def _resume(self, script: Script, value: Any) -> None:
        script.waiting = None
        for _ in range(MOST_STEPS_PER_INSTANT):
            step = script.send(value)
            if step is None:
                return
            value = None
            if isinstance(step, do.Stop):
                self.stopped = step.reason if self.stopped is None else self.stopped
                self._wait(script, Waiting(self.now + 1))
                return
            waiting = self._waits(step, script)
            if waiting is not None:
                self._wait(script, waiting)
                return
            value = self._gives(step, script)
        raise Runaway(f"script {script.name!r}: more than {MOST_STEPS_PER_INSTANT} steps at {self.now} ns")

    def _wait(self, script: Script, waiting: Waiting) -> None:
        self._agenda_of(script).add(script, waiting)

    def _agenda_of(self, script: Script) -> Agenda:
        return self._guests if script.is_outside else self._own

    def _waits(self, step: do.Step, script: Script) -> Waiting | None:
        if isinstance(step, do.Wait):
            return Waiting(self.now + step.duration) if step.duration > 0 else None
        if isinstance(step, do.At):
            return Waiting(step.time) if step.time > self.now else None
        if isinstance(step, do.Until):
            return Waiting(None if step.within is None else self.now + step.within, self.condition(step.condition))
        if isinstance(step, do.Request):
            line = self.line_called(step.line)
            place = line.connect(SCRIPTS)
            place.received.clear()
            self._do(script, Bytes(step.line, SCRIPTS, place.kind, encode_frame(step.unit, step.pdu)))
            return Waiting(self.now + step.within, answer=line)
        return None

    def _gives(self, step: do.Step, script: Script) -> Any:
        if isinstance(step, do.Wait | do.At):
            return None  # its moment has come already
        if isinstance(step, do.Read):
            return self.read(step.signal)
        if isinstance(step, do.Call):
            step.function()
        else:
            self._do(script, step)
        return None

    def _do(self, script: Script, what: Outside) -> None:
        if script.is_outside:
            self.outside(what)
        else:
            self.perform(what)

    def expect(self, text: str) -> None:
        """Tell it where a condition does not hold."""
        if not self.holds(self.condition(text)):
            self.failures.append(Record(self.now, WORLD, "event", "expectation", text))
            self.trace.add(self.failures[-1])

    def holds(self, condition: Condition) -> bool:
        """Whether a condition is true now."""
        self._bring(condition)
        return condition.holds(self.now)

    def _bring(self, condition: Condition) -> None:
        for kernel in self._kernels_of(condition):
            kernel.advance(self.now)

    def _kernels_of(self, condition: Condition) -> list[Kernel]:
        return [kernel for name in condition.signals for kernel in find_signal(self.plan, name).kernels]

    # ------------------------------------------------------------------ what comes from outside

    def outside(self, what: Outside) -> None:
        """Do something from outside at the present moment, and keep it for a replay. A `Misuse` changes nothing."""
        check_step(self, what)
        self.perform(what)
        if self.keeps_inputs:
            self.inputs.append(Given(self.now, what, self._is_settled))
        self._is_settled = False

    def perform(self, what: Outside) -> None:
        """Do something at the present moment. Raises `Misuse` for what is not there."""
        act(self, what)

    def machine(self, name: str) -> Mic488 | M1486:
        """Raises `Misuse` with the machines there are."""
        machine = self.machines.get(name)
        if machine is None:
            raise self.unknown("machine", name, self.machines)
        return machine

    def controller(self, name: str, what: str) -> Mic488:
        """A MIC488. Raises `Misuse` for other machines, which do not have ``what``."""
        machine = self.machine(name)
        if not isinstance(machine, Mic488):
            raise Misuse(f"{name!r} is an M1486, which has no {what}")
        return machine

    @staticmethod
    def by_machine(step: do.Write) -> Iterator[tuple[str, Values]]:
        """What a step writes to one machine after the other."""
        for name, group in groupby(step.values, key=itemgetter(0)):
            yield name, tuple((register, value) for _, register, value in group)

    def requests(self, device: Mic488, values: Values) -> tuple[bytes, ...]:
        """The PDUs that write ``values``. Raises `Misuse` for what a register does not take."""
        key = (device.firmware.name, device.data_type, values)
        found = self._encoded.get(key)
        if found is None:
            if len(self._encoded) >= MOST_ENCODED:
                self._encoded.clear()
            found = self._encoded[key] = self.encode(device, values)
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
        return _first(self._due(self._own), self._due(self._guests))

    def _due(self, agenda: Agenda) -> Nanos | None:
        due = agenda.moment()
        for script in agenda.watching:
            waiting = script.waiting
            if waiting is None:
                continue
            dues = [waiting.until]
            if waiting.condition is not None:
                self._bring(waiting.condition)
                dues.append(waiting.condition.due(self.now))
                dues += [kernel.deadline() for kernel in self._kernels_of(waiting.condition)]
            if waiting.answer is not None:
                kernel = self.touch(waiting.answer.name)
                dues += [kernel.deadline(), self.now if waiting.answer.connect(SCRIPTS).received else None]
            for one in dues:
                if one is not None and (due is None or one < due):
                    due = one
        return due

    def advance(self, now: Nanos) -> None:
        """Bring the scripts, and the kernels they need, to ``now``, or to the end of the moment at which a script stops the run.

        What ends at a moment has seen all of it, so that how long it ran tells what happened.
        """
        if now < self.now:
            raise TimeReversal(self.now, now)
        rounds, at = 0, -1
        while True:
            own, guests = self._due(self._own), self._due(self._guests)
            due = _first(own, guests)
            if due is None or due > (now if self.stopped is None else self.now):
                break
            self.now = max(due, self.now)
            rounds, at = (rounds + 1, at) if self.now == at else (0, self.now)
            if rounds > MOST_STEPS_PER_INSTANT:
                raise Runaway(f"scripts go round for ever at {self.now} ns")
            if own is not None and own <= self.now:
                self._run_scripts(self._own)
            else:
                self._is_settled = True
                self._run_scripts(self._guests)
        self._is_settled = True
        if self.stopped is None:
            self.now = now

    def _run_scripts(self, agenda: Agenda) -> None:
        for script in agenda.take(self.now):
            self._resume(script, None)
        for script in [script for script in agenda.watching if script.waiting is not None]:
            waiting = script.waiting
            if waiting is None:
                continue
            found, value = self._come(waiting)
            if found or (waiting.until is not None and waiting.until <= self.now):
                agenda.watching.remove(script)
                if not found:
                    self._tell_overdue(script, waiting)
                self._resume(script, value)

    def _tell_overdue(self, script: Script, waiting: Waiting) -> None:
        """Steps of a description go on whether or not what they wait for comes; code from outside is sent that, and decides."""
        if waiting.condition is not None and not script.is_outside:
            text = f"{script.name} waited in vain for {waiting.condition.text}"
            self.overdue.append(Record(self.now, WORLD, "event", "overdue", text))
            self.trace.add(self.overdue[-1])

    def _come(self, waiting: Waiting) -> tuple[bool, Any]:
        """Whether what a script waits for has come, and what it is sent."""
        if waiting.answer is not None:
            self.touch(waiting.answer.name)
            answer = b"".join(data for _, data in waiting.answer.connect(SCRIPTS).take(self.now))
            return bool(answer), answer[1:-2]
        if waiting.condition is None:
            return False, None
        holds = self.holds(waiting.condition)
        return holds, holds

    def settle_all(self) -> None:
        """Bring every kernel to the present."""
        for kernel in self.kernels:
            kernel.advance(self.now)

    def run(self, end: Nanos, until: str | None = None) -> str | None:
        """Run to the moment ``end``, or until a condition is true; gives why it ended before ``end``, else None."""
        self.go_on()
        watch = None
        if until is not None:
            steps = (do.Until(until), do.Stop(until))
            watch = self.start("until", lambda: do.run_through(steps))
        self.advance(end)
        if watch is not None:
            self._end(watch)
            if self._scripts[-1] is watch:
                self._scripts.pop()
        self.settle_all()
        return self.stopped

    def call_off(self, name: str) -> None:
        """What was to be done later under a name is not done."""
        for script in self._own.called(name):
            self._end(script)

    def _end(self, script: Script) -> None:
        script.ended = True
        self._agenda_of(script).remove(script)

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
            tuple(script.state() for script in self._scripts),
            tuple(self.inputs),
            self._is_settled,
            tuple(self.failures),
            tuple(self.overdue),
            self.trace.mark(),
        )

    def _description(self) -> tuple[str, int, Files]:
        return self.spec.text.source.text, self.spec.seed, self.files

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
        self.inputs, self._is_settled = list(snapshot.inputs), snapshot.is_settled
        self.failures, self.overdue = list(snapshot.failures), list(snapshot.overdue)
        self._scripts, self._own, self._guests = [], Agenda(), Agenda()
        for number, state in enumerate(snapshot.scripts):
            script = Script(number, state.name, state.make, is_outside=state.is_outside)
            self._scripts.append(script)
            script.replay(state.sent)
            script.ended = state.ended
            if state.ended:
                continue
            condition = None if state.condition is None else self.condition(state.condition)
            self._wait(script, Waiting(state.until, condition, None if state.answer is None else self.lines[state.answer]))


def _first(one: Nanos | None, other: Nanos | None) -> Nanos | None:
    return other if one is None else one if other is None else min(one, other)
