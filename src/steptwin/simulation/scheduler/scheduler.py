"""The event-driven scheduler: controllers, the wires between their pins, and the parts (mechanics, switches, lines) between them.

A scheduler is itself a machine in virtual time. Controllers without a common wire are put into separate schedulers, so that each
one is advanced only when an event concerns it.

One round of its loop, for the earliest moment at which anything is due::

    controllers that are due → edges of their pins ─┬→ wires → inputs of controllers
                                                    └→ parts that depend on them, in order
                     ↑                                                  │
                     └──────────── again, at the same moment, while anything has changed

Signals propagate in zero time, so a moment is over when a round changes nothing. Then plans are recorded, subscribers are
notified, and the next deadline is the least of those of controllers, parts and delayed wires.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import ClassVar, NamedTuple

from steptwin.controller import Fact, Nanos, PinEdge
from steptwin.errors import Misuse, Runaway, TimeReversal
from steptwin.messages import NONE, Message
from steptwin.motioncontroller import Drive, MotionController
from steptwin.simulation.scheduler.deadlines import Deadlines
from steptwin.simulation.scheduler.recordedplans import RecordedPlans
from steptwin.simulation.scheduler.runqueue import RunQueue
from steptwin.simulation.scheduler.scheduledpart import ScheduledPart
from steptwin.simulation.scheduler.scheduledparts import Depends, ScheduledParts
from steptwin.simulation.scheduler.schedulerstate import SchedulerState
from steptwin.simulation.scheduler.subscribers import SchedulerSubscriber, SchedulerSubscribers
from steptwin.simulation.scheduler.trace import RecordSink, TraceRecord
from steptwin.simulation.scheduler.wires import PinName, Wire, Wires
from steptwin.state import Stateful

MAX_ROUNDS_PER_INSTANT = 1000
"""Signals propagate in zero time; more rounds than this at one moment mean a feedback loop of wires."""


class Source(NamedTuple):
    """A controller, a line or an element of a scheduler, on which a value depends."""

    scheduler: Scheduler
    name: str


class TerminalBlock(Stateful):
    """Terminals of the element ``name``: levels that wires, contacts and other elements join as they join pins of controllers.
    All levels are 0 until something drives them.

    Its element reads inputs in `ScheduledPart.update`, never earlier, so that a loop of elements is found by the scheduler.
    """

    FIXED: ClassVar[tuple[str, ...]] = ("inputs", "scheduler", "name", "outputs")
    __slots__ = (*FIXED, "_held", "_recorded", "_wanted", "levels")

    def __init__(self, scheduler: Scheduler, name: str, inputs: Iterable[str], outputs: Iterable[str]) -> None:
        self.scheduler = scheduler
        self.name = name
        self.inputs, self.outputs = tuple(inputs), tuple(outputs)
        self.levels: dict[str, float] = dict.fromkeys((*self.inputs, *self.outputs), 0.0)
        self._wanted: dict[str, float] = {}
        """Levels that the element gives its outputs, and to which its inputs are driven."""
        self._held: dict[str, float] = {}
        """Terminals that faults hold."""
        self._recorded: tuple[str, ...] = ()
        """Outputs whose first level has been recorded."""

    @property
    def source(self) -> Source:
        """Source of its levels and of the signals of its element."""
        return self.scheduler.source(self.name)

    def set_pin(self, pin: str, level: float, now: Nanos) -> None:
        """Drive an input. The element sees it when signals settle."""
        self._wanted[pin] = level
        self.levels[pin] = self._held.get(pin, level)

    def is_on(self, terminal: str) -> bool:
        return self.levels[terminal] != 0.0

    def put(self, output: str, level: float) -> None:
        """Give an output a level now; its first level and every change are recorded and carried along wires."""
        self._wanted[output] = level
        self._show(output, self._held.get(output, level))

    def hold(self, terminal: str, level: float | None) -> None:
        """Hold a terminal at a level, whatever its element gives it, or drives it; None lets it go."""
        if level is None:
            self._held.pop(terminal, None)
        else:
            self._held[terminal] = level
        shown = self._held.get(terminal, self._wanted.get(terminal, 0.0))
        if terminal in self.outputs:
            self._show(terminal, shown)
        else:
            self.levels[terminal] = shown

    def is_altered(self, terminal: str) -> bool:
        """Whether a terminal is held at another level than it would have."""
        return self._held.get(terminal, own := self._wanted.get(terminal, 0.0)) != own

    def _show(self, output: str, level: float) -> None:
        if level == self.levels[output] and output in self._recorded:
            return
        self.levels[output] = level
        if output not in self._recorded:
            self._recorded = (*self._recorded, output)
        self.scheduler.put(self.name, output, level)


CONTROLLER_IS_THERE = Message("simulation.controller-is-there", "there is a controller {name!r} already")
UNKNOWN_CONTROLLER = Message("simulation.unknown-controller", "no controller {name!r}: there are {names}")
NOTHING_COMPUTES_SIGNALS = Message(
    "simulation.nothing-computes-signals", "nothing computes signals of {name!r}: there are {names}"
)
NO_SUCH_PIN = Message("simulation.no-such-pin", "{controller!r} has no pin {pin!r}: pins are {names}")
NO_AXIS_OF = Message("simulation.no-axis-of", "no axis {axis} of {controller!r}, which has {count} axes")
SIGNALS_DO_NOT_SETTLE = Message(
    "simulation.signals-do-not-settle", "signals did not settle after {most} rounds at {now} ns: a loop of wires"
)


class Scheduler:
    """Runs controllers together. Ties in time are broken by the order in which controllers and parts were added.

    An event costs what it changes: it visits only controllers and parts that are due, or that were notified of a change of what
    they watch (`notify`).

    Before a controller is changed directly (by a request or a pin), the scheduler must be advanced to that moment, so that
    delayed levels arrive in order; the effects propagate with the next `advance`, `deadline` or `propagate`.

    ``record`` gets the first level of each driven input, every edge of an output and of an input, and every new plan of an axis.
    """

    def __init__(
        self, now: Nanos = 0, record: RecordSink | None = None, *, is_checked: bool = False, is_blank: bool = False
    ) -> None:
        """``is_checked``: its wires join what exists, because they do so in another scheduler of the same description.
        ``is_blank``: `restore` comes next, with all levels; until then it drives and records nothing."""
        self.now = now
        self.controllers: dict[str, MotionController] = {}
        self.terminal_blocks: dict[str, TerminalBlock] = {}
        """Terminals of elements."""
        self._parts = ScheduledParts()
        self.edge_subscribers: list[Callable[[str, PinEdge], None]] = []
        """Called with controller name and edge, in order, for every output edge."""
        self.is_dirty = False
        """Whether something changed since the signals last settled."""
        self.is_step_exact = False
        """Whether a condition depends on values that a request or a statement may change without an event; then each of them
        counts as one."""
        self.hears_requests = False
        """Whether every request counts as an event, because what one may change is noted."""
        self.hears_programs = False
        """Whether it counts as an event where a program that only calculates begins to wait, because that is reported."""
        self.on_change: Callable[[Scheduler], None] | None = None
        """Called with the scheduler after each of its events and after each change from outside."""
        self.subscribers: SchedulerSubscribers | None = None
        """Subscribers that are notified of each event; None: there have been none yet."""
        self._changed: set[str] = set()
        """The controllers, lines and elements that were visited since the last `take_changed`."""
        self._is_checked, self.is_blank = is_checked, is_blank
        self._record = record
        self.wires = Wires(self.drive)
        self._levels: dict[PinName, float] = {}
        """The level last driven to each input."""
        self._recorded: dict[PinName, tuple[Nanos, float]] = {}
        """The last recorded edge of each driven input."""
        self._plans: list[RecordedPlans] = []
        """The plans of each controller that were recorded last."""
        self._names: list[str] = []
        """The names of the controllers, by number."""
        self._pin_names: dict[str, tuple[str, ...]] = {}
        """Pins of controllers and elements that were asked for."""
        self._numbers: dict[str, int] = {}
        """The numbers of the controllers, by name."""
        self._sources: dict[str, Source] = {}
        """The controllers, and the lines and elements with a part that computes their signals."""
        self._controller_queue = RunQueue()
        """Those whose edges have to be taken when the signals settle."""
        self._controller_deadlines = Deadlines()
        self._controllers_visited: set[int] = set()
        """Those whose deadlines may have changed since the signals last settled."""
        self._due: Nanos | None = None
        self._alone: tuple[str, RecordedPlans] | None = None
        """The only controller of a scheduler without parts and wires, for which nothing has to be scheduled."""

    # ------------------------------------------------------------------ what is in it

    @property
    def parts(self) -> Sequence[ScheduledPart]:
        """In the order in which they are updated."""
        return self._parts.parts

    def add(self, name: str, controller: MotionController) -> None:
        """Add a controller and set its ``changed`` hook. Raises `TimeReversal` if its time is after the scheduler's."""
        if name in self.controllers:
            raise Misuse(CONTROLLER_IS_THERE(name=name))
        if not self.is_blank and controller.now != self.now:  # at its beginning, circuits set its pins before its first statement
            controller.advance(self.now)
        self.controllers[name] = controller
        self._numbers[name] = len(self._names)
        self._names.append(name)
        self._sources[name] = Source(self, name)
        self._plans.append(RecordedPlans(name, controller))
        controller.changed = partial(self.notify, name)
        self._join()
        if len(self._names) == 1 and not self.parts and not self.wires:
            self._alone = name, self._plans[0]
        self.notify(name)

    def _join(self) -> None:
        """Leave the shortcut for a single controller: from now on everything is scheduled."""
        if self._alone is not None:
            self._alone = None
            self.notify()

    def replace(self, name: str, controller: MotionController) -> None:
        """Replace the controller ``name`` by a wrapper with the same pins and axes."""
        if name not in self.controllers:
            raise Misuse(UNKNOWN_CONTROLLER(name=name, names=list(self.controllers) or NONE()))
        self.controllers[name] = controller
        controller.changed = partial(self.notify, name)
        self.notify(name)

    def add_terminal_block(self, block: TerminalBlock) -> None:
        """Add the terminals of an element, whose part has their state."""
        self.terminal_blocks[block.name] = block
        self._sources[block.name] = Source(self, block.name)

    def add_part(
        self,
        part: ScheduledPart,
        depends_on: Depends = None,
        name: str | None = None,
        drives: str | None = None,
        reads: Iterable[str] = (),
    ) -> None:
        """Add a part; it is first updated when the signals settle next, then whenever it is due or something that it depends on
        has changed.

        ``depends_on``: names of controllers, lines and elements, or what gives them in `arrange`; None: every change. ``name``:
        the line or element whose signals it computes; they may change with each of its updates, and only then. ``drives``: the
        controller or element whose input it drives. ``reads``: names whose signals it reads; it is updated after each update of
        what computes these, too.
        """
        self._join()
        number = self._parts.add(part, depends_on, name, drives, reads)
        if name is not None:
            self._sources.setdefault(name, Source(self, name))
        if not self.is_blank:
            self._parts.queue.add(number)
        self.is_dirty = True
        if self.on_change is not None:
            self.on_change(self)

    def order(self) -> Sequence[int]:
        """The numbers of its parts in the order in which they should be updated (`arrange`); empty if they are in that order."""
        return self._parts.order(self.wires)

    def arrange(self, order: Sequence[int]) -> None:
        """Update its parts in another order from now on, before the first moment, when all are there. ``order``: their present
        numbers; empty if they are in that order."""
        if order:
            self._parts = self._parts.arranged(order)
            self.notify()
        self._parts.resolve()

    def source(self, name: str) -> Source:
        """The controller, line or element ``name`` as what a value depends on."""
        found = self._sources.get(name)
        if found is None:
            raise Misuse(NOTHING_COMPUTES_SIGNALS(name=name, names=list(self._sources) or NONE()))
        return found

    def connect(self, wire: Wire) -> None:
        """Add a wire. The target takes the present level of the source at once, without the delay."""
        self.check(wire.source)
        self.check(wire.target)
        self._join()
        if not self.is_blank:
            self.drive(wire.target, wire.transmitted(self.level(wire.source)))
        self.wires.add(wire)
        self.notify(wire.target.controller)

    def wire_to(self, target: PinName) -> Wire | None:
        """The wire that drives an input, if one does."""
        return next((wire for wire in self.wires if wire.target == target), None)

    def check(self, name: PinName) -> None:
        """Raises `Misuse` if the controller or its pin does not exist."""
        if self._is_checked:
            return
        if name.controller not in self.controllers and name.controller not in self.terminal_blocks:
            raise Misuse(UNKNOWN_CONTROLLER(name=name.controller, names=list(self.controllers) or NONE()))
        pins = self._pin_names.get(name.controller)
        if pins is None:
            block = self.terminal_blocks.get(name.controller)
            pins = self._pin_names[name.controller] = tuple(
                self.controllers[name.controller].pins() if block is None else block.levels
            )
        if name.pin not in pins:
            raise Misuse(NO_SUCH_PIN(controller=name.controller, pin=name.pin, names=list(pins)))

    def level(self, name: PinName) -> float:
        """The present level of a pin of a controller, or of a terminal of an element."""
        block = self.terminal_blocks.get(name.controller)
        return self.controllers[name.controller].pin(name.pin) if block is None else block.levels[name.pin]

    def drive_of(self, controller: str, axis: int) -> Drive:
        """The drive of ``axis`` (from 1). Raises `Misuse` if it does not exist."""
        found = self.controllers.get(controller)
        axes = () if found is None else found.axes
        if not 1 <= axis <= len(axes):
            raise Misuse(NO_AXIS_OF(axis=axis, controller=controller, count=len(axes)))
        return axes[axis - 1]

    def subscribe(self, subscriber: SchedulerSubscriber, names: Iterable[str], *, leaves: bool = False) -> None:
        """Tell it of events from now on, as `SchedulerSubscribers.add`."""
        if self.subscribers is None:
            self.subscribers = SchedulerSubscribers()
        self.subscribers.add(subscriber, names, leaves=leaves)

    def unsubscribe(self, subscriber: SchedulerSubscriber) -> None:
        """Tell it no more."""
        if self.subscribers is not None:
            self.subscribers.remove(subscriber)

    def take_changed(self) -> set[str]:
        """The controllers, lines and elements whose signals may have changed since the last call, if signals have settled."""
        changed, self._changed = self._changed, set()
        return changed

    def notify(self, name: str | None = None) -> None:
        """Register a change of a controller, a line or an element, or of anything: the signals have to settle."""
        if self._alone is not None or self.is_blank:
            pass  # each `propagate` visits it, and all of it after `restore`
        elif name is None:
            for number in range(len(self._names)):
                self._controller_queue.add(number)
            for number in range(len(self.parts)):
                self._parts.queue.add(number)
        else:
            of_controller = self._numbers.get(name)
            if of_controller is not None:
                self._controller_queue.add(of_controller)
            for number in self._parts.by_name.get(name, ()):
                self._parts.queue.add(number)
        self.is_dirty = True
        if self.on_change is not None:
            self.on_change(self)

    def is_watched(self, name: str) -> bool:
        """Whether parts depend on what is called so, and `notify` with its name concerns them."""
        return name in self._parts.by_name

    # ------------------------------------------------------------------ levels

    def drive(self, target: PinName, level: float) -> None:
        """Drive an input to a level now; an unchanged level has no effect."""
        before = self._levels.get(target)
        if before == level or self.is_blank:
            return
        self._levels[target] = level
        self.set_input(target, level, is_first=before is None)

    def set_input(self, target: PinName, level: float, *, is_first: bool = False) -> None:
        """Drive an input now. Its resulting level, which a fault may hold, is recorded where it changes or ``is_first``.

        The controller's own report of the same edge is not recorded again.
        """
        block = self.terminal_blocks.get(target.controller)
        if block is not None:
            block.set_pin(target.pin, level, self.now)
            self.notify(target.controller)
            return
        controller, (_, pin) = self.controllers[target.controller], target
        if self._record is None:
            controller.set_pin(pin, level, self.now)
            return
        known = self._recorded.get(target)
        before = controller.pin(pin) if known is None else known[1]
        controller.set_pin(pin, level, self.now)
        after = controller.pin(pin)
        if is_first or after != before:
            self.mark_recorded(target, self.now, after)
            self._record(TraceRecord(self.now, target.controller, "edge", pin, after))

    def mark_recorded(self, target: PinName, now: Nanos, level: float) -> None:
        """Mark an edge of an input as recorded, in case its controller reports it too."""
        self._recorded[target] = now, level

    def owner(self, name: str) -> str:
        """The controller under which ``name`` is recorded: itself, or the first one for an element with terminals."""
        return next(iter(self.controllers), name) if name in self.terminal_blocks else name

    @property
    def first(self) -> str:
        """The name under which is recorded what belongs to none of its elements: the first controller, or element with
        terminals."""
        return next(iter((*self.controllers, *self.terminal_blocks)))

    def put(self, element: str, output: str, level: float) -> None:
        """An output of an element has another level now, or its first one."""
        self.record(self.owner(element), "edge", f"{element}.{output.lower()}", level)
        self.wires.transmit(PinName(element, output), level, self.now)
        self.notify(element)

    def record(self, controller: str, kind: str, subject: str, value: object, *facts: Fact) -> None:
        """Add a record of a controller to the trace, at the present moment."""
        if self._record is not None and not self.is_blank:
            self._record(TraceRecord(self.now, controller, kind, subject, value, facts))

    # ------------------------------------------------------------------ time

    def advance(self, now: Nanos) -> None:
        if now < self.now:
            raise TimeReversal(self.now, now)
        if self.is_dirty:
            self.propagate()
        due = self._due
        if due is not None and due <= now:
            self._run(now)
        if self.subscribers is not None and self.subscribers.leaving and now > self.now:
            self.subscribers.leave(now)  # something may come from outside next
        self.now = now

    def advance_to_event(self, until: Nanos) -> Nanos:
        """Process the next event, if it is due by ``until``; returns its moment. Nothing may come in before ``until``: a program
        that only calculates runs on until it changes something else."""
        if self.is_dirty:
            self.propagate()
        if self._due is not None and self._due <= until:
            self._run(until, is_one=True)
        return self.now

    def _run(self, now: Nanos, *, is_one: bool = False) -> None:
        """Process all events due by ``now``, in order, or ``is_one`` only."""
        if self._alone is not None:
            self._advance_alone(*self._alone, now, is_one=is_one)
            if self.on_change is not None:
                self.on_change(self)
            return
        is_quiet = False
        while self._due is not None and self._due <= now:
            if self.subscribers is not None and self.subscribers.leaving:
                self.subscribers.leave(self._due)
            self.now = self._due
            is_quiet = self._advance_controllers(now)
            if is_quiet:
                self._find_due()
                continue
            self._parts.run_due(self.now)
            if self.wires.delayed:
                self.wires.arrive(self.now)
            self.propagate()
            if is_one:
                return
        if is_quiet and self.on_change is not None:
            self.on_change(self)

    def _advance_controllers(self, now: Nanos) -> bool:
        """Advance the controllers that are due; a single one to where it changes something, or where anything else is due.
        Returns whether a program has only calculated up to there, so that nothing has changed."""
        due = self._controller_deadlines.take(self.now)
        until = self._nothing_else_until(now) if len(due) == 1 and not self.is_step_exact else self.now
        for number in due:
            name = self._names[number]
            self.is_dirty = False
            if until > self.now:
                self.now = self.controllers[name].advance_to_change(until)
                if not self.is_dirty and not self.hears_programs:
                    self._controller_deadlines.put(number, self.controllers[name].deadline())
                    return True
            else:
                self.controllers[name].advance(self.now)
            if not self.is_dirty:  # the controller has not called its hook
                self.notify(name)
        return False

    def _nothing_else_until(self, now: Nanos) -> Nanos:
        """The last moment, at most ``now``, before anything is due besides a controller that is due now."""
        until, deadlines = now, (self._controller_deadlines.first(), self._parts.deadlines.first())
        for due in (*deadlines, self.wires.next_arrival()) if self.wires.delayed else deadlines:
            if due is not None and due <= until:
                until = due - 1
        return until

    def _advance_alone(self, name: str, plans: RecordedPlans, now: Nanos, *, is_one: bool) -> None:
        controller, due = self.controllers[name], self._due
        self._changed.add(name)
        while due is not None and due <= now:
            if self.subscribers is not None:
                self.subscribers.leave(due)
            if self.is_step_exact:
                controller.advance(due)
                self.now = due
            else:
                self.now = controller.advance_to_change(now)
            self._propagate_alone(name, plans)
            if self.subscribers is not None:
                self.subscribers.news |= self.subscribers.by_name.get(name, {})
                self.subscribers.notify(self.now)
            if is_one:
                return
            due = self._due
            if self.is_step_exact and self.on_change is not None:
                self.on_change(self)

    def _propagate_alone(self, name: str, plans: RecordedPlans) -> None:
        """As `propagate`, for a single controller without parts and wires."""
        controller = self.controllers[name]
        for edge in controller.take_edges():
            self._edge(name, edge)
        if self._record is not None:
            plans.report(self._record, self.now)
        self._due = controller.deadline()
        self.is_dirty = False

    def deadline(self) -> Nanos | None:
        """The time of the next event; None if there is none."""
        if self.is_dirty:
            self.propagate()
        return self._due

    def propagate(self) -> None:
        """Propagate edges along wires and update parts until nothing changes; then find the next deadline."""
        if self._alone is not None:
            self._changed.add(self._alone[0])
            self._propagate_alone(*self._alone)
            if self.subscribers is not None:
                self.subscribers.news |= self.subscribers.by_name.get(self._alone[0], {})
        else:
            self._settle_connected()
        if self.subscribers is not None and self.subscribers.news:
            self.subscribers.notify(self.now)
        if self.on_change is not None:
            self.on_change(self)

    def _settle_connected(self) -> None:
        for _ in range(MAX_ROUNDS_PER_INSTANT):
            self.is_dirty = False
            for number in self._parts.all:
                self._parts.queue.add(number)
            self._update_parts()
            self._take_edges()
            if not self.is_dirty:
                break
        else:
            raise Runaway(SIGNALS_DO_NOT_SETTLE(most=MAX_ROUNDS_PER_INSTANT, now=self.now))
        self._find_deadlines()

    def _update_parts(self) -> None:
        parts, queue, visited, readers = self._parts.parts, self._parts.queue, self._parts.visited, self._parts.readers
        while (number := queue.take()) is not None:
            visited.add(number)
            parts[number].update(self.now)
            if number in readers:
                for reader in readers[number]:
                    queue.add(reader)
                    self.is_dirty |= reader < number  # its turn is in the next round

    def _take_edges(self) -> None:
        while (number := self._controller_queue.take()) is not None:
            self._controllers_visited.add(number)
            name = self._names[number]
            for edge in self.controllers[name].take_edges():
                self._edge(name, edge)

    def _find_deadlines(self) -> None:
        """Record new plans of the controllers that were visited, and find when anything is due next."""
        subscribers = self.subscribers
        for number in sorted(self._controllers_visited):
            if self._record is not None:
                self._plans[number].report(self._record, self.now)
            name = self._names[number]
            self._changed.add(name)
            if subscribers is not None and name in subscribers.by_name:
                subscribers.news |= subscribers.by_name[name]
            self._controller_deadlines.put(number, self.controllers[name].deadline())
        parts = self._parts
        for number in parts.visited:
            of = parts.computes[number]
            if of is not None:
                self._changed.add(of)
                if subscribers is not None and of in subscribers.by_name:
                    subscribers.news |= subscribers.by_name[of]
            parts.deadlines.put(number, parts.parts[number].deadline())
        self._controllers_visited.clear()
        parts.visited.clear()
        self._find_due()

    def _find_due(self) -> None:
        due, of_parts = self._controller_deadlines.first(), self._parts.deadlines.first()
        if due is None or (of_parts is not None and of_parts < due):
            due = of_parts
        arrival = self.wires.next_arrival() if self.wires.delayed else None
        self._due = arrival if due is None or (arrival is not None and arrival < due) else due

    def _edge(self, name: str, edge: PinEdge) -> None:
        pin = PinName(name, edge.pin)
        if self._record is not None and self._recorded.get(pin) != (edge.time, edge.value):
            self._record(TraceRecord(edge.time, name, "edge", edge.pin, edge.value))
            if pin in self._recorded:
                self._recorded[pin] = edge.time, edge.value
        for subscriber in self.edge_subscribers:
            subscriber(name, edge)
        self.wires.transmit(pin, edge.value, self.now)

    # ------------------------------------------------------------------ snapshots

    def snapshot(self) -> SchedulerState:
        """State of everything at the scheduler's moment."""
        if self.is_dirty:
            self.propagate()
        return SchedulerState(
            self.now,
            tuple(controller.snapshot() for controller in self.controllers.values()),
            tuple(part.copy_state() for part in self.parts),
            self._levels.copy(),
            tuple(self.wires.delayed),
        )

    def restore(self, state: SchedulerState) -> None:
        """Restore the state of a scheduler with the same controllers and parts."""
        self.now, self.is_blank = state.now, False
        for controller, its_state in zip(self.controllers.values(), state.controllers, strict=True):
            controller.restore(its_state)
        for part, its_state in zip(self.parts, state.parts, strict=True):
            part.set_state(its_state)
        self._levels = dict(state.levels)
        self._recorded.clear()
        self.wires.delayed = list(state.delayed)
        for plans in self._plans:
            plans.mark_reported()
        self.notify()
        self.propagate()
