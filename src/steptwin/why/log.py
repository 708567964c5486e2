"""Log of a world with all that can be a cause: its trace, the statements of its programs, the steps of its scripts.

A running world does not note this. Its past is run again with the inputs that it kept: from its beginning, or from a state of it.
"""

from __future__ import annotations

import json
import sys
from array import array
from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import partial
from itertools import takewhile
from typing import NamedTuple

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message, MessageText, text_of
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.faults.active import ActiveFault, HeldLevel
from steptwin.simulation.kinds.programs import Programs, ProgramState, StatementLocation, StatementUse
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.scheduler.wires import PinName
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.actions import is_release
from steptwin.simulation.world.inputs import Download, ExternalInput
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshot import RecordedInput
from steptwin.simulation.world.snapshotlog import SLICE_NS, replay
from steptwin.statements import StatementHook
from steptwin.why import points
from steptwin.why.actions import NotedActions
from steptwin.why.frames import Frames
from steptwin.why.lacking import EXECUTED, HAPPENED, NEVER, Found, Lacking
from steptwin.why.movers import STANDS, NotedMeetings
from steptwin.why.programstates import ProgramStates
from steptwin.why.rates import NotedRates
from steptwin.why.roots import Act

MOST_NOTED = 20_000_000
"""Limit of what is noted, because it is kept in memory."""
MOST_LOOKED_BACK = 20_000
"""Limit of the records, actions and statements that are searched for one cause."""
LAST = sys.maxsize
"""The order of what is after all that was noted."""
FALL = "fall"
OF_MECHANICS = ("stall", "hard-stop", "collision", FALL)
"""Events after which the rotor of an axis does not follow its motion, or does again."""
WORKPIECE = "workpiece"
JAMS = ("jams", "free again")
"""Events of a pusher after which what moves it stands, or moves again."""
WRONG_DATA = "wrong-data"
BEGINS = ("power-on", "restart", "reset", "file")
"""Events after which the program of a controller begins anew."""
STATEMENTS_AT_ONCE = 2000
"""Most statements of one program between two parts of a run."""


class Executed(NamedTuple):
    """A statement of a program. ``order``: as that of a `Change`."""

    time: Nanos
    controller: str
    location: StatementLocation
    order: int


class ExecutedStatements:
    """Those of one controller, in their order; in columns, because there are many."""

    def __init__(self, controller: str) -> None:
        self._controller = controller
        self.times, self.orders = array("q"), array("q")
        self.locations: list[StatementLocation] = []
        self.refused = set[int]()
        """The numbers of those that a chip refused as wrong data: they have done nothing."""

    def __len__(self) -> int:
        return len(self.times)

    def __getitem__(self, index: int) -> Executed:
        return Executed(self.times[index], self._controller, self.locations[index], self.orders[index])

    def last(self, until: Nanos) -> int:
        """The number of the last one by a moment; -1 if there is none."""
        return bisect_right(self.times, until) - 1


class Change(NamedTuple):
    """A signal took a value. ``position``: its number among the records of its group; ``order``: grows with all that is noted, in
    every group; a cause has a lower one than its effect of the same nanosecond."""

    time: Nanos
    value: float
    group: int
    position: int
    order: int


class EndedWait(NamedTuple):
    """A condition has come for which a script waited. ``order``: as that of a `Change`."""

    time: Nanos
    order: int
    condition: str


class Hold(NamedTuple):
    """From a moment on a fault holds a signal; nothing does, if ``held`` is None."""

    time: Nanos
    held: HeldLevel | None
    order: int = 0


TOO_MUCH_TO_SEARCH = Message(
    "why.too-much-to-search", "more than {most} records and statements since {begin:g} s: too many to search"
)


class CauseLog:
    """Notes what happens in ``world`` from now on while that runs.

    Records are in groups: what is joined is in one group, whose records come in the order of their causes. Of a world that is not
    at its beginning, the statements in execution and the plans in force are noted first, as if they had begun now. ``lacking``
    takes what was before the log and decides something.
    """

    def __init__(self, world: Simulation, most: int = MOST_NOTED, lacking: Lacking | None = None) -> None:
        self.world = world
        self.begin = world.now
        self.lacking = Lacking() if lacking is None else lacking
        self._most = most
        parts = world.objects
        numbers = {id(scheduler): number for number, scheduler in enumerate(world.schedulers)}
        self._group_of = {name: numbers[id(scheduler)] for name, scheduler in parts.scheduler_of.items()}
        self._timed = on_timed_lines(world)
        self._pins = {name: frozenset(controller.pins()) for name, controller in world.controllers.items()}
        self.first_levels = levels_of(world)
        self.records: dict[int, list[TraceRecord]] = defaultdict(list)
        self._orders: dict[int, array[int]] = defaultdict(partial(array, "q"))
        """The order of each record, by group."""
        self.changes: dict[str, list[Change]] = defaultdict(list)
        self.executed = {name: ExecutedStatements(name) for name in world.controllers}
        self.plans: dict[tuple[str, str], list[Change]] = defaultdict(list)
        """Moments and positions of the plans of an axis, by controller and number."""
        self.origins: dict[tuple[str, str], list[Change]] = defaultdict(list)
        """Moments at which an axis got another coordinate without a motion, by controller and number."""
        self.faults: dict[str, list[Change]] = defaultdict(list)
        """Moments at which faults began or ended, by controller or element."""
        self.mechanics: dict[str, list[Change]] = defaultdict(list)
        """Events of `OF_MECHANICS` by axis or collision, and jams of pushers."""
        self.axis_events: dict[tuple[str, str], list[Change]] = defaultdict(list)
        """Events of controllers about an axis, by its number, and about none."""
        self.given: dict[tuple[str, StatementLocation], StatementUse] = {}
        """Uses of commands that came over a line by themselves; their locations have their code instead of a text, and a negative
        number."""
        self.begins: dict[str, list[Change]] = defaultdict(list)
        """Events of `BEGINS` by controller, whose program began anew."""
        self.frames = Frames(world)
        self.events: dict[str, list[Change]] = defaultdict(list)
        """Events of workpieces: all, and by the workpiece and by the element."""
        self.meetings = NotedMeetings(world)
        self.acts: list[Act] = []
        self._waits: dict[str, list[EndedWait]] = defaultdict(list)
        """Conditions that have come, by the script that waited for them."""
        self._fault_acts: dict[str, list[Act]] = defaultdict(list)
        """Those that set or clear a fault, by its name."""
        self._fault_times: dict[str, list[Nanos]] = defaultdict(list)
        """Moments at which faults acted, by name."""
        self._holds: dict[str, list[Hold]] = defaultdict(list)
        self._replaced: dict[str, Nanos] = {}
        """When the program of a controller was last replaced by a download."""
        self._keeping: dict[str, dict[StatementLocation, bool]] = defaultdict(dict)
        """Whether statements may change points without an event, by controller."""
        self._events = 0
        self.inputs = 0
        """Number of inputs that were applied."""
        for record in world.trace if not self.begin else _plans(world):
            self._take(record)
        world.trace.stop()  # it is noted here
        began = {fault.name: fault.begin for fault in parts.faults.active}
        for owner in (*parts.faults.controllers, *parts.faults.elements):
            for signal, held in parts.faults.held(owner).items():
                self._holds[signal].append(Hold(began.get(held.fault, self.begin), held))
        self._built = {group: len(records) for group, records in self.records.items()}
        self.points, self.rates = points.NotedPoints(world, lambda: self._order + 7), NotedRates(world)
        self.actions, self.states = NotedActions(world), ProgramStates(world, self._order_of)
        world.trace.subscribers.append(self._take)
        world.act_subscribers.append(self._act)
        world.until_subscribers.append(self._went_on)
        parts.faults.act_subscribers.append(self._fault_acted)
        self._note_statements()

    def _note_statements(self) -> None:
        for name, programs in self.world.programs.items():
            begun = (programs.location(number) for number in programs.begun(self.begin))
            present = (frame.location for frame in programs.stack(self.begin)[:1])
            for location in begun if not self.begin else present:
                if location is not None:
                    self._executes(name, self.begin, location)
            programs.add_hook(self._hook(name, programs))

    def reaches_begin(self) -> bool:
        """Whether it has everything since the beginning of the world; where it has not, what was before is noted as lacking."""
        self.lack()
        return not self.begin

    def lack(self) -> None:
        """Note that something before the log decides, if anything was there."""
        if self.begin:
            self.lacking.lack(self.begin)

    def covers(self, moment: Nanos) -> bool:
        """Whether everything at a moment is noted."""
        return (self.begin < moment or not self.begin) and moment <= self.world.now

    def was_before(self, change: Change) -> bool:
        """Whether a plan was in force when the log began, after the beginning of the world."""
        return self.begin > 0 and change.position < self._built.get(change.group, 0)

    def run(self, inputs: Sequence[RecordedInput], end: Nanos) -> Iterator[None]:
        """Go on to the moment ``end``, in parts, with all inputs since the beginning of the log. Raises `Misuse` for inputs that
        do not fit."""
        for is_input in in_parts(self.world, inputs[self.inputs :], end):
            self.inputs += is_input
            self._check_size()
            yield

    @property
    def noted(self) -> int:
        """The number of records, actions and statements."""
        return self._events + sum(map(len, self.executed.values()))

    def _count(self) -> None:
        self._events += 1
        if self._events > self._most:
            self._check_size()

    def _check_size(self) -> None:
        if self.noted > self._most:
            raise Misuse(TOO_MUCH_TO_SEARCH(most=self._most, begin=self.begin / SECOND))

    def _take(self, record: TraceRecord) -> None:
        self._count()
        group, order = self._group_of.get(record.controller, -1), self._order
        records = self.records[group]
        match record.kind:
            case "edge":
                signal = self.signal_of(record)
                order = self._before_events(record, (record.controller,)) if self._is_input(record, signal) else order
                self.meetings.sees(signal, record.time)
                self.changes[signal].append(Change(record.time, record.level(), group, len(records), order))
            case "plan":
                self.plans[record.controller, record.subject].append(Change(record.time, 0.0, group, len(records), order))
            case "coordinate":
                self.origins[record.controller, record.subject].append(Change(record.time, 0.0, group, len(records), order))
            case "frame":
                first = self._before_events(
                    record, [name for name, on in self.world.objects.line_of.items() if on[0].name == record.controller]
                )
                order = first if first < order - 8 else order
                self.frames.take(record, order)
                for name in self._timed.get(record.controller, ()):
                    self.points.executes(name, record.time, keeps=True)
            case "event" if record.subject in (*OF_MECHANICS, WORKPIECE):
                self._note_event(record, Change(record.time, 0.0, group, len(records), order))
            case "event" if record.subject in BEGINS:
                self.begins[record.controller].append(Change(record.time, 0.0, group, len(records), order))
            case "event":
                axis = str(dict(record.facts).get("axis", ""))
                self.axis_events[record.controller, axis].append(Change(record.time, 0.0, group, len(records), order))
                executed = self.executed.get(record.controller)
                if record.subject == WRONG_DATA and executed and executed.times[-1] == record.time:
                    executed.refused.add(len(executed) - 1)
            case "fault":
                self.faults[record.controller].append(Change(record.time, 0.0, group, len(records), order))
                self._note_holds(record.controller, record.time)
        records.append(record)
        self._orders[group].append(order)

    def _note_event(self, record: TraceRecord, event: Change) -> None:
        facts = dict(record.facts)
        element = str(facts["element"])
        if record.subject == WORKPIECE:
            for name in (WORKPIECE, element, str(facts["workpiece"])):
                self.events[name].append(event)
            if facts["what"] == STANDS:
                self.meetings.stands(element, str(facts["workpiece"]), record.time)
        if record.subject in OF_MECHANICS or facts["what"] in JAMS:
            self.mechanics[element].append(event)
        if record.subject == "collision":
            one, other = (str(getattr(record.value, "values", {}).get(part, "")) for part in ("one", "other"))
            self.meetings.touch(element, (one, *other.split(", ")) if one and other else (), record.time)

    def _order_of(self, controller: str, now: Nanos, state: ProgramState) -> int:
        """The order of a change of a program: before the first statement that it lets be executed, after the one that ends it."""
        executed = self.executed[controller]
        first = bisect_left(executed.times, now)
        goes_on = state is ProgramState.RUNS and first < len(executed)
        return executed.orders[first] - 2 if goes_on else self._order + 6

    @property
    def _order(self) -> int:
        """The order of what was noted last."""
        return 8 * self._events

    def _is_input(self, record: TraceRecord, signal: str) -> bool:
        """Whether an edge of a pin came from outside its controller."""
        pin, parts = PinName(record.controller, record.subject), self.world.objects
        if record.subject not in self._pins.get(record.controller, ()):
            return False
        if pin in parts.driven or pin in parts.circuits or parts.scheduler_of[pin.controller].wire_to(pin) is not None:
            return True
        return bool(self.acts) and self.acts[-1].time == record.time and sets(self.acts[-1], pin)

    def _before_events(self, record: TraceRecord, owners: Collection[str]) -> int:
        """The order of an edge of an input or of a frame, recorded after the statements and events that it led to."""
        group, events = self._group_of.get(record.controller, -1), self._events - 1
        for order, earlier in self.at(group, record.time):
            is_led_to = earlier.kind == "event" and earlier.subject not in (*OF_MECHANICS, WORKPIECE)
            if order != 8 * events or not is_led_to or earlier.controller not in owners:
                break
            events -= 1
        return 8 * events + 1

    def _note_holds(self, owner: str, now: Nanos) -> None:
        held = self.world.objects.faults.held(owner)
        for signal in (*held, *(name for name in self._holds if name.startswith(f"{owner}.") and name not in held)):
            holds = self._holds[signal]
            if (holds[-1].held if holds else None) != held.get(signal):
                holds.append(Hold(now, held.get(signal), self._order))

    def _fault_acted(self, active: ActiveFault, now: Nanos, *, begins: bool) -> None:
        if begins:
            self._fault_times[active.name].append(now)

    def _act(self, script: str, what: ExternalInput) -> None:
        self.world.sync_all()
        self._count()
        fault = self.world.objects.faults.name_of(what.fault) if isinstance(what, do.SetFault) else ""
        act = Act(self.world.now, script, what, self._order, self._led_by(script, what), fault)
        self.acts.append(act)
        match what:
            case do.SetFault():
                self._fault_acts[fault].append(act)
            case Download(controller=controller):
                self._replaced[controller] = self.world.now
                self._keeping[controller].clear()
            case do.ClearFault(name):
                self._fault_acts[name].append(act)
                for holds in self._holds.values():
                    if (held := holds[-1].held) is not None and held.fault == name:
                        holds.append(Hold(self.world.now, None, self._order))

    def _went_on(self, script: str, condition: str) -> None:
        self.world.sync_all()
        self._count()
        self._waits[script].append(EndedWait(self.world.now, self._order, condition))

    def _led_by(self, script: str, what: ExternalInput) -> str:
        """The script that led to an action of another one: the one that pressed a button for some time."""
        if not (isinstance(what, do.Release) and is_release(script)):
            return script
        pressed = (act.by for act in reversed(self.acts) if isinstance(act.what, do.Press) and act.what.button == what.button)
        return next(pressed, script)

    def _executes(self, name: str, now: Nanos, location: StatementLocation) -> None:
        executed = self.executed[name]
        executed.times.append(now)
        executed.locations.append(location)
        executed.orders.append(self._order + 4)

    def _hook(self, name: str, programs: Programs) -> StatementHook:
        executed = self.executed[name]
        add_time, add_location, add_order = executed.times.append, executed.locations.append, executed.orders.append
        location_of, keeping, points = programs.location, self._keeping[name], self.points
        before = False
        """Whether the last statement may have changed points."""

        def hook(now: Nanos, number: int) -> None:
            nonlocal before
            location = location_of(number)
            if location is None:
                given = programs.given(number)
                if given is None:
                    return
                location = StatementLocation(given.code, -1 - number)
                self.given[name, location] = given.use
            add_time(now)
            add_location(location)
            add_order(8 * self._events + 4)
            keeps = keeping.get(location)
            if keeps is None:
                use = self.given.get((name, location))
                keeps = keeping[location] = (programs.use(location) if use is None else use).keeps
            if keeps or before:
                points.executes(name, now, keeps=keeps)
                before = keeps

        return hook

    # ------------------------------------------------------------------ questions

    def signal_of(self, record: TraceRecord) -> str:
        """The name of what has an edge: ``table.OUT1``, ``valve.out``, or the channel of a contact."""
        is_pin = record.subject in self._pins.get(record.controller, ())
        return f"{record.controller}.{record.subject}" if is_pin else record.subject

    def is_recorded(self, signal: str) -> bool:
        """Whether every change of a signal is noted."""
        owner, _, pin = signal.partition(".")
        return pin in self._pins.get(owner, ()) or self.has(signal) or self.points.series(signal) is not None

    def has(self, signal: str) -> bool:
        """Whether it is the name of something with edges."""
        return signal in self.first_levels or signal in self.changes

    def level(self, signal: str, now: Nanos) -> float:
        """The level of a signal at a moment."""
        series = self.points.series(signal)
        if series is not None:
            return points.level(series, now)
        last = self.last_change(signal, now)
        return self.first_levels.get(signal, 0.0) if last is None else last.value

    def events_at(self, time: Nanos) -> Iterator[Change]:
        """The events of workpieces at a moment, the last one first."""
        return takewhile(lambda one: one.time == time, self.events_before(WORKPIECE, Change(time, 0.0, -1, 0, LAST)))

    def events_before(self, name: str, event: Change) -> Iterator[Change]:
        """The events of a workpiece, or at an element, before another one, the last one first."""
        return (one for one in reversed(self.events.get(name, ())) if (one.time, one.order) < (event.time, event.order))

    def last_event(self, name: str, until: Nanos, before: int = LAST, what: str = "") -> Change | None:
        """The last event of a workpiece, or at an element, by a moment, before an order; of a kind, if that is given."""
        found = (one for one in reversed(self.events.get(name, ())) if (one.time, one.order) < (until, before))
        return next((one for one in found if not what or ("what", what) in self.record(one).facts), None)

    def last_axis_event(self, controller: str, axis: str, until: Nanos, before: int = LAST) -> Change | None:
        """The last event of a controller about an axis by a moment, before an order."""
        return _last(self.axis_events.get((controller, axis), ()), until, before)

    def last_origin(self, controller: str, axis: str, until: Nanos, before: int = LAST) -> Change | None:
        """When an axis last got another coordinate without a motion by a moment, before an order; not at the beginning."""
        found = _last(self.origins.get((controller, axis), ()), until, before)
        return None if found is None or (self.reaches_begin() and found.time == self.begin) else found

    def last_begin(self, controller: str, until: Nanos, before: int) -> Change | None:
        """When a program last began anew by a moment, before an order, if it was not there from the beginning: an event of
        `BEGINS`, or a start without one, which has no position."""
        starts = [Change(one.time, 0.0, self.group(controller), -1, one.order) for one in self.states.starts(controller)]
        found = (_last(starts, until, before), _last(self.begins.get(controller, ()), until, before))
        return max((one for one in found if one is not None), key=lambda one: (one.time, one.position >= 0), default=None)

    def last_change(self, signal: str, until: Nanos, before: int = LAST) -> Change | None:
        """The last change of a signal by a moment, before an order."""
        return _last(self.changes.get(signal, []), until, before)

    def changes_before(self, signal: str, until: Nanos, before: int = LAST) -> Iterator[Change]:
        """The changes of a signal by a moment, before an order, the last one first."""
        changes = self.changes.get(signal, ())
        last = bisect_left(changes, (until, before), key=lambda change: (change.time, change.order)) - 1
        return (changes[index] for index in range(last, -1, -1))

    def last_fault(self, owner: str, until: Nanos, before: int) -> Change | None:
        """When a fault of a controller or element last began or ended by a moment, before an order."""
        last = _last(self.faults.get(owner, []), until, before)
        if last is None:
            self.lack_faults()
        return last

    def last_of(self, controller: str, locations: Collection[StatementLocation], before: int) -> int | None:
        """The number of the last one of some statements that was executed, and not refused, before a number."""
        executed, refused = self.executed[controller].locations, self.executed[controller].refused
        return next((one for one in range(before - 1, -1, -1) if executed[one] in locations and one not in refused), None)

    def executed_before(self, controller: str, locations: Collection[StatementLocation]) -> Nanos | None:
        """When one of some statements was last executed before the log, as far as that is known."""
        if any(one.number < 0 for one in locations):  # it came over a line: none like it is known before
            self.lack()
        locations = [one for one in locations if one.number >= 0]
        if not self.begin or not locations:
            return None
        return self.before(f"{EXECUTED}{json.dumps([controller, *sorted(locations)])}").since

    def never_happened(self, *names: str) -> bool:
        """Whether none of `steptwin.simulation.world.snapshotlog.happenings` was before the log. If one was, that decides."""
        found = self.before(f"{HAPPENED}{', '.join(names)}")
        if found.since is not None:
            self.lack()
        return found == NEVER

    def lack_faults(self) -> None:
        """Note that something which faults did before the log decides, if they did anything."""
        if any(acts.first <= self.begin for acts in self.world.objects.faults.acts.values()):
            self.lack()

    def hold(self, signal: str, at: Nanos, before: int = LAST) -> Hold | None:
        """Cause that holds a signal at a moment, before an order, and since when."""
        last = next((hold for hold in reversed(self._holds.get(signal, ())) if hold.time <= at and hold.order < before), None)
        return None if last is None or last.held is None else last

    def holding(self, at: Nanos) -> set[str]:
        """The faults that hold signals at a moment."""
        holds = (self.hold(signal, at) for signal in self._holds)
        return {hold.held.fault for hold in holds if hold is not None and hold.held is not None}

    def changes_in(self, signal: str, after: Nanos, until: Nanos) -> Iterator[Nanos]:
        """The moments at which a signal took another value, after one until another."""
        series = self.points.series(signal)
        if series is not None:
            return points.changes(series, after, until)
        changes = self.changes.get(signal, [])
        first, last = (bisect_right(changes, moment, key=lambda change: change.time) for moment in (after, until))
        return (change.time for change in changes[first:last] if not self.is_first(signal, change))

    def is_first(self, signal: str, change: Change) -> bool:
        """Whether a signal has a level because the world began with it."""
        is_same = change is self.changes[signal][0] and change.value == self.first_levels.get(signal, 0.0)
        return is_same or change.position < self._built.get(change.group, 0)

    def is_in_progress(self, executed: Executed) -> bool:
        """Whether a statement was in execution when the log began, after the beginning of the world."""
        return executed == self.executed[executed.controller][0] and not self.reaches_begin()

    def since(self, signal: str, until: Nanos) -> Nanos | None:
        """Since when a signal has the level of a moment; None: from the beginning."""
        series = self.points.series(signal)
        if series is not None:
            since = points.since(series, until)
        else:
            last = self.last_change(signal, until)
            since = None if last is None or self.is_first(signal, last) else last.time
        return self.before(signal).since if since is None else since

    def before(self, asked: str) -> Found:
        """The last change of a signal or condition before the log, as far as it is known."""
        found = NEVER if not self.begin else self.lacking.change(asked, self.begin)
        if found.since is None and found.known_from:
            self.lacking.lack(found.known_from)
        return found

    def plans_in_force(self, controller: str, axis: str, at: Nanos, before: int = LAST) -> Iterator[Change]:
        """The plan of an axis that is in force at a moment, before an order; of each axis, if ``axis`` is empty."""
        for (name, number), plans in self.plans.items():
            if name == controller and axis in ("", number) and (plan := _last(plans, at, before)) is not None:
                yield plan

    def order(self, group: int, position: int) -> int:
        """The order of a record."""
        return self._orders[group][position]

    def record(self, change: Change) -> TraceRecord:
        return self.records[change.group][change.position]

    def at(self, group: int, time: Nanos) -> Iterator[tuple[int, TraceRecord]]:
        """The records of a group at a moment, with their orders, the last one first."""
        records, orders = self.records[group], self._orders[group]
        for position in range(bisect_right(records, time, key=lambda record: record.time) - 1, -1, -1):
            if records[position].time < time:
                break
            yield orders[position], records[position]

    def group(self, name: str) -> int:
        """The group of a controller, line or element."""
        return self._group_of.get(name, -1)

    def acts_at(self, time: Nanos, before: int) -> Iterator[Act]:
        """Acts of scripts and from outside at a moment, before an order, the last one first."""
        return takewhile(lambda act: act.time == time, self.acts_before(time, before))

    def acts_before(self, until: Nanos, before: int) -> Iterator[Act]:
        """Acts of scripts and from outside by a moment, before an order, the last ones first."""
        last = bisect_left(self.acts, (until, before), key=lambda act: (act.time, act.order)) - 1
        return (self.acts[index] for index in range(last, max(-1, last - MOST_LOOKED_BACK), -1))

    def waits_before(self, script: str, until: Nanos, before: int) -> Iterator[EndedWait]:
        """The waits of a script that ended by a moment, before an order, the last one first."""
        return (one for one in reversed(self._waits.get(script, ())) if (one.time, one.order) < (until, before))

    def setting(self, name: str, until: Nanos) -> Act | None:
        """The last act by a moment that set a fault; None if its description does."""
        acts = (act for act in reversed(self._fault_acts.get(name, ())) if act.time <= until)
        by = next((act for act in acts if isinstance(act.what, do.SetFault)), None)
        if by is None:
            self.lack()
        return by

    def fault_record(self, name: str, until: Nanos) -> TraceRecord | None:
        """The last record by a moment with which a fault began, never that of its end; its first one, where that is not known."""
        began = [time for time in self._fault_times.get(name, ()) if time <= until]
        latest = began[-1] if began else until
        records = (self.record(one) for changes in self.faults.values() for one in changes if one.time <= latest)
        active = self.world.objects.faults.find(name)
        end = None if active is None else active.end
        its = sorted((one for one in records if one.subject == name and one.time != end), key=lambda one: one.time)
        found = next((one for one in reversed(its) if one.time in began), None)
        if found is None and its:
            self.lack()
        return its[0] if found is None and its else found

    def fault_act(self, name: str, until: Nanos, before: int) -> Act | None:
        """The last act by a moment, before an order, that set or cleared a fault."""
        acts = (act for act in reversed(self._fault_acts.get(name, ())) if (act.time, act.order) < (until, before))
        return next(acts, None)

    def position(self, group: int, time: Nanos) -> int:
        """The number of the records of a group until the end of a moment."""
        return bisect_right(self.records[group], time, key=lambda record: record.time)

    def is_of_present_text(self, executed: Executed) -> bool:
        """Whether the text of a statement is still in its controller."""
        programs = self.world.programs[executed.controller]
        return executed.time > self._replaced.get(executed.controller, -1) and executed.location.text in programs.texts

    def last_executed(self, controller: str, until: Nanos) -> int:
        """The number of the last statement of a controller by a moment; -1 if there is none."""
        return self.executed[controller].last(until)


def words_of(event: TraceRecord) -> MessageText:
    """The text of an event."""
    return text_of(event.value if isinstance(event.value, str) else str(event.value))


def on_timed_lines(world: Simulation) -> Mapping[str, Sequence[str]]:
    """The controllers on each line with timing, whose registers change at the moment of a frame without another event."""
    found: dict[str, list[str]] = defaultdict(list)
    for name, (line, _) in world.objects.line_of.items():
        if line.is_timed:
            found[line.name].append(name)
    return found


def sets(act: Act, pin: PinName) -> bool:
    """Whether an action gives a pin a level."""
    match act.what:
        case do.Set(levels):
            return any(controller == pin.controller and name.upper() == pin.pin for controller, name, _ in levels)
    return False


def _last(changes: Sequence[Change], until: Nanos, before: int) -> Change | None:
    index = bisect_left(changes, (until, before), key=lambda change: (change.time, change.order))
    return changes[index - 1] if index else None


def in_parts(world: Simulation, inputs: Sequence[RecordedInput], end: Nanos) -> Iterator[bool]:
    """`replay` in parts that are short for the programs of the world, too."""
    times = [programs.statement_time for programs in world.programs.values() if programs.statement_time]
    return replay(world, inputs, end, min(SLICE_NS, STATEMENTS_AT_ONCE * min(times, default=SLICE_NS)))


def levels_of(world: Simulation) -> dict[str, float]:
    """The present levels of all that has edges: pins, outputs of elements, contacts."""
    found = {
        f"{name}.{pin}": world.objects.scheduler_of[name].level(PinName(name, pin))  # a fault may hold an output
        for name, controller in world.controllers.items()
        for pin in controller.pins()
    }
    for kind, parts in world.objects.elements.items():
        if ELEMENTS[kind].terminals is not None:
            for name, part in parts.items():
                found |= {f"{name}.{output.lower()}": part.block.levels[output] for output in part.block.outputs}
    contacts = [contact for circuit in world.objects.circuits.values() for contact in circuit.contacts if contact.channel]
    return found | {contact.channel: float(contact.level) for contact in contacts}


def _plans(world: Simulation) -> Iterator[TraceRecord]:
    """The plans in force."""
    for name, controller in world.controllers.items():
        for number, drive in enumerate(controller.axes, start=1):
            yield TraceRecord(world.now, name, "plan", str(number), drive.plan)
