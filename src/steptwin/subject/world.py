"""A world in this process as a subject."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import isfinite
from typing import Any, get_args

from steptwin.controller import Nanos
from steptwin.errors import Refusal
from steptwin.jsonvalues import to_json
from steptwin.messages import Message
from steptwin.simulation.components.registry import failing
from steptwin.simulation.faults.kinds import rows
from steptwin.simulation.kinds.lines import LineWrite, TrafficLog
from steptwin.simulation.kinds.programs import StatementSubscription
from steptwin.simulation.kinds.registry import line_kinds
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.script import steps
from steptwin.simulation.script.command import declared
from steptwin.simulation.script.control import ControllerCommand, Halt, Jog, StopAxes, ended, standstill
from steptwin.simulation.script.deadmanjog import DeadManJog
from steptwin.simulation.world.inputs import Download, EndScripts, ExternalInput, See
from steptwin.simulation.world.model import WORLD
from steptwin.simulation.world.motions import ordered
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshot import SimulationSnapshot
from steptwin.subject import commands as command
from steptwin.subject.contract import UNKNOWN, Description, Reading, Result
from steptwin.subject.describe import describe, workpiece_states
from steptwin.subject.dispatch import Action, Dispatcher
from steptwin.subject.events import Event, Numbering, payload_of
from steptwin.subject.payloads import FramePayload, InputPayload, PacePayload, Payload, PlanPayload, RestoredPayload, WritePayload
from steptwin.subject.scene import WorkpieceState
from steptwin.subject.snapshots import Snapshots
from steptwin.subject.standing import Standing, StandingState
from steptwin.subject.subscriptions import Filter, Subscription, Subscriptions, filter_of
from steptwin.subject.time import advance
from steptwin.wire.frameline import FrameLine
from steptwin.wire.rtu import BROADCAST

STEPS = (
    steps.Set, steps.Press, steps.Release, steps.Put, steps.Remove, steps.Send, steps.PowerCycle, steps.Turn, steps.Couple,
    steps.ClearFault, steps.Note, See, Download,
)  # fmt: skip
"""Commands that are steps themselves, without a result."""


LOOKS = frozenset({command.ReadPoints, command.ReadState, command.Encoders, command.Describe})
"""Commands that change nothing, and bring to the present what they read."""


CANNOT_DO = Message("subject.cannot-do", "{name!r} is {kind}, which cannot do {command}; it can do {known}")


class WorldSubject:
    """The world ``world``; ``apply_input`` applies an external input to it at its present moment."""

    def __init__(self, world: Simulation, apply_input: Callable[[ExternalInput], None] | None = None) -> None:
        self.world = world
        self.description: Description = describe(world)
        self._apply_input = apply_input or world.apply_input
        lines = {name: line.name for name, (line, _) in world.objects.line_of.items()}
        self.numbering = Numbering(lines)
        self.subscribers = Subscriptions(self._subscribed)
        self.on_subscribed: Callable[[], None] = lambda: None
        """Called when other kinds of events are subscribed to than before."""
        self.snapshots = Snapshots()
        self._bodies: object = None
        self._workpieces: Sequence[WorkpieceState] = ()
        """Those of these bodies."""
        self.dispatcher = Dispatcher(self._actions(), self._begin, self._end)
        self.sources: dict[tuple[str, str], str] = {}
        """Who a client of a line is, for writes; a client that is not named here stands for itself."""
        self._standing: Standing | None = None
        self._traffic: dict[str, TrafficLog] = {}
        self._writes: list[Callable[[], None]] = []
        """Functions that end the observation of writes; empty while nobody subscribes to them."""
        self._controller_of = {(line.name, unit): name for name, (line, unit) in world.objects.line_of.items()}
        self._is_watching = False
        self._statements: StatementSubscription | None = None
        self._jogs: list[tuple[Jog, DeadManJog]] = []
        """Those that have not ended."""

    def _actions(self) -> dict[Any, Action]:
        taken: dict[Any, Action] = dict.fromkeys(STEPS, self._step)
        control: dict[Any, Action] = dict.fromkeys(get_args(ControllerCommand), self._control)
        return {
            **taken,
            **control,
            command.StopAxes: self._stop,
            command.StopAll: lambda _: self._stop_all(),
            steps.Write: self._write,
            steps.Request: self._request,
            steps.SetFault: self._set_fault,
            steps.Expect: self._expect,
            command.Describe: lambda _: self.description.to_json(),
            command.ReadPoints: lambda wanted: [reading._asdict() for reading in self.read(*wanted.points)],
            command.ReadPins: self._pins,
            command.ReadState: self._state,
            command.Encoders: self._encoders,
            command.ListFaults: lambda _: self._faults(),
            command.ListFaultKinds: lambda _: [{**kind.to_json(), "elements": list(failing(kind))} for kind in rows()],
            command.Time: lambda _: self.time(),
            command.TakeSnapshot: lambda wanted: self.snapshots.add(wanted, self.world.snapshot()),
            command.ListSnapshots: lambda _: self.snapshots.to_json(),
            command.RestoreSnapshot: self._restore,
            command.DropSnapshot: self.snapshots.drop,
            command.Advance: self._advance,
        }

    # ------------------------------------------------------------------ interface of a subject

    def read(self, *points: str) -> tuple[Reading, ...]:
        return tuple(map(self._reading, points))

    def _reading(self, point: str) -> Reading:
        signal = self.world.signal(point)
        if not signal.is_readable:
            return Reading(point, None, signal.unit, UNKNOWN)
        value = self.world.read(point)
        return Reading(point, value, signal.unit) if isfinite(value) else Reading(point, None, signal.unit, UNKNOWN)

    def do(self, wanted: command.Command) -> Result:
        if type(wanted) in LOOKS:
            return self._look(wanted)
        return self.dispatcher.do(wanted)

    def _look(self, wanted: command.Command) -> Result:
        """Nothing follows from looking at a controller, so the others need not be at the present: there may be a thousand."""
        value = self.dispatcher.look(wanted)
        return Result(value, self.world.now, self.numbering.look())

    async def answer(self, wanted: command.Command) -> Result:
        return self.do(wanted)

    def subscribe(self, what: Filter, bound: int) -> Subscription:
        return self.subscribers.subscribe(what, bound)

    # ------------------------------------------------------------------ commands

    def _begin(self) -> int:
        """Process all due events first, so that the command is not their cause."""
        if self.subscribers.all:
            self.world.sync_all()
        return self.numbering.command(self.world.now)

    def _end(self) -> Nanos:
        """Process its effects at the same moment, so that the command is their cause."""
        if self.subscribers.all:
            self.world.sync_all()
        self.numbering.done()
        return self.world.now

    def _step(self, step: ExternalInput) -> None:
        self._apply_input(step)

    def _write(self, step: steps.Write) -> None:
        requests = self.world.requests(step, is_command=True)  # before it is done, which may change DATA_TYPE
        self._apply_input(step)
        for name, pdus in requests:
            for pdu in pdus:
                self._publish_stops(name, pdu)

    def _publish_stops(self, name: str, pdu: bytes) -> None:
        """A write that ends motions is a stop (docs/stopping.md)."""
        registers = self.world.kind(name).registers
        if registers is not None:
            for halt in ended(name, registers.ended_by(self.world.controller(name), pdu)):
                self.publish(self.world.now, name, InputPayload("stop", halt.scope))

    def _control(self, wanted: ControllerCommand) -> None:
        """Execute a command for a controller as its master does."""
        world, name = self.world, wanted.controller
        kind = world.kind(name)
        if type(wanted) not in kind.commands:
            known = ", ".join(declared(one).name for one in kind.commands)
            raise Refusal(CANNOT_DO(name=name, kind=kind.title, command=command.type_of(wanted).name, known=known))
        step = ordered(world, wanted)
        self._apply_input(step)
        if isinstance(step, Halt):
            self._cut_jogs(step)

    def _cut_jogs(self, halt: Halt) -> None:
        """A stop ends the dead-man jogs of its axis, whoever holds them; that of a controller or of its program all of it.
        They may be between two of their motions, where there was nothing to stop."""
        self._jogs = [(wanted, jog) for wanted, jog in self._jogs if jog.over is None]
        for wanted, jog in self._jogs:
            if wanted.controller == halt.controller and halt.axis in (None, wanted.axis):
                jog.cut()

    def _stop(self, wanted: StopAxes) -> object:
        self._control(wanted)
        state = self.world.state_of(wanted.controller)
        return {"program": None if state.program.state is None else state.program.state.value}

    def _stop_all(self) -> object:
        """Scripts first, so that nothing begins behind the stops; axes again after the program, which may have begun a motion."""
        world = self.world
        before = {script.name for script in world.scripts}
        self._apply_input(EndScripts())
        for name in world.controllers:
            for halt in standstill(name, world.kind(name).datasheet(world.controller(name)).program_actions):
                self._apply_input(halt)
                self._cut_jogs(halt)
        return {"controllers": list(world.controllers), "scripts": sorted(before - {script.name for script in world.scripts})}

    def dead_man_jog(self, wanted: Jog) -> DeadManJog:
        """A jog that lasts only while it is extended; it has not started yet. Raises `Misuse` and `Refusal`."""
        world, name = self.world, wanted.controller
        kind, controller = world.kind(name), world.controller(name)
        world.sync(name)
        on = world.objects.line_of.get(name)
        held = kind.dead_man_jog(controller, None if on is None else on[0].name, wanted)
        self._jogs = [(one, jog) for one, jog in self._jogs if jog.over is None] + [(wanted, held)]
        return held

    def _request(self, step: steps.Request) -> object:
        master = self.world.line_called(step.line).master
        number = master.asked + 1
        master.wanted |= {number}
        try:
            self._apply_input(step)
        finally:
            master.wanted -= {number}
        controllers = self._controller_of
        units = [unit for line, unit in controllers if line == step.line] if step.unit == BROADCAST else [step.unit]
        for name in (controllers[step.line, unit] for unit in units if (step.line, unit) in controllers):
            self._publish_stops(name, step.pdu)
        found = master.answers.pop(number, None)
        return {"pdu": found[1:-2].hex() if found else None}

    def _set_fault(self, step: steps.SetFault) -> object:
        self._apply_input(step)
        return {"name": self.world.objects.faults.active[-1].name}

    def _expect(self, step: steps.Expect) -> object:
        before = len(self.world.failures)
        self._apply_input(step)
        return {"holds": len(self.world.failures) == before}

    def _pins(self, wanted: command.ReadPins) -> object:
        world = self.world
        names = list(world.controllers) if wanted.controller is None else [wanted.controller]
        return {f"{name}.{pin}": level for name in names for pin, level in self._levels(name).items()}

    def _levels(self, name: str) -> Mapping[str, float]:
        controller = self.world.controller(name)
        self.world.sync(name)
        levels = self.world.kind(name).state.pins(controller, self.world.now)
        failing = self.world.objects.faults.controllers.get(name)
        return levels if failing is None else {**levels, **{pin: held.level for pin, held in failing.held()}}

    def _state(self, wanted: command.ReadState) -> object:
        if wanted.parts is not None:
            return self.world.parts_of(wanted.controller, wanted.parts)
        return to_json(self.world.state_of(wanted.controller))

    def _encoders(self, wanted: command.Encoders) -> object:
        encoders = self.world.encoders(wanted.controller)
        self.world.sync(wanted.controller)
        return encoders.to_json(self.world.controller(wanted.controller), self.world.now)

    def _advance(self, wanted: command.Advance) -> object:
        done = advance(self.world, self.subscribe, wanted)
        return {**self.time(), **done}

    def _restore(self, wanted: command.RestoreSnapshot) -> object:
        self.go_back(self.snapshots.find(wanted), wanted.name)
        return self.time()

    def go_back(self, snapshot: SimulationSnapshot, name: str | None) -> None:
        """Restore a snapshot, with its name if it has one, and notify subscribers."""
        self.world.restore(snapshot)
        self.numbering.moved(self.world.now)
        if self._standing is not None:
            self._standing.went_back()
        self.publish(self.world.now, WORLD, RestoredPayload(name))
        for plan in self.plans(filter_of(["plan"])):
            self.publish(plan.time, plan.controller, plan.payload)

    def _faults(self) -> object:
        faults = self.world.objects.faults
        return [
            {
                "name": a.name,
                "fault": str(a.fault),
                "seen": a.seen,
                "acted": faults.acts[a.name].count if a.name in faults.acts else 0,
            }
            for a in faults.active
        ]

    def time(self) -> dict[str, object]:
        """The present moment; a world in virtual time is paused unless it is advanced."""
        now = self.world.now
        return {
            "world": self.world.spec.name,
            "time_ns": str(now),
            "time_s": now / 1e9,
            "paused": True,
            "speed": None,
            "stopped": self.world.stopped,
        }

    # ------------------------------------------------------------------ events

    def plans(self, what: Filter) -> list[Event]:
        """The present plan of every axis that ``what`` selects, as events of now."""
        world = self.world
        found: list[Event] = []
        for part in self.description.controllers:
            world.sync(part.name)
            for axis, drive in zip(part.datasheet.axes, world.controllers[part.name].axes, strict=True):
                event = Event(0, world.now, part.name, PlanPayload(str(axis.number), drive.plan, drive.offset_p))
                if what.wants(event):
                    found.append(event)
        return found

    def workpieces(self) -> Sequence[WorkpieceState]:
        """Those in space: the same object while none comes or goes, and none is carried by something else."""
        bodies = self.world.objects.workpieces.bodies()
        if bodies is not self._bodies:
            self._bodies, self._workpieces = bodies, tuple(workpiece_states(self.world))
        return self._workpieces

    def standing(self) -> Sequence[StandingState]:
        """Things that stand now. The moments since when are known from the first call on, and those of programs always."""
        if self._standing is None:
            self._standing = Standing(self.world)
        return tuple(self._standing.states())

    def paced(self, pace: PacePayload) -> None:
        """Report that time was paused or resumed."""
        self.publish(self.world.now, WORLD, pace)

    def publish(self, time: Nanos, controller: str, payload: Payload) -> None:
        if self.subscribers.all:
            self.subscribers.publish(self.numbering.event(time, controller, payload))

    def _recorded(self, record: TraceRecord) -> None:
        if record.kind == "frame":  # lines report frames themselves, recorded or not
            return
        if self._traffic:
            line, _ = self.world.objects.line_of.get(record.controller, (None, 0))
            if line is not None:
                self._traffic[line.name].recorded(record)
        payload = payload_of(record)
        if isinstance(payload, PlanPayload):
            payload = self._with_origin(record.controller, payload)
        self.publish(record.time, record.controller, payload)

    def _executed(self, record: TraceRecord) -> None:
        self.publish(record.time, record.controller, payload_of(record))

    def _with_origin(self, controller: str, payload: PlanPayload) -> PlanPayload:
        drive = self.world.controllers[controller].axes[int(payload.axis) - 1]
        return PlanPayload(payload.axis, payload.plan, drive.offset_p)

    def _subscribed(self) -> None:
        """Subscribe to the world only while it has subscribers, to frames and statements only while they are wanted."""
        self.on_subscribed()
        watchers = self.world.trace.subscribers
        if bool(self.subscribers.all) is not self._is_watching:
            self._is_watching = not self._is_watching
            if self._is_watching:
                watchers.append(self._recorded)
            else:
                watchers.remove(self._recorded)
        if ("statement" in self.subscribers.kinds) is not (self._statements is not None):
            if self._statements is None:
                self._statements = StatementSubscription(self.world.programs, self._executed)
            else:
                self._statements.close()
                self._statements = None
        self._subscribe_to_writes(is_wanted="write" in self.subscribers.kinds)
        wanted = "frame" in self.subscribers.kinds
        if wanted is bool(self._traffic):
            return
        for spec in self.world.spec.lines:
            line = self.world.lines[spec.name]
            if wanted:
                self._traffic[line.name] = line_kinds()[spec.kind].traffic_log(line, "", partial(self._framed, line.name))
                line.subscribe_to_frames(self._traffic[line.name])
            else:
                line.unsubscribe_from_frames(self._traffic.pop(line.name))

    def _subscribe_to_writes(self, *, is_wanted: bool) -> None:
        if is_wanted is bool(self._writes):
            return
        for end in self._writes:
            end()
        self._writes.clear()
        for spec in self.world.spec.lines if is_wanted else ():
            end = line_kinds()[spec.kind].writes(self.world.lines[spec.name], partial(self._written, spec.name))
            if end is not None:
                self._writes.append(end)

    def _written(self, line: str, seen: LineWrite) -> None:
        controllers = [self._controller_of[line, unit] for unit in seen.units]
        source = self.sources.get((line, seen.client), seen.client)
        payload = WritePayload(seen.client, source, seen.words, seen.outcome)
        self.publish(seen.time, controllers[0] if len(controllers) == 1 else line, payload)

    def _framed(self, line: str, frame: FrameLine) -> None:
        self.publish(frame.time, line, FramePayload(frame.link, frame.direction.value, frame.raw, frame.meaning))
