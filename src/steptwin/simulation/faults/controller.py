"""Faults of physics: pins, shafts, supply and memory of a controller; and requests that it refuses."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Any, ClassVar, NamedTuple, Protocol

from steptwin.controller import Nanos, PinEdge
from steptwin.errors import Misuse
from steptwin.messages import Message, text_of
from steptwin.motion.divisions import profile_of
from steptwin.motioncontroller import Drive, MotionController
from steptwin.simulation.faults.active import ActiveFault, Faults, HeldLevel
from steptwin.simulation.faults.answers import NEVER_SENT
from steptwin.simulation.faults.table import Fault, FaultKind, Occasion
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.scheduler.wires import PinName
from steptwin.state import Plain, Stateful
from steptwin.wire.pdu import exception_pdu


class AxisLoad(Protocol):
    """The load of an axis, for faults. All methods take the moment."""

    @property
    def period_p(self) -> int:
        """Pulses of an electrical period of the motor, four full steps: a rotor that loses steps loses multiples of it."""
        ...

    def block(self, blocked: bool, now: Nanos) -> None:
        """Block the shaft, so that pulses are lost, or release it."""
        ...

    def lose(self, pulses: int, now: Nanos) -> None:
        """Move the shaft ``pulses`` behind a drive with positive pulses (negative: ahead)."""
        ...


class Body(Protocol):
    """The parts of a controller that can fail, besides its pins."""

    shafts: list[AxisLoad]
    """By axis. Mechanics replace the loads of their axes."""

    @property
    def inputs(self) -> Collection[str]:
        """Pins that are set from outside."""
        ...

    @property
    def outputs(self) -> Collection[str]:
        """Pins with a level that may stick, as those of welded contacts; a line that is both is among the inputs, too."""
        ...

    def slip(self, axis: int, counts: int, now: Nanos) -> None:
        """Let the encoder that an axis reads slip by ``counts``, whatever turns it."""
        ...

    def lacks(self, kind: FaultKind) -> str | None:
        """The reason why faults of a kind are impossible, as the end of a message after its name; None if they are possible."""
        ...

    def show_master_error(self, shown: bool, now: Nanos) -> None:
        """Set or clear the error that a slave of its own Modbus master does not answer."""
        ...

    def watch(self, owner: FaultyController) -> None:
        """Call ``owner`` before requests are served (`FaultyController.refusal`) and memory is saved (`.kept`)."""
        ...

    def pin_name(self, pin: str) -> str:
        """The one name of a pin with several names."""
        ...

    def check_pin(self, pin: str, level: float) -> None:
        """`Misuse` unless ``pin`` is an input that can take ``level``."""
        ...

    def applied(self, pin: str) -> float | None:
        """The level that a line, input and output in one, has from outside; None for an input, which has just that."""
        ...


class FaultySnapshot(NamedTuple):
    """State of the faults of a controller, and of the controller."""

    faults: Plain
    controller: Any


CONTROLLER_LACKS_WHAT_FAILS = Message("simulation.controller-lacks-what-fails", "fault {name}: {controller!r} {problem}")
UNKNOWN_AXIS_OF_A_FAULT = Message("simulation.unknown-axis-of-a-fault", "fault {name}: axis = {axis}: permitted are 1 to {most}")
PIN_WITH_ITS_CONTROLLER = Message(
    "simulation.pin-with-its-controller", "fault {name}: pin = {pin!r}: name the controller as machine=NAME, and the pin alone"
)
UNKNOWN_PIN_OF_A_FAULT = Message("simulation.unknown-pin-of-a-fault", "fault {name}: pin = {pin!r}: {controller!r} has {names}")
LEVEL_OF_AN_OUTPUT = Message("simulation.level-of-an-output", "fault {name}: value = {value:g}: an output is 0 or 1")
PIN_STAYS_STUCK = Message("simulation.pin-stays-stuck", "it ends, but fault {other} keeps {pin} at {level:g}")
PIN_IS_STUCK = Message("simulation.pin-is-stuck", "{pin} is stuck at {level:g}")
PIN_IS_FREE = Message("simulation.pin-is-free", "{pin} is free")
SLAVE_IS_MUTE = Message("simulation.slave-is-mute", "a slave of its Modbus master does not answer")
SLAVE_ANSWERS_AGAIN = Message("simulation.slave-answers-again", "the slave of its Modbus master answers again")
REFUSED_REQUEST = Message("simulation.refused-request", "{what}: {bytes}")


class FaultyController(Stateful):
    """Wraps a controller in its scheduler and applies faults to its pins, shafts, supply and memory.

    Inputs are set through it, so that a stuck switch remains stuck; outputs are seen through it, so that the level of a stuck one
    remains, whatever the controller does with it.
    """

    FIXED: ClassVar[tuple[str, ...]] = ("_faults", "_fresh", "_on_edge", "body", "changed", "inner", "name")
    __slots__ = (
        *FIXED,
        "_bounces",
        "_cut",
        "_edges",
        "_mute",
        "_off_until",
        "_outer",
        "_released",
        "_stuck",
        "_unsupplied",
        "held_outputs",
    )

    def __init__(
        self, inner: MotionController, name: str, faults: Faults, body: Body, on_edge: Callable[[str, Nanos, float], None]
    ) -> None:
        """``on_edge`` is called for each edge of an input that a fault makes; the edge is recorded here."""
        self._on_edge = on_edge
        self.inner = inner
        self.changed = inner.changed
        inner.changed = self._pass_on
        self.name = name
        self.body = body
        self._faults = faults
        self._outer: dict[str, float] = {}
        """The level of each input with a fault, without the fault."""
        self._bounces: list[tuple[Nanos, str, float]] = []
        """Scheduled levels."""
        self._stuck: dict[str, tuple[HeldLevel, ...]] = {}
        """The faults that hold each pin, the one that decides last."""
        self.held_outputs: dict[str, float] = {}
        """The level of each output that a fault holds."""
        self._edges: list[PinEdge] = []
        """Edges of outputs that nobody has taken, where faults hold any."""
        self._mute: list[str] = []
        """Faults because of which a slave of the controller does not answer."""
        self._released: list[tuple[Nanos, str, int]] = []
        """The moment at which each fault releases its axis."""
        self._off_until: Nanos | None = None
        self._unsupplied = False
        """Whether its power supply is off, or too low."""
        self._cut: Nanos | None = None
        """The moment of a supply failure during an action that ends first; None without one."""
        self._fresh = self.copy_state()
        body.watch(self)

    # ------------------------------------------------------------------ the controller's own

    @property
    def now(self) -> Nanos:
        return self.inner.now

    @property
    def axes(self) -> Sequence[Drive]:
        return self.inner.axes

    def _pass_on(self) -> None:
        self.changed()

    def take_edges(self) -> list[PinEdge]:
        if not self.held_outputs and not self._edges:
            return self.inner.take_edges()
        self._collect_edges()
        edges, self._edges = self._edges, []
        return edges

    def _collect_edges(self) -> None:
        """Take the controller's edges, but for those of outputs that faults hold."""
        for edge in self.inner.take_edges():
            if edge.pin in self.held_outputs:
                self._note_held(edge.pin, edge.value, edge.time)
            else:
                self._edges.append(edge)

    def pins(self) -> Mapping[str, float]:
        """Levels at the controller, with the faults."""
        levels = self.inner.pins()
        return {**levels, **self.held_outputs} if self.held_outputs else levels

    def pin(self, name: str) -> float:
        held = self.held_outputs.get(name)
        return self.inner.pin(name) if held is None else held

    def power_off(self, now: Nanos) -> None:
        self.inner.power_off(now)

    def power_cycle(self, now: Nanos) -> None:
        self.inner.power_cycle(now)

    # ------------------------------------------------------------------ snapshots

    def snapshot(self) -> FaultySnapshot:
        return FaultySnapshot(self.copy_state(), self.inner.snapshot())

    def restore(self, snapshot: Any) -> None:
        """A snapshot taken before the controller could have faults is one without faults."""
        if not isinstance(snapshot, FaultySnapshot):
            snapshot = FaultySnapshot(self._fresh, snapshot)
        self.set_state(snapshot.faults)
        self.inner.restore(snapshot.controller)

    # ------------------------------------------------------------------ time

    def advance(self, now: Nanos) -> None:
        while (due := self._own()) is not None and due <= now:
            self.inner.advance(due)
            self._run(due)
        self.inner.advance(now)
        self._note_blocked()

    def advance_to_change(self, until: Nanos) -> Nanos:
        """See `steptwin.motioncontroller.MotionController.advance_to_change`."""
        own, due = self._own(), self.inner.deadline()
        if own is None or own > until or (due is not None and due < own):
            moment = self.inner.advance_to_change(until if own is None else min(until, own - 1))
            self._note_blocked()
            return moment
        self.advance(own)
        return own

    def deadline(self) -> Nanos | None:
        deadlines = (self.inner.deadline(), self._own())
        return min((due for due in deadlines if due is not None), default=None)

    def _own(self) -> Nanos | None:
        deadlines = [a.due for a in self._mine() if a.due is not None]
        deadlines += [at for at, *_ in self._bounces] + [at for at, *_ in self._released]
        deadlines += [at for at in (self._off_until, self._cut) if at is not None]
        return min(deadlines, default=None)

    def _run(self, now: Nanos) -> None:
        if self._cut is not None:
            self.after_request(now)
        if self._off_until is not None and self._off_until <= now:
            self._off_until = None
            if not self._unsupplied:
                self.inner.power_cycle(now)
        for active in self._mine():
            while active.due is not None and active.due <= now:
                self._moment(active, now)
        for bounce in [b for b in self._bounces if b[0] <= now]:
            self._bounces.remove(bounce)
            self._put(bounce[1], bounce[2], now)
        for released in [r for r in self._released if r[0] <= now]:
            self._let_go(released, now)
        self.changed()

    def _moment(self, active: ActiveFault, now: Nanos) -> None:
        """Process the moment of a timed fault."""
        kind = active.fault.kind
        if kind.occasion is Occasion.ALWAYS:
            kind.effect.act(active, self, now)
            return
        if active.strikes(now):
            if not kind.effect.lasts:
                self._faults.act(active, now)
            kind.effect.act(active, self, now)
        active.step()

    def block(self, active: ActiveFault, axis: int, now: Nanos, until: Nanos) -> None:
        """Block the shaft of an axis (from 1)."""
        self.body.shafts[axis - 1].block(True, now)
        self._released.append((until, active.name, axis))
        self._note_blocked()

    def _note_blocked(self) -> None:
        """Note the motions that blocked shafts do not follow."""
        for until, name, axis in self._released:
            active, drive = self._faults.find(name), self.inner.axes[axis - 1]
            if active is None:
                continue  # it is being removed
            since, profile = until - active.ns("for_s"), profile_of(drive.plan)
            is_moving = profile.end is None or (profile.end > since and profile.end > profile.start)
            self._faults.does(active, (drive.revision,) if is_moving else None, max(since, profile.start))

    def drop_supply(self, now: Nanos, until: Nanos) -> None:
        """Switch the supply off until a moment, or longer if it is off already."""
        if self._off_until is None and not self._unsupplied:
            self.inner.power_off(now)
        self._off_until = max(until, self._off_until or 0)

    def supply(self, on: bool, now: Nanos) -> None:
        """Its power supply comes on, or goes off: then nothing answers until it is on again, as after power-on."""
        self._unsupplied = not on
        if self._off_until is None:
            self.inner.power_cycle(now) if on else self.inner.power_off(now)
        self.changed()

    def cut_supply(self, now: Nanos, until: Nanos) -> None:
        """As `drop_supply`, at the end of the present action."""
        self._cut, self._off_until = now, until
        self.changed()

    def _let_go(self, released: tuple[Nanos, str, int], now: Nanos) -> None:
        self._note_blocked()
        self._released.remove(released)
        active, axis = self._faults.find(released[1]), released[2]
        if active is not None:
            self._faults.does(active, None, now)
        if not any(other == axis for *_, other in self._released):
            self.body.shafts[axis - 1].block(False, now)

    def _mine(self) -> tuple[ActiveFault, ...]:
        return self._faults.of(self.name)

    def lose(self, axis: int, pulses: int, now: Nanos) -> None:
        """Let the shaft of an axis (from 1) fall ``pulses`` behind in the direction of its pulses, at rest the positive one."""
        velocity = profile_of(self.axes[axis - 1].plan).velocity(now)
        self.body.shafts[axis - 1].lose(-pulses if velocity < 0.0 else pulses, now)

    def report(self, active: ActiveFault, now: Nanos, text: str) -> None:
        self._faults.report(active, self.name, now, text)

    # ------------------------------------------------------------------ setting and removing

    def check(self, fault: Fault) -> None:
        """`Misuse` unless the controller has the axis or pin."""
        lacks = self.body.lacks(fault.kind)
        if lacks is not None:
            raise Misuse(CONTROLLER_LACKS_WHAT_FAILS(name=fault.kind.name, controller=self.name, problem=text_of(lacks)))
        axis = fault.whole("axis")
        if axis is not None and axis > len(self.body.shafts):
            raise Misuse(UNKNOWN_AXIS_OF_A_FAULT(name=fault.kind.name, axis=axis, most=len(self.body.shafts)))
        if fault.kind.check is not None:
            fault.kind.check(self, fault)
        if fault.kind.parameter("pin") is None:
            return
        pin = self.pin_of(fault)
        levels = self.inner.pins()
        if "." in pin:
            raise Misuse(PIN_WITH_ITS_CONTROLLER(name=fault.kind.name, pin=pin))
        outputs = self.body.outputs if fault.kind.occasion is Occasion.ALWAYS else ()
        permitted = [name for name in levels if name in self.body.inputs or name in outputs]
        if pin not in permitted:
            raise Misuse(UNKNOWN_PIN_OF_A_FAULT(name=fault.kind.name, pin=pin, controller=self.name, names=permitted))
        value = fault.get("value")
        level = value if isinstance(value, float) else levels[pin]
        if pin in self.body.inputs:
            self.body.check_pin(pin, level)
        elif level not in (0.0, 1.0):
            raise Misuse(LEVEL_OF_AN_OUTPUT(name=fault.kind.name, value=level))

    def begin(self, active: ActiveFault) -> None:
        """A fault of this controller was set."""
        if active.fault.kind.parameter("pin") is not None:
            pin = self.pin_of(active.fault)
            if pin in self.body.inputs:
                applied = self.body.applied(pin)
                self._outer.setdefault(pin, self.inner.pin(pin) if applied is None else applied)
        if active.fault.kind.occasion is Occasion.ALWAYS:
            active.due = active.begin
        self.changed()

    def end(self, active: ActiveFault, now: Nanos) -> None:
        """Remove a fault of this controller and release what it holds."""

        if active.fault.kind.parameter("pin") is not None:
            pin = self.pin_of(active.fault)
            self._bounces = [b for b in self._bounces if b[1] != pin]
            self._let_act(pin, self._others(pin, active), now)
            if not any(other.fault.get("pin") and self.pin_of(other.fault) == pin for other in self._mine()):
                self._outer.pop(pin, None)
        for released in [r for r in self._released if r[1] == active.name]:
            self._let_go(released, now)
        if active.name in self._mute:
            self._mute.remove(active.name)
            self.body.show_master_error(bool(self._mute), now)
        self.changed()

    # ------------------------------------------------------------------ pins

    def held(self) -> Iterator[tuple[str, HeldLevel]]:
        """The pins that faults hold."""
        for pin, held in self._stuck.items():
            yield pin, HeldLevel(held[-1].fault, self.pin(pin))

    def pin_of(self, fault: Fault) -> str:
        """The pin that a fault names, under its one name."""
        return self.body.pin_name(str(fault.get("pin")))

    def _put(self, pin: str, level: float, now: Nanos) -> None:
        """A fault gives an input a level; what that changes is recorded."""
        before = self.inner.pin(pin)
        self.inner.set_pin(pin, level, now)
        after = self.inner.pin(pin)
        if after != before:
            self._on_edge(pin, now, after)
            self._faults.record(TraceRecord(now, self.name, "edge", pin, after))

    def set_pin(self, pin: str, value: float, now: Nanos) -> None:
        """Change the level before the faults; a held input takes it when it is released."""
        name = self.body.pin_name(pin)
        before = self._outer.get(name)
        if before is None:
            self.inner.set_pin(pin, value, now)
            return
        self.body.check_pin(name, value)
        self._outer[name] = value
        if name in self._stuck:
            self._note_held(name, value, now)
            return
        self._bounces = [b for b in self._bounces if b[1] != name]
        self.inner.set_pin(name, value, now)
        if value != before:
            for active in self._mine():
                if active.fault.kind.occasion is Occasion.CHANGE and self.pin_of(active.fault) == name and active.strikes(now):
                    self._faults.act(active, now)
                    active.fault.kind.effect.act(active, self, name, (before, value), now)

    def bounce(self, changes: list[tuple[Nanos, str, float]]) -> None:
        """Levels of inputs to come, each with its moment and pin."""
        self._bounces += changes
        self.changed()

    def stick(self, active: ActiveFault, now: Nanos) -> None:
        """The first moment sticks, the second lets go. Of several faults the newest that lasts decides."""
        pin = self.pin_of(active.fault)
        others = self._others(pin, active)
        if others == self._stuck.get(pin, ()):
            wanted = active.fault.get("value")
            level = wanted if isinstance(wanted, float) else self.pin(pin)
            self._bounces = [b for b in self._bounces if b[1] != pin]
            self._let_act(pin, (*others, HeldLevel(active.name, level)), now)
            active.struck += 1
            self.report(active, now, PIN_IS_STUCK(pin=pin, level=level))
            active.due = active.end
        else:
            active.due = None
            self._faults.does(active, None, now)
            self._let_act(pin, others, now)
            if others:
                other, kept = others[-1]
                self.report(active, now, PIN_STAYS_STUCK(other=other, pin=pin, level=kept))
            else:
                self.report(active, now, PIN_IS_FREE(pin=pin))

    def _others(self, pin: str, active: ActiveFault) -> tuple[HeldLevel, ...]:
        """Level at which the other faults hold a pin."""
        return tuple(held for held in self._stuck.get(pin, ()) if held.fault != active.name)

    def _let_act(self, pin: str, faults: tuple[HeldLevel, ...], now: Nanos) -> None:
        """Let these faults hold a pin; without any it is free."""
        if faults:
            self._stuck[pin] = faults
            self._hold(pin, faults[-1].level, now)
        else:
            self._free(pin, now)

    def _hold(self, pin: str, level: float, now: Nanos) -> None:
        """Give a pin a level that it keeps."""
        own = level
        if pin in self.body.outputs:
            self._collect_edges()
            own, before, self.held_outputs[pin] = self.inner.pin(pin), self.pin(pin), level
            self._edge(pin, before, now)
        if pin in self._outer:
            self._put(pin, level, now)
            own = self._outer[pin]
        self._note_held(pin, own, now)

    def _note_held(self, pin: str, own: float, now: Nanos) -> None:
        """Note whether faults that hold a pin give it another level than its own; only the newest does."""
        holding = self._stuck.get(pin, ())
        for held in holding:
            active = self._faults.find(held.fault)
            if active is not None:
                self._faults.does(active, held is holding[-1] and held.level != own, now)

    def _free(self, pin: str, now: Nanos) -> None:
        """Let a pin have its own level again."""
        self._stuck.pop(pin, None)
        if pin in self._outer:
            self._put(pin, self._outer[pin], now)
        if pin in self.held_outputs:
            self._collect_edges()
            before = self.held_outputs.pop(pin)
            self._edge(pin, before, now)

    def _edge(self, pin: str, before: float, now: Nanos) -> None:
        """Report the level of an output if it was another one ``before``."""
        if self.pin(pin) != before:
            self._edges.append(PinEdge(now, pin, self.pin(pin)))

    def fail_master(self, active: ActiveFault, now: Nanos) -> None:
        """The first moment sets the error, the second clears it."""
        if active.struck == 0:
            self._mute.append(active.name)
            active.struck = 1
            active.due = active.end
            self.report(active, now, SLAVE_IS_MUTE())
            self._faults.act(active, now)
        else:
            self._mute.remove(active.name)
            active.due = None
            self.report(active, now, SLAVE_ANSWERS_AGAIN())
        self.body.show_master_error(bool(self._mute), now)

    # ------------------------------------------------------------------ what the body asks

    def refusal(self, unit: int, line: str, pdu: bytes, now: Nanos) -> bytes | None:
        """The answer to a request on ``line`` that a fault refuses; None if it is executed."""
        function = pdu[0] if pdu else 0
        if self._off_until is not None or self._unsupplied:
            return exception_pdu(function, NEVER_SENT)
        for active in self._faults.refusing():
            if active.matches(unit, pdu) and active.is_on(self._faults.link, line) and active.strikes(now):
                code, text = active.fault.kind.effect.refusal(active)
                self._faults.act(active, now)
                self.report(active, now, REFUSED_REQUEST(what=text_of(text), bytes=pdu.hex(" ")))
                return exception_pdu(function, code)
        return None

    def kept(self, old: bytes, new: bytes, now: Nanos) -> bytes:
        """The content of the memory after ``new`` was saved over ``old`` of the same length."""
        kept = bytearray(new)
        saves = [active for active in self._mine() if active.fault.kind.occasion is Occasion.SAVE]
        for active in saves:
            if active.strikes(now):
                before = bytes(kept)
                active.fault.kind.effect.act(active, self, old, kept, now)
                if kept != before or self._cut is not None:
                    self._faults.act(active, now)
        return bytes(kept)

    def after_request(self, now: Nanos) -> bool:
        """Whether the supply has failed during a request; it is off then."""
        if self._cut is None:
            return False
        self._cut = None
        self.inner.power_off(now)
        return True


def prepare_for_faults(scheduler: Scheduler, name: str, faults: Faults, body: Body) -> FaultyController:
    """Apply faults of physics and protocol to the controller ``name`` of a scheduler."""

    def on_edge(pin: str, now: Nanos, level: float) -> None:
        scheduler.mark_recorded(PinName(name, pin), now, level)

    controller = scheduler.controllers[name]
    if isinstance(controller, FaultyController):
        return controller
    failing = faults.controllers[name] = FaultyController(controller, name, faults, body, on_edge)
    scheduler.replace(name, failing)
    return failing
