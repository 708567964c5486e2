"""A running world: its schedulers, each advanced on demand, and its scripts.

Controllers without a connection are in separate schedulers. A scheduler is advanced to the present before it is read or changed;
the schedulers that a condition depends on are advanced event by event. The result therefore does not depend on the order in which
schedulers are advanced.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial

from steptwin.controller import Nanos
from steptwin.errors import Misuse, Runaway, TimeReversal
from steptwin.messages import Message
from steptwin.simulation.describe.blueprint import Blueprint, FileContents
from steptwin.simulation.describe.build import Keep
from steptwin.simulation.describe.overrides import Overrides
from steptwin.simulation.describe.spec import ScriptSpec
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.worldsubscriber import WorldSubscriber
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.actions import prepare
from steptwin.simulation.world.boundedlog import BoundedLog
from steptwin.simulation.world.inputs import MOST_ACTS, NO_ACTS, ExternalInput, PastAct
from steptwin.simulation.world.model import Model
from steptwin.simulation.world.references import check_faults, check_scripts
from steptwin.simulation.world.running import Script
from steptwin.simulation.world.scripts import MOST_STEPS_PER_INSTANT, Scripts
from steptwin.simulation.world.snapshot import RecordedInput, SimulationSnapshot

SNAPSHOT_OF_ANOTHER_WORLD = Message("simulation.snapshot-of-another-world", "the snapshot is of another world")
SCRIPTS_LOOP = Message("simulation.scripts-loop", "scripts loop without end at {now} ns")


class Simulation(Model):
    """A world, independent of files and clocks."""

    def __init__(
        self,
        blueprint: Blueprint,
        *,
        keep_trace: bool = True,
        keep_inputs: bool = True,
        keep_memory: Keep | None = None,
        at: SimulationSnapshot | None = None,
    ) -> None:
        """The world of a description at time 0, or ``at`` a snapshot of one with the same description."""
        super().__init__(blueprint, keep_trace=keep_trace, keep_memory=keep_memory, is_blank=at is not None)
        spec = self.spec
        self.keeps_inputs = keep_inputs
        """Whether external inputs are kept, as a recording needs; off for worlds that run for weeks, where memory would fill
        up."""
        self.inputs: list[RecordedInput] = []
        """All external inputs so far, if they are kept."""
        self.input_subscribers: list[Callable[[RecordedInput], None]] = []
        """Called with everything from outside as it comes."""
        self.act_subscribers: list[Callable[[str, ExternalInput], None]] = []
        """Called before each action at the present moment, with the script that does it; empty: what comes from outside."""
        self.acts: deque[PastAct] = deque(maxlen=MOST_ACTS)
        """The last actions of scripts and from outside, without `NO_ACTS`."""
        self.is_settled = False
        """Whether the scripts of the description have run since the last external input."""
        self._scripts = Scripts(self, self.perform, self.apply_input)
        if at is None:
            check_faults(self, spec.faults)
        if not blueprint.memo.is_checked:
            check_scripts(self, spec.scripts)
        spec.text.check()
        blueprint.memo.is_checked = True
        if at is not None:
            self.restore(at)
            return
        for line in spec.scripts:
            self._begin(line)

    # ------------------------------------------------------------------ what is in it

    @property
    def scripts(self) -> list[Script]:
        """The scripts that have not ended: those of the description, then those started later, in order."""
        return list(self._scripts)

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

    def leave_out(self, leaves_out: Callable[[str, do.Step], bool]) -> None:
        """Leave out the steps of scripts, each with the name of its script, for which this is true."""
        self._scripts.leaves_out = leaves_out

    def subscribe(self, subscriber: WorldSubscriber) -> None:
        """Call it from now on, until `unsubscribe`."""
        self._scripts.subscribe(subscriber)

    def unsubscribe(self, subscriber: WorldSubscriber) -> None:
        self._scripts.unsubscribe(subscriber)

    def start(self, name: str, make: Callable[[], do.Steps | do.Walk], *, is_external: bool = False) -> Script:
        """Start a script now. ``make`` creates its steps; it is called again when a snapshot is restored."""
        return self._scripts.start(name, make, is_external=is_external)

    # ------------------------------------------------------------------ external inputs

    def apply_input(self, what: ExternalInput) -> None:
        """Apply an external input at the present moment and record it for replay. If it raises `Misuse`, nothing has changed."""
        self.perform(what)
        self.record_input(what)

    @property
    def records_inputs(self) -> bool:
        """Whether anything wants to know of what comes from outside."""
        return self.keeps_inputs or bool(self.input_subscribers)

    def record_input(self, what: ExternalInput) -> None:
        """Keep what was done from outside at the present moment, where inputs are kept, and call subscribers."""
        if self.records_inputs:
            given = RecordedInput(self.now, what, self.is_settled)
            if self.keeps_inputs:
                self.inputs.append(given)
            for subscriber in self.input_subscribers:
                subscriber(given)
        self.is_settled = False

    def perform(self, what: ExternalInput, by: str = "") -> None:
        """Execute a step at the present moment; ``by``: its script. Raises as `prepare`; nothing has changed then."""
        action = prepare(self, what)
        for subscriber in self.act_subscribers:
            subscriber(by, what)
        action(self._scripts)
        if not isinstance(what, NO_ACTS):
            self.acts.append(PastAct(self.now, by, what))

    # ------------------------------------------------------------------ time

    def next(self) -> Nanos | None:
        """The time of the next event of a script; None if there is none."""
        return _first(_first(*self._scripts.first()), self._scripts.first_look(), None)

    def advance(self, now: Nanos) -> None:
        """Advance the scripts, and the schedulers they depend on, to ``now``, or to the moment at which a script stops the run.

        All events of that moment are processed, so that the result depends on the duration of a run only.
        """
        if now < self.now:
            raise TimeReversal(self.now, now)
        rounds, at = 0, -1
        while True:
            schedulers, own, guests = self._scripts.first()
            due = _first(schedulers, own, guests)
            look = self._scripts.first_look()
            if look is not None and (due is None or look < due):
                due = look
            end = now if self.stopped is None else self.now
            if due is None or due > end:
                break
            if due > self.now:
                self._scripts.leave(due)
                self.now = due
            rounds, at = (rounds + 1, at) if self.now == at else (0, self.now)
            if rounds > MOST_STEPS_PER_INSTANT:
                raise Runaway(SCRIPTS_LOOP(now=self.now))
            if schedulers is not None and schedulers <= self.now:
                others = [moment - 1 for moment in (own, guests, look) if moment is not None]
                self.now = self._scripts.advance_schedulers(min((end, *others)))
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

    def subscribe_to_schedulers(self, watch: Callable[[Scheduler], None]) -> None:
        """Call ``watch`` from now on with every scheduler that has changed, as `Scheduler.on_change`."""
        self._scripts.subscribe_to_schedulers(self.schedulers, watch)

    def stop_recording(self) -> None:
        """Record nothing from now on: no trace, digest or recording. Subscribers of the trace are called, but not with frames."""
        self.keeps_inputs = False
        self.inputs.clear()
        self.trace.stop()
        for line in self.lines.values():
            line.stop_recording()

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
        self.sync_all()
        return self.stopped

    def go_on(self) -> None:
        """Let a stopped world continue."""
        self.stopped = None

    # ------------------------------------------------------------------ snapshots

    def snapshot(self, *, with_inputs: bool = True) -> SimulationSnapshot:
        """Everything at the present moment, ``with_inputs`` also what came from outside before, where it is kept."""
        self.sync_all()
        return SimulationSnapshot(
            self._description(),
            self.now,
            tuple(scheduler.snapshot() for scheduler in self.schedulers),
            tuple((active.fault, active.name, active.since) for active in self.objects.faults.active),
            tuple(self.objects.faults.controllers),
            self.objects.faults.copy_state(),
            self._scripts.state(),
            tuple(self.acts),
            tuple(self.inputs) if with_inputs else (),
            self.is_settled,
            self.failures.state(),
            self.overdue.state(),
            self.trace.mark(),
            self._scripts.scheduled,
            tuple(self.downloaded.items()),
        )

    def _description(self) -> tuple[str, int, Overrides, FileContents]:
        return self.spec.text.source.text, self.spec.seed, self.spec.overrides, self.files

    def restore(self, snapshot: SimulationSnapshot) -> None:
        """Continue from a snapshot of this world, or of one with the same description.


        Raises `Misuse` for a snapshot of another world.
        """
        if snapshot.description != self._description():
            raise Misuse(SNAPSHOT_OF_ANOTHER_WORLD())
        self.now = snapshot.now
        self.stopped = None
        self.trace.rewind(snapshot.trace)
        self.fault_setup.put_back(snapshot.faults, snapshot.prepared, snapshot.faults_state)
        for scheduler, state in zip(self.schedulers, snapshot.schedulers, strict=True):
            scheduler.restore(state)
        self.acts = deque(snapshot.acts, MOST_ACTS)
        self.inputs, self.is_settled = list(snapshot.inputs), snapshot.is_settled
        self.failures, self.overdue = BoundedLog(snapshot.failures), BoundedLog(snapshot.overdue)
        self.downloaded.clear()
        self.downloaded.update(snapshot.downloaded)
        self._conditions.clear()
        self._scripts.restore(snapshot.scripts, snapshot.scheduled)


def _first(one: Nanos | None, other: Nanos | None, third: Nanos | None) -> Nanos | None:
    due = other if one is None or (other is not None and other < one) else one
    return third if due is None or (third is not None and third < due) else due
