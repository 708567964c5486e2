"""A world in real time, and the ports of its lines for other programs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple, Protocol

from steptwin.controller import Nanos
from steptwin.errors import Misuse, Refusal
from steptwin.files import recording as recordings
from steptwin.files.export.tracefile import Ring
from steptwin.files.world import World
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.sharedreads import share_reads
from steptwin.live.tracedport import traced
from steptwin.messages import Message
from steptwin.simulation.kinds.lines import SCRIPTS, LineEndPoint
from steptwin.simulation.kinds.registry import line_kinds
from steptwin.simulation.scheduler.deadlines import Deadlines
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.world.inputs import Bytes, ExternalInput, Leave, See, size_of
from steptwin.simulation.world.model import WORLD
from steptwin.simulation.world.snapshot import SimulationSnapshot
from steptwin.simulation.world.snapshotlog import SnapshotLog
from steptwin.subject.payloads import StatusPayload
from steptwin.subject.world import WorldSubject
from steptwin.tracing import is_traced
from steptwin.wire.slave import SlaveDevice

MOST_PASSED = 100
"""Stops of scripts that are passed in one advance; a script that stops once more does so for good."""
MOST_INPUTS = 200_000
MOST_INPUT_BYTES = 16 << 20
"""Size at which a recording ends, so that memory and file stay bounded."""


def announced(world: World) -> list[dict[str, object]]:
    """The announced controllers of a world: name, kind, line, present address, and the units of axes."""
    found: list[dict[str, object]] = []
    for name, controller in world.controllers.items():
        kind, on = world.kind(name), world.objects.line_of.get(name)
        where = {"line": None} if on is None else {"line": on[0].name, **kind.announced(controller, on[1])}
        axes = [{"unit": axis.unit, "pulses_per_unit": axis.pulses_per_unit} for axis in kind.datasheet(controller).axes]
        found.append({"name": name, "kind": kind.name, **where, "axes": axes})
    return found


def send_away(world: World) -> None:
    """Disconnect the clients of a recording or branch that goes on: they are not connected now."""
    for line in world.lines.values():
        for client in [client for client in line.clients if client != SCRIPTS]:
            world.apply_input(Leave(line.name, client))


class RecordedExtent(NamedTuple):
    """How much is recorded so far."""

    until: Nanos
    inputs: int
    size: int
    """Bytes of the inputs, as `MOST_INPUT_BYTES` limits them."""
    is_full: bool
    """Whether it has ended because there was no room for more."""


class ExternalActor(Protocol):
    """Acts on a world from outside at exact moments: `advance` is called when the world has reached them."""

    def deadline(self) -> Nanos | None: ...
    def advance(self, now: Nanos) -> None: ...


class RunControl(Protocol):
    """Control of a run by a debugger, which decides up to where a world may go."""

    def look_ahead(self, until: Nanos) -> tuple[Nanos, bool]:
        """The world is at the present; up to where it may go, at most to ``until``, and whether it is to stop there."""
        ...

    def resumed(self) -> None:
        """Time goes on from now."""
        ...

    def paused(self) -> None:
        """Time stands at the present, because of what `look_ahead` gave or otherwise."""
        ...

    def restored(self) -> None:
        """The world has gone back to the present moment; what was later has not happened."""
        ...


MEMORY_CANNOT_GO_BACK = Message(
    "live.memory-cannot-go-back",
    "this world keeps its memory in {place}, which cannot go back: start it without a state directory",
)
TRACE_FILE_CANNOT_GO_BACK = Message(
    "live.trace-file-cannot-go-back",
    "the trace of this world is written to a file, which cannot go back: start it without that, or with a ring",
)
AXIS_IS_JOGGED = Message("live.axis-is-jogged", "an axis is being jogged: end the jog first")
SCRIPT_ENDS_THE_RUN = Message("live.script-ends-the-run", "a script would end the run here: {reason}")
NOTHING_IS_RECORDED = Message("live.nothing-is-recorded", "this world is not recorded: start it with --session FILE")


class LiveWorld:
    """A world that a `RealTimeDriver` advances in real time."""

    def __init__(self, world: World, show: Callable[[str], None] = lambda _: None) -> None:
        self.world = world
        self.show = show
        """Called with notices for the user."""
        self._recorded_bytes = sum(size_of(given.what) for given in world.inputs)
        self._full: recordings.Recording | None = None
        self.is_dirty = True
        """Whether the deadline must be computed again, because something may have happened."""
        self._next: Nanos | None = None
        """The deadline computed last, ns."""
        self._deadlines = _Deadlines(world.schedulers)
        world.subscribe_to_schedulers(self._changed)
        self.ring: Ring | None = None
        """The ring of last records, if kept."""
        self.snapshots: SnapshotLog | None = None
        """Its past, if kept."""
        self.subject = WorldSubject(world, self.apply_input)
        self.trace_file: Path | None = None
        """Where its trace is written as it happens."""
        self.ports: set[ClientPort] = set()
        """Programs that are connected to lines."""
        self.external_actor: ExternalActor | None = None
        """``is_dirty`` is to be set when its deadline has changed."""
        self.on_stop: Callable[[], None] | None = None
        """Called when a script has stopped the world. None: that is reported, and the world goes on."""
        self.run_control: RunControl | None = None
        self.on_break: Callable[[], None] = lambda: None
        """Called where the run control has stopped the world."""

    @property
    def now(self) -> Nanos:
        return self.world.now

    def share_reads(self, realtime: RealTimeDriver) -> None:
        """Let clients that ``realtime`` serves at one moment share their reads."""
        for line in self.world.lines.values():
            names = {unit: name for name, (on, unit) in self.world.objects.line_of.items() if on is line}

            def served(devices: Mapping[int, SlaveDevice], names: Mapping[int, str] = names) -> Mapping[int, SlaveDevice]:
                return share_reads(traced(devices, names) if is_traced() else devices, realtime)

            line.serve_by(served)

    # ------------------------------------------------------------------ what comes from outside

    def apply_input(self, what: ExternalInput) -> None:
        """Apply an input at the present moment; it is recorded if the world is. Raises `Misuse`."""
        self.make_room(what)
        self.world.apply_input(what)

    def make_room(self, what: ExternalInput) -> None:
        """End the recording if it has no room for one more input."""
        world = self.world
        if world.keeps_inputs:
            if len(world.inputs) >= MOST_INPUTS or self._recorded_bytes >= MOST_INPUT_BYTES:
                self._end_recording()
            else:
                self._recorded_bytes += size_of(what)

    def _end_recording(self) -> None:
        world = self.world
        self._full = recordings.recording_of(world)
        world.keeps_inputs = False
        world.inputs.clear()
        self.show(f"the recording is full and ends at {world.time:g} s, after {len(self._full.inputs)} inputs")

    def go_back(self, snapshot: SimulationSnapshot, name: str | None) -> None:
        """Go back to a state, under its name where it has one.

        Programs stay connected to their lines; what was under way there, at either moment, is lost.

        Raises `Refusal` where not everything can go back.
        """
        world = self.world
        if world.state is not None:
            raise Refusal(MEMORY_CANNOT_GO_BACK(place=world.state))
        if self.trace_file is not None:
            raise Refusal(TRACE_FILE_CANNOT_GO_BACK())
        if self.external_actor is not None and self.external_actor.deadline() is not None:
            raise Refusal(AXIS_IS_JOGGED())
        self.subject.go_back(snapshot, name)
        self._recorded_bytes = sum(size_of(given.what) for given in world.inputs)
        self._deadlines = _Deadlines(world.schedulers)
        if self.ring is not None:
            self.ring.clear()
        for line in world.spec.lines:
            links = {link.client for link in line_kinds()[line.kind].opened_by.values()}
            for client in [client for client in world.lines[line.name].clients if client.partition("-")[0] in links]:
                self.apply_input(Leave(line.name, client))
        for port in list(self.ports):
            port.join()
        if self.snapshots is not None:
            self.snapshots.gone_back()
        if self.run_control is not None:
            self.run_control.restored()
        self.is_dirty = True

    def recording(self) -> recordings.Recording:
        """The recording up to now, or to the moment at which it was full. Raises `Misuse` if there is none."""
        if self._full is not None:
            return self._full
        if not self.world.keeps_inputs:
            raise Misuse(NOTHING_IS_RECORDED())
        return recordings.recording_of(self.world)

    @property
    def recorded(self) -> RecordedExtent | None:
        """How much is recorded so far; None if nothing is."""
        if self._full is not None:
            return RecordedExtent(self._full.until, len(self._full.inputs), self._recorded_bytes, is_full=True)
        if not self.world.keeps_inputs:
            return None
        return RecordedExtent(self.now, len(self.world.inputs), self._recorded_bytes, is_full=False)

    # ------------------------------------------------------------------ time

    def _changed(self, scheduler: Scheduler) -> None:
        self.is_dirty = True
        self._deadlines.changed[scheduler] = None

    def advance(self, now: Nanos) -> None:
        world = self.world
        if self.run_control is not None:
            self._advance_controlled(self.run_control, now)
        elif not self.is_dirty and (self._next is None or now < self._next) and world.stopped is None and now >= world.now:
            world.now, world.is_settled = now, True  # as `Simulation.advance` where nothing is due
        else:
            self._advance(now)

    def _advance_controlled(self, control: RunControl, now: Nanos) -> None:
        """Advance in parts, between which the external actor acts: the run control cannot foresee that."""
        while True:
            acts = None if self.external_actor is None else self.external_actor.deadline()
            part = now if acts is None else min(now, max(acts, self.now + 1))
            free, stops = control.look_ahead(part)
            self._advance(free)
            if stops:
                self.on_break()
                control.paused()
                return
            if part == now or self.world.stopped is not None:
                return

    def _advance(self, now: Nanos) -> None:
        world, passed = self.world, 0
        while True:
            while (due := self._due()) is not None and due <= now:
                world.advance(due)
                if world.stopped is not None:
                    break
                self._deadlines.advance(due)
                if self.external_actor is not None:
                    self.external_actor.advance(due)
            self.is_dirty = True
            world.advance(now)
            if world.stopped is None:
                return
            if self.on_stop is not None:
                self.on_stop()
                return
            if passed == MOST_PASSED:
                return
            passed += 1
            self._pass_stop(world.stopped)

    def _pass_stop(self, reason: str) -> None:
        """Report it without a record: a replay goes on as well."""
        text = SCRIPT_ENDS_THE_RUN(reason=reason)
        self.show(text)
        self.subject.publish(self.now, WORLD, StatusPayload("script-stop", text))
        self.world.go_on()

    def deadline(self) -> Nanos | None:
        self._next = self._due()
        self.is_dirty = False
        return self._next

    def _due(self) -> Nanos | None:
        if self.world.stopped is not None:
            return None
        due, own = self._deadlines.first(), self.world.next()
        due = due if own is None else own if due is None else min(due, own)
        other = None if self.external_actor is None else self.external_actor.deadline()
        return due if other is None else max(other, self.now) if due is None else min(due, max(other, self.now))


class _Deadlines:
    """The next deadline of many schedulers, kept without a scan of all of them.

    ``changed``: schedulers in which something has happened since.
    """

    def __init__(self, schedulers: list[Scheduler]) -> None:
        self.changed = dict.fromkeys(schedulers)
        self._schedulers = schedulers
        self._number_of = {scheduler: number for number, scheduler in enumerate(schedulers)}
        self._deadlines = Deadlines()

    def first(self) -> Nanos | None:
        while self.changed:
            scheduler, _ = self.changed.popitem()
            due = scheduler.deadline()  # signals may settle: it has changed again then
            self._deadlines.put(self._number_of[scheduler], due)
        return self._deadlines.first()

    def advance(self, now: Nanos) -> None:
        """Advance the schedulers with deadlines up to ``now``, in order."""
        while (due := self.first()) is not None and due <= now:
            for number in self._deadlines.take(due):
                scheduler = self._schedulers[number]
                scheduler.advance(now)
                self.changed[scheduler] = None


class VisionPort:
    """A connection of a vision system; its records are inputs of the world."""

    broken = None

    def __init__(self, live: LiveWorld, controller: str) -> None:
        self._live = live
        self._controller = controller
        self._records = live.world.vision(controller).records()

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        for record in self._records(data):
            self._live.apply_input(See(self._controller, *record))
            self._live.is_dirty = True
        return b""

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        return []

    def deadline(self) -> Nanos | None:
        return None

    def close(self) -> None:
        """Nothing is kept of it."""


class ClientPort:
    """A port of a line for another program, which uses the line directly."""

    def __init__(self, live: LiveWorld, line: str, client: str, kind: str) -> None:
        world = live.world
        self.line = line
        self._live = live
        self._world = world
        self._line = world.lines[line]
        self._scheduler = world.objects.scheduler_of[line]
        self._clients = self._line.clients
        self._name = client
        self._kind = kind
        self.broken: str | None = None
        self.on_output: Callable[[], None] | None = None
        live.ports.add(self)
        self.join()

    def join(self) -> None:
        """Where a line is shared it receives what others are sent, from now on."""
        if self._line.is_shared:
            self._live.apply_input(Bytes(self._line.name, self._name, self._kind, b""))
            self._live.is_dirty = True
            self._connected()

    def used_by(self, source: str) -> None:
        """See `steptwin.controller.SourcedPort`."""
        self._live.subject.sources[self.line, self._name] = source

    def _connected(self) -> LineEndPoint:
        client = self._line.connect(self._name, self._kind)
        client.on_output = self._came
        return client

    def _came(self) -> None:
        if self.on_output is not None:
            self.on_output()

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        world, scheduler = self._world, self._scheduler
        now = world.now  # a world that was stopped stands
        if scheduler.now != now or scheduler.is_dirty:
            scheduler.advance(now)
        client = self._clients.get(self._name)
        if client is None or client.on_output is None:
            client = self._connected()
        if world.records_inputs or world.trace.is_recorded:
            answer = self._recorded(client, data, now)
        else:
            answer = self._line.exchange(self._name, client, data, now)
        if scheduler.is_dirty or client.received:
            answer = self._with_the_rest(client, answer, now)
        self.broken = client.inner.broken
        return answer

    def _recorded(self, client: LineEndPoint, data: bytes, now: Nanos) -> bytes:
        """An exchange that is recorded in recording and trace, unless it changes nothing."""
        world, line = self._live.world, self._line
        if line.is_idle_read(client, data):
            return line.exchange_unrecorded(self._name, client, data, now)
        given = Bytes(line.name, self._name, self._kind, data)
        if world.keeps_inputs:
            self._live.make_room(given)
        answer = line.exchange(self._name, client, data, now)
        world.record_input(given)
        return answer

    def _with_the_rest(self, client: LineEndPoint, answer: bytes, now: Nanos) -> bytes:
        """The answer between what came before and what has come with it."""
        before = client.take(now) if client.received else []
        client.on_output = None  # what comes at once is given back at once
        if self._scheduler.is_dirty:
            self._scheduler.propagate()
        client.on_output = self._came
        if not before and not client.received:
            return answer
        return b"".join([*(piece for _, piece in before), answer, *(piece for _, piece in client.take(now))])

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        now = self._live.world.now
        self._scheduler.advance(now)
        client = self._clients.get(self._name)
        return [] if client is None else client.take(now)

    def deadline(self) -> Nanos | None:
        """Nothing to be asked for: ``on_output`` is called when there is something."""
        return None

    def close(self) -> None:
        self._live.ports.discard(self)
        self._live.subject.sources.pop((self.line, self._name), None)
        self._live.apply_input(Leave(self._line.name, self._name))
