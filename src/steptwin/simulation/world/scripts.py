"""Execution of the scripts of a world."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from functools import partial
from heapq import heappop, heappush
from typing import Any, NamedTuple, TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Refusal, Runaway
from steptwin.messages import Message
from steptwin.simulation.kinds.master import Master
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.scheduler.worldsubscriber import WorldSubscriber
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.agenda import Agenda, Dependencies
from steptwin.simulation.world.inputs import FOR_SCRIPTS, ExternalInput, Refused
from steptwin.simulation.world.model import WORLD, Model
from steptwin.simulation.world.motions import motion_ends, ordered
from steptwin.simulation.world.running import PendingRequests, Script, ScriptState, ScriptWait
from steptwin.tables import complete
from steptwin.wire.pdu import REFUSED, ModbusException

MOST_STEPS_PER_INSTANT = 10_000
"""Limit of steps of scripts at one moment; more are reported as `Runaway`."""


StepResult: TypeAlias = tuple[ScriptWait | None, Any]
"""Wait of a step; if it does not wait, its result."""


class ScriptsState(NamedTuple):
    """All scripts that have not ended, and the number of scripts started so far."""

    begun: int
    scripts: tuple[ScriptState, ...]


TOO_MANY_STEPS = Message("simulation.too-many-steps", "script {name!r}: more than {most} steps at {now} ns")


class Scripts:
    """Runs scripts step by step. At one moment, scripts of the description run before external ones."""

    def __init__(
        self, model: Model, perform: Callable[[ExternalInput, str], None], apply: Callable[[ExternalInput], None]
    ) -> None:
        """``perform`` executes an action of a script of the description, which it is given by name; ``apply`` one of others."""
        self._model = model
        self._perform = perform
        self._apply = apply
        self._begun = 0
        self._scripts: dict[int, Script] = {}
        self._described: Agenda[Script] = Agenda()
        self._external: Agenda[Script] = Agenda()
        self._looking: Agenda[WorldSubscriber] = Agenda()
        self._subscribers: list[WorldSubscriber] = []
        self._dependencies = Dependencies()
        self._scheduled: dict[str, Script] = {}
        """Scheduled steps that can be cancelled, by name."""
        self.leaves_out: Callable[[str, do.Step], bool] | None = None
        """Whether a step of a script, by its name, is left out: nothing is done then, and its result is None."""
        self.refused: list[tuple[str, bytes]] = []
        """The answers with which controllers on no line refused requests of the last write."""

    def subscribe_to_schedulers(self, schedulers: Iterable[Scheduler], watch: Callable[[Scheduler], None]) -> None:
        """Call ``watch`` from now on with every scheduler that has changed."""
        self._dependencies.subscribe_to_all(schedulers, watch)

    def __iter__(self) -> Iterator[Script]:
        """The scripts that have not ended, in order of their start."""
        return iter(self._scripts.values())

    # ------------------------------------------------------------------ start and end

    def start(self, name: str, make: Callable[[], do.Steps | do.Walk], *, is_external: bool) -> Script:
        script = self._scripts[self._begun] = Script(self._begun, name, make, is_external=is_external)
        self._begun += 1
        self._wait(script, ScriptWait(self._model.now))
        return script

    def end(self, script: Script) -> None:
        """End a script: no further step is executed."""
        if self._scripts.get(script.number) is script:
            script.end()
            self._remove(script)

    def schedule(self, name: str, steps: tuple[do.Step, ...]) -> None:
        """Start steps as a script of the description; they replace steps scheduled under the same name."""
        self.unschedule(name)
        self._scheduled[name] = self.start(name, partial(do.run_through, steps), is_external=False)

    def unschedule(self, name: str) -> None:
        """Cancel the steps scheduled under a name, if any."""
        script = self._scheduled.pop(name, None)
        if script is not None:
            self.end(script)

    @property
    def scheduled(self) -> frozenset[str]:
        """Names of the scheduled steps that can still be cancelled."""
        return frozenset(self._scheduled)

    def end_described(self, is_kept: Callable[[str], bool]) -> None:
        """End the scripts of the description, and scheduled steps but for those whose names are kept."""
        model = self._model
        kept = {script for name, script in self._scheduled.items() if is_kept(name)}
        for script in [one for one in self if not one.is_external and one not in kept]:
            model.trace.add(TraceRecord(model.now, WORLD, "event", "script-ended", f"script {script.name} was ended"))
            self.end(script)
        self._scheduled = {name: script for name, script in self._scheduled.items() if script in kept}

    def _remove(self, script: Script) -> None:
        script.waiting = None
        self._agenda_of(script).remove(script)
        self._dependencies.set(script, ())
        if self._scripts.get(script.number) is script:  # a step may have restored another state
            del self._scripts[script.number]

    def _agenda_of(self, script: Script) -> Agenda[Script]:
        return self._external if script.is_external else self._described

    # ------------------------------------------------------------------ subscribers

    def subscribe(self, subscriber: WorldSubscriber) -> None:
        """Let it look from now on, after all scripts of each moment."""
        subscriber.number = min((one.number for one in self._subscribers), default=0) - 1
        self._subscribers.append(subscriber)
        self._dependencies.again(subscriber)

    def unsubscribe(self, subscriber: WorldSubscriber) -> None:
        self._subscribers.remove(subscriber)
        self._looking.remove(subscriber)
        self._dependencies.set(subscriber, ())
        self._dependencies.forget(subscriber)

    def first_look(self) -> Nanos | None:
        """The moment at which a subscriber looks next, after `first`."""
        return self._looking.first() if self._subscribers else None

    def leave(self, moment: Nanos) -> None:
        """Time goes on to ``moment``, at which nothing has happened yet."""
        for subscriber in self._subscribers:
            subscriber.leave(moment)

    def look(self) -> None:
        """Let subscribers look that are due now."""
        for subscriber in self._looking.take_watching(self._model.now):
            self._dependencies.set(subscriber, subscriber.look(self._model.now))

    # ------------------------------------------------------------------ scheduling

    def first(self) -> tuple[Nanos | None, Nanos | None, Nanos | None]:
        """The earliest due moments: of schedulers that scripts wait for, of scripts of the description, of external scripts."""
        self._renew()
        return self._dependencies.due(), self._described.first(), self._external.first()

    def advance_schedulers(self, until: Nanos) -> Nanos:
        """Advance the schedulers that are due now to their next event, which comes by ``until``, and return its moment; scripts
        that wait for what happens there become due."""
        now = self._model.now
        is_exact = any(subscriber.sources for subscriber in self._subscribers)  # each may look at every statement
        return self._dependencies.advance(now, now if is_exact else until)

    def _renew(self) -> None:
        """Update the due moments of scripts when something has changed on which they depend."""
        while changed := self._dependencies.take():
            for script in changed:
                if isinstance(script, Script):
                    self._plan(script)
                else:
                    self._looking.watch(script, self._model.now)

    def _wait(self, script: Script, waiting: ScriptWait) -> None:
        script.waiting = waiting
        if waiting.is_timed and waiting.until is not None:
            self._dependencies.set(script, ())
            self._agenda_of(script).wait(script, waiting.until)
        else:
            self._dependencies.again(script)  # once, with what its last step has changed

    def _plan(self, script: Script) -> None:
        """Schedule the evaluation of a script that waits for a condition or answers."""
        waiting, model = script.waiting, self._model
        if waiting is None:
            return
        deadlines = [waiting.until]
        if waiting.condition is None:
            sources = tuple(model.sync(asked.line).source(asked.line) for asked in waiting.asked)
            deadlines.append(model.now if self._are_answered(waiting) else None)
        else:
            condition = model.condition(waiting.condition)
            sources = condition.sync(model.now)
            deadlines.append(condition.due(model.now))
        self._dependencies.set(script, sources)
        self._agenda_of(script).watch(script, min((due for due in deadlines if due is not None), default=None))

    def _are_answered(self, waiting: ScriptWait) -> bool:
        return all(self._master(asked.line).finished >= asked.last for asked in waiting.asked)

    def _master(self, line: str) -> Master:
        return self._model.line_called(line).master

    # ------------------------------------------------------------------ execution

    def run_described(self) -> None:
        """Run the scripts of the description that are due now."""
        self._run(self._described)

    def run_external(self) -> None:
        """Run the external scripts that are due now."""
        self._run(self._external)

    def _run(self, agenda: Agenda[Script]) -> None:
        """Run scripts whose moment has come, then those with conditions, each once and in order. A script that becomes due after
        its turn runs with the next call."""
        model = self._model  # its moment changes if a step restores a snapshot
        while (timed := agenda.take_timed(model.now)) is not None:
            self._resume(timed, None)
        ready: dict[int, Script] = {}
        order: list[int] = []
        behind: list[Script] = []
        last = -1
        while True:
            self._renew()
            for script in agenda.take_watching(model.now):
                if script.number <= last:
                    behind.append(script)
                elif script.number not in ready:
                    ready[script.number] = script
                    heappush(order, script.number)
            if not order:
                break
            last = heappop(order)
            self._look(ready.pop(last))
        for script in behind:
            if script.waiting is not None:
                agenda.watch(script, model.now)

    def _look(self, script: Script) -> None:
        """Resume a watching script if its condition holds, its answer has come, or its time is over."""
        waiting, now = script.waiting, self._model.now
        if waiting is None:
            return
        if waiting.condition is not None:
            condition = self._model.condition(waiting.condition)
            condition.sync(now)
            value: Any = condition.holds(now)
            has_come = value
        else:
            has_come = self._are_answered(waiting)
            value = self._answer(waiting) if has_come else None
        if has_come or (waiting.until is not None and waiting.until <= now):
            self._report_overdue(script, waiting, has_come=has_come)
            if waiting.condition is not None and has_come and waiting.began < now:
                for subscriber in self._model.until_subscribers:
                    subscriber(script.name, waiting.condition)
            self._resume(script, value)
        else:
            self._dependencies.again(script)

    def _answer(self, waiting: ScriptWait) -> bytes | None:
        """The PDU of the answer to a `Request`; None for a `Write`."""
        if not waiting.is_request:
            return None
        (asked,) = waiting.asked
        return self._master(asked.line).answers.pop(asked.last)[1:-2]

    def _report_overdue(self, script: Script, waiting: ScriptWait, *, has_come: bool) -> None:
        """Steps of a description go on whether or not what they wait for comes; code from outside is sent that, and decides."""
        if script.is_external or waiting.is_request:
            return
        if waiting.condition is not None and not has_come:
            self._model.report_overdue(f"{script.name} waited in vain for {self._model.told(waiting.condition)}")
        for asked in waiting.asked:
            master = self._master(asked.line)
            if asked.first <= master.unanswered <= asked.last:
                self._model.report_overdue(f"{script.name} waited in vain for an answer on {asked.line}")
            number, frame = master.refused
            if asked.written and asked.first <= number <= asked.last:
                self._report_refused(script, asked.written, frame[1:])

    def _report_refused(self, script: Script, written: str, answer: bytes) -> None:
        refused = ModbusException(answer[0] & ~REFUSED, answer[1])
        self._model.report_overdue(f"{script.name} wrote {written} in vain: {refused}")

    def _resume(self, script: Script, value: Any) -> None:
        script.waiting = None
        for _ in range(MOST_STEPS_PER_INSTANT):
            step = script.send(value)
            if step is None:
                self._remove(script)
                return
            waiting, value = self._take(step, script)
            if script.ended:
                return
            if waiting is not None:
                self._wait(script, waiting)
                return
        raise Runaway(TOO_MANY_STEPS(name=script.name, most=MOST_STEPS_PER_INSTANT, now=self._model.now))

    def _take(self, step: do.Step, script: Script) -> StepResult:
        """Execute a step; returns what it waits for, or its result."""
        if self.leaves_out is not None and self.leaves_out(script.name, step):
            return None, None
        return _TAKING.get(type(step), Scripts._act)(self, step, script)

    def _act(self, step: do.Step, script: Script) -> StepResult:
        try:
            self._do(script, step)
        except Refusal as error:
            self._do(script, Refused(str(error)))
        return None, None

    def _pause(self, step: do.Wait, script: Script) -> StepResult:
        return (ScriptWait(self._model.now + step.duration) if step.duration > 0 else None), None

    def _wait_for_moment(self, step: do.At, script: Script) -> StepResult:
        return (ScriptWait(step.time) if step.time > self._model.now else None), None

    def _wait_for_condition(self, step: do.Until, script: Script) -> StepResult:
        now = self._model.now
        return ScriptWait(None if step.within is None else now + step.within, step.condition, began=now), None

    def _order(self, step: do.Order, script: Script) -> StepResult:
        try:
            found = ordered(self._model, step.command)
        except Refusal as error:
            self._do(script, Refused(str(error)))
            return None, None
        return self._take(found, script)

    def _wait_for_end(self, step: do.UntilOver, script: Script) -> StepResult:
        over = motion_ends(self._model, step.controller, step.axis).over
        now = self._model.now
        return ScriptWait(None if step.within is None else now + step.within, over, began=now), None

    def _expect_reached(self, step: do.ExpectReached, script: Script) -> StepResult:
        self._do(script, do.Expect(motion_ends(self._model, step.controller, step.axis, step.seek).reached))
        return None, None

    def _stop(self, step: do.Stop, script: Script) -> StepResult:
        model = self._model
        model.stopped = step.reason if model.stopped is None else model.stopped
        return ScriptWait(model.now + 1), None

    def _read(self, step: do.Read, script: Script) -> StepResult:
        return None, self._model.read(step.signal)

    def _call(self, step: do.Call, script: Script) -> StepResult:
        step.function()
        return None, None

    def _request(self, step: do.Request, script: Script) -> StepResult:
        master = self._master(step.line)
        number = master.asked + 1
        master.wanted |= {number}
        self._do(script, step)
        return ScriptWait(None, asked=(PendingRequests(step.line, number, number),), is_request=True), None

    def _clear_fault(self, step: do.ClearFault, script: Script) -> StepResult:
        """A script of a description may clear a fault that is not set yet, or was cleared already."""
        if script.is_external or step.name in (active.name for active in self._model.objects.faults.active):
            self._do(script, step)
        return None, None

    def _write(self, step: do.Write, script: Script) -> StepResult:
        """Write as a Modbus master: wait for the answers before the next step."""
        model = self._model
        lines = dict.fromkeys(model.objects.line_of[name][0].name for name, *_ in step.values if name in model.objects.line_of)
        before = {name: self._master(name).asked for name in lines}
        self.refused.clear()
        self._do(script, step)
        for controller, answer in () if script.is_external else self.refused:
            self._report_refused(script, _written(step, (controller,)), answer)
        on = {name: {one for one, (line, _) in model.objects.line_of.items() if line.name == name} for name in lines}
        asked = [PendingRequests(name, before[name] + 1, self._master(name).asked, _written(step, on[name])) for name in lines]
        pending = tuple(one for one in asked if self._master(one.line).finished < one.last)
        at_once = tuple(one for one in asked if one not in pending)
        self._report_overdue(script, ScriptWait(None, asked=at_once), has_come=True)
        return (ScriptWait(None, asked=pending) if pending else None), None

    def _do(self, script: Script, what: ExternalInput) -> None:
        if script.is_external:
            self._apply(what)
        else:
            self._perform(what, script.name)

    # ------------------------------------------------------------------ snapshots

    def state(self) -> ScriptsState:
        return ScriptsState(self._begun, tuple(script.state() for script in self._scripts.values()))

    def restore(self, state: ScriptsState, scheduled: Collection[str]) -> None:
        """Restore a state; the schedulers must have been restored before."""
        for script in list(self._scripts.values()):
            self.end(script)
        self._begun = state.begun
        for subscriber in self._subscribers:
            subscriber.rewind(self._model.now)
            self._dependencies.again(subscriber)
        for one in state.scripts:
            script = self._scripts[one.number] = Script.at(one)
            if one.waiting is not None:
                self._wait(script, one.waiting)
        self._scheduled = {script.name: script for script in self if script.name in scheduled and not script.is_external}


def _written(step: do.Write, controllers: Collection[str]) -> str:
    """The values that go to some of the controllers."""
    return ", ".join(f"{name}.{register} = {value:.7g}" for name, register, value in step.values if name in controllers)


_TAKING: Mapping[type, Callable[[Scripts, Any, Script], StepResult]] = complete(
    "step of scripts",
    [*(FOR_SCRIPTS - {do.Repeat}), do.Request, do.Write, do.ClearFault],
    "execution",
    {
        do.Wait: Scripts._pause,
        do.At: Scripts._wait_for_moment,
        do.Until: Scripts._wait_for_condition,
        do.Stop: Scripts._stop,
        do.Read: Scripts._read,
        do.Call: Scripts._call,
        do.Request: Scripts._request,
        do.Write: Scripts._write,
        do.ClearFault: Scripts._clear_fault,
        do.Order: Scripts._order,
        do.UntilOver: Scripts._wait_for_end,
        do.ExpectReached: Scripts._expect_reached,
    },
)
"""The execution of steps that wait, have a result, or are done otherwise than from
outside. `steptwin.simulation.script.steps.Walk` resolves `Repeat`."""
