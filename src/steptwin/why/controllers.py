"""The causes of what happens in controllers: statements, requests, actions, inputs."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from steptwin.controller import Nanos
from steptwin.messages import Message, MessageText
from steptwin.simulation.faults.controller import REFUSED_REQUEST
from steptwin.simulation.faults.kinds_physics import NO_SUPPLY
from steptwin.simulation.faults.port import TOWARDS_THE_TWIN
from steptwin.simulation.kinds.lines import SCRIPTS
from steptwin.simulation.kinds.programs import ProgramState, Resource, ResourceKind
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.scheduler.wires import PinName
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import Halt
from steptwin.simulation.world.inputs import Bytes, Download, See, SetVariable
from steptwin.why.answer import ChainLink, Cover
from steptwin.why.chain import Cause, FoundCause, Place, along, covered, nothing
from steptwin.why.log import BEGINS, LAST, MOST_LOOKED_BACK, Change, Executed, words_of
from steptwin.why.programstates import OVER, StateChange
from steptwin.why.roots import Act, Sent
from steptwin.why.scripts import FROM_OUTSIDE, acted
from steptwin.why.sentences import SENDS, SENDS_TO
from steptwin.wire.crc import with_crc

CLIENT = Message("why.client", "client {client}: {meaning}")
STOPPED_WHERE = Message("why.stopped-where", "{event}: {level}")
NOT_ENABLED = "drive-off"
"""Event of an axis that ignored a command because it is not enabled."""
HOMED = "homed"
"""Event of an axis that is at its home position."""
POSITION_ERROR = "position-error"
"""Event of an axis that did not reach its position."""
NOT_HEARD = Message("why.not-heard", "`{command}` was sent while {controller} was not selected{heard}")
HEARD_BY = Message("why.heard-by", ", but {names}")
REFUSED = Message("why.refused", "{request}: refused, {reason}")
WRONG_CHECKSUM = Message("why.wrong-checksum", "{request}: not heard, its check sum is wrong")
NOT_STARTED_SINCE = Message("why.not-started-since", "{event}, and nothing has started the program since")
BEGAN_ANEW = Message("why.began-anew", "{event}, and the program began anew")
NOT_SWITCHED_ON_SINCE = Message("why.not-switched-on-since", "{event}, and nothing has switched {name} on since")
NOT_COMMANDED_SINCE = Message("why.not-commanded-since", "{event}, and nothing has commanded {axis} to move since")
REQUEST = Message("why.request", "request: {meaning}")


LEAST_FRAME = 4
"""Bytes of the shortest frame: unit, function, check sum."""
_AXIS = re.compile(r"(?:M|ENC)(\d+)[._]|moving$", re.IGNORECASE)
"""A point that a motion changes; the group is the number of its axis, none where the controller has one only."""


class ControllerCauses:
    """Finds the causes of changes in controllers. ``causes`` has those of everything else."""

    def __init__(self, causes: Any) -> None:  # Causes, which imports this module
        self._all = causes
        self._log = causes.log
        self._world = causes.log.world

    def at_moment(self, controller: str, time: Nanos, wanted: Resource | None, point: str = "") -> FoundCause:
        """Cause of a change in a controller that no record shows; ``point``: of that point of it."""
        change = self._moment(controller, time, point)
        if wanted is not None and wanted.kind is ResourceKind.ENCODER:
            return self.commanded(controller, change, wanted, point) or self._all.axes.counted(controller, wanted.name, time)
        if wanted is not None and point.upper().replace(".", "_") == f"M{wanted.name}_STATUS":
            stays = self._all.axes.not_beyond(controller, wanted.name, time, time - 1)
            if stays is not None:
                return stays
        found = self.in_controller(controller, change, wanted, point)
        if wanted is not None and wanted.kind is ResourceKind.AXIS:
            found = self._all.axes.followed(controller, wanted.name, time, LAST, found)
        if found is None and wanted is not None:
            return self._all.axes.motion(controller, wanted.name, time)
        return found

    def _moment(self, controller: str, time: Nanos, point: str) -> Change:
        """A change of a point of a controller that no record shows."""
        group, order = self._log.group(controller), self._log.points.order_of(f"{controller}.{point}", time)
        return Change(time, 0.0, group, self._log.position(group, time), LAST if order is None else order)

    def commanded_at(self, controller: str, time: Nanos, wanted: Resource, point: str) -> FoundCause:
        """The command at the moment of a change of a point, or the request before it that is answered then."""
        change = self._moment(controller, time, point)
        return self.commanded(controller, change, wanted) or self._asked_before(controller, change)

    def in_controller(self, controller: str, change: Change, wanted: Resource | None, point: str = "") -> FoundCause:
        """Cause of a change in a controller at a moment; ``wanted``: the resource, if it is known; ``point``: that changed."""
        found = self._limit(controller, change, wanted) or self.commanded(controller, change, wanted, point)
        if found is not None:
            is_other = point and wanted is None and _name_of(point).search(found.link.text) is None
            alarm = self._all.programs.alarm(controller, change.time) if is_other else None
            return alarm if alarm is not None and alarm.place.time == change.time else found
        return self._asked_before(controller, change) or self._inside(controller, change, wanted)

    def _limit(self, controller: str, change: Change, wanted: Resource | None) -> FoundCause:
        """The limit switch that stopped an axis at the moment of a change."""
        if wanted is None or wanted.kind is not ResourceKind.AXIS:
            return None
        event = self._log.last_axis_event(controller, wanted.name, change.time)
        if event is None or event.time < change.time or event.order > change.order or self._pin_of(controller, event) is None:
            return None
        return self.axis_event(controller, event, Place(event.time, min(event.order, change.order), -1))

    def _pin_of(self, controller: str, event: Change) -> str | None:
        """The pin because of which an event about an axis came: of its limit switch, or the one that enables it."""
        record = self._log.record(event)
        axis = dict(record.facts).get("axis")
        if record.subject == NOT_ENABLED:
            every = range(1, len(self._world.controllers[controller].axes) + 1)  # a motion of several is one of the first axes
            enables = [f"{controller}.M{one}_EN" for one in (every if axis is None else (axis,))]
            return next((pin for pin in enables if not self._log.level(pin, event.time)), None)
        if record.subject == HOMED:
            return self._home_pin(controller, event, str(axis))
        values = words_of(self._log.record(event)).values
        axes: Any = getattr(getattr(self._world.controllers[controller], "config", None), "axes", ())
        if not axes or "limit" not in values:
            return None
        number = getattr(axes[int(values["axis"]) - 1], f"in_{values['limit']}".lower(), -1)
        pin = f"{controller}.IN{number + 1}"
        return pin if self._log.has(pin) else None

    def _home_pin(self, controller: str, event: Change, axis: str) -> str | None:
        """The pin of the switch on which an axis stood already when it was homed."""
        on: list[str] = []
        for switch in self._world.kind(controller).end_switches(self._world.controller(controller)):
            pin = f"{controller}.{switch.pin}"
            since = self._log.since(pin, event.time)
            if str(switch.axis) == axis and self._log.level(pin, event.time) == switch.active and since != event.time:
                on.append(pin)
        return on[0] if len(on) == 1 else None

    def axis_event(self, controller: str, event: Change, place: Place) -> Cause:
        """An event about an axis, such as a stop by a limit switch that came or was there already, or an ignored command."""
        record, pin = self._log.record(event), self._pin_of(controller, event)
        said, wanted = words_of(record), Resource(ResourceKind.AXIS, str(dict(record.facts).get("axis", "")))

        def before() -> FoundCause:
            led = self.commanded(controller, event, wanted) or self._asked_before(controller, event)
            led = led or self._earlier(controller, event.time, wanted)
            axes, name = self._all.axes, wanted.name
            was_moving = led is None and name and axes.is_moving(controller, name, event.time - 1)
            return axes.motion(controller, name, event.time - 1, axes.driven(controller, name) or "") if was_moving else led

        def besides() -> Iterator[Cause]:
            came = None if pin is None else covered(self._all.last((pin,), place.time, before=place.order), Cover.LEVEL)
            if came is None and pin is not None:
                wanted_pin = Resource(ResourceKind.PIN, pin.removeprefix(f"{controller}."))
                came = self._all.programs.before(controller, wanted_pin, event.time)
            if came is not None and pin is not None:
                on = Resource(ResourceKind.PIN, pin.removeprefix(f"{controller}."))
                again = self.begun_in_vain(controller, on, came.place.time, event.time)
                yield from (came,) if again is None else (came, again)

        text = said if pin is None else STOPPED_WHERE(event=said, level=self._all.state(pin, event.time))
        return Cause(ChainLink(event.time, controller, text), place, before, besides=besides)

    def commanded(self, controller: str, change: Change, wanted: Resource | None, point: str = "") -> FoundCause:
        """A statement, request or action at the moment of a change in a controller."""
        index = self._statement_at(controller, change, wanted)
        since = -1 if index is None else self._log.executed[controller][index].order
        outside = self._from_outside(controller, change, since, point)
        if outside is not None:
            return outside
        if index is not None:
            return self._all.programs.statement(controller, index)
        act = next((act for act in self._log.acts_at(change.time, change.order) if _changes(act, controller)), None)
        return None if act is None else self._all.scripts.acted(act)

    def acts_by(self, controller: str, plan: Change, axis: str) -> Sequence[Resource]:
        """The things by which the command of a plan of an axis acts, besides its value."""
        index = self._statement_at(controller, plan, Resource(ResourceKind.AXIS, axis))
        if index is not None:
            return self._all.programs.use(controller, index).acts_by
        found, registers = self.commanded(controller, plan, None), self._world.kind(controller).registers
        if found is None or registers is None:
            return ()
        return [
            one for name, use in registers.uses(axis).items() if _name_of(name).search(found.link.text) for one in use.acts_by
        ]

    def made_by(self, controller: str, plan: Change) -> Iterator[Cause]:
        """The statements that gave a plan of an axis the values by which it is made."""
        index = self._statement_at(controller, plan, Resource(ResourceKind.AXIS, ""))
        for one in () if index is None else self._all.programs.use(controller, index).made_by:
            found = self._all.programs.resource(controller, one, index, plan.time, plan.order)
            if found is not None:
                yield found

    def register(self, controller: str, name: str, wanted: Resource | None, until: Nanos, before: int = LAST) -> FoundCause:
        """The last change of a register of a controller by a moment, before an order, as far as its values are noted."""
        signal = f"{controller}.{name}"
        since = None if self._log.points.series(signal) is None else self._log.since(signal, until)
        if since is None:
            return None
        there = self._all.of(since)
        if there is not self._all:
            return None if there is None else there.controllers.register(controller, name, wanted, since)
        group = self._log.group(controller)
        change = Change(since, 0.0, group, self._log.position(group, since), before if since == until else LAST)
        return covered(self.in_controller(controller, change, wanted, name), Cover.LEVEL)

    def written(self, controller: str, name: str, until: Nanos, before: int = LAST) -> FoundCause:
        """The last request or action by a moment, before an order, that wrote a register of a controller."""
        on, pattern, group = self._world.objects.line_of.get(controller), _name_of(name), self._log.group(controller)
        if on is None:
            acts = (act for act in self._log.acts_before(until, before) if _changes(act, controller) and _names(act, name))
            act = next(acts, None)
            return None if act is None else covered(self._all.scripts.acted(act), Cover.LEVEL)
        last = self._log.position(group, until)
        for position in range(last - 1, max(-1, last - MOST_LOOKED_BACK), -1):
            record, order = self._log.records[group][position], self._log.order(group, position)
            if record.kind == "frame" and order < before and self._is_for(controller, record, order):
                found = self._frame(record, order)
                if pattern.search(found.link.text):
                    return covered(found, Cover.LEVEL)
        return None

    def _is_for(self, controller: str, record: TraceRecord, order: int) -> bool:
        """Whether a frame is a request that may change a controller, and was not refused."""
        return self._is_to(controller, record, order) and order not in self._log.frames.refused

    def _is_to(self, controller: str, record: TraceRecord, order: int) -> bool:
        """Whether a frame asks a controller for a change."""
        on = self._world.objects.line_of.get(controller)
        return on is not None and record.controller == on[0].name and on[1] in self._log.frames.requests.get(order, ())

    def refused(self, controller: str, names: Collection[str], until: Nanos, before: int = LAST, after: Nanos = -1) -> FoundCause:
        """The last refused request by a moment, before an order and after another moment, that would have written one of these
        registers of a controller."""
        patterns = [_name_of(name) for name in names]
        for found in self._not_taken(controller, until, before, after):
            if any(pattern.search(found.link.text) for pattern in patterns):
                return covered(found, Cover.LEVEL)
        if after < self._log.begin and controller in self._world.objects.line_of:
            self._log.lack()  # a request may have been refused before
        return None

    def _not_taken(self, controller: str, until: Nanos, before: int, after: Nanos) -> Iterator[Cause]:
        """Requests to a controller between two moments, before an order, that it refused or that came with a wrong check sum, the
        last one first."""
        on, found = self._world.objects.line_of.get(controller), list[Cause]()
        for order, (request, reason) in self._log.frames.refused.items():
            if self._is_to(controller, request, order):
                one = self._frame(request, order)
                found.append(one._replace(link=replace(one.link, text=REFUSED(request=one.link.text, reason=reason))))
        for act in self._log.acts_before(until, before) if on is not None else ():
            what = act.what
            if on is not None and isinstance(what, Bytes) and what.line == on[0].name and _is_spoilt(what, on[1]):
                text = WRONG_CHECKSUM(request=CLIENT(client=what.place, meaning=self.sends(what, act.time)))
                link = ChainLink(act.time, what.line, text)
                sends = SENDS(data=self.sends(what, act.time), place=what.place)
                found.append(Cause(link, Place(act.time, act.order, 1), partial(self._all.scripts.acted, act, sends)))
        found.sort(key=lambda one: one.place, reverse=True)
        return (one for one in found if after < one.place.time <= until and one.place.order < before)

    def sends(self, what: Bytes, time: Nanos) -> str:
        """The request of a client in words, whether or not it comes so."""
        return self._log.frames.words(what.line, f"{what.place}/sent", what.data, time)

    def altered(self, record: TraceRecord) -> MessageText | str | None:
        """The request to controllers of a line that a fault altered or lost, as it was sent, in words; None for another fault."""
        line, places = record.controller, getattr(record.value, "values", {}).get("place", ())
        if line not in self._world.lines or TOWARDS_THE_TWIN.id not in [one["id"] for one in places if isinstance(one, dict)]:
            return None
        members = {name for name, (on, _) in self._world.objects.line_of.items() if on.name == line}
        for act in self._log.acts_before(record.time, LAST):
            if isinstance(act.what, Bytes) and act.what.line == line and act.what.place in places:
                return self.sends(act.what, act.time)
            if SCRIPTS in places and _requests(act, line, members):
                return acted(act).link.text
        return None

    def not_served(self, record: TraceRecord) -> MessageText | None:
        """A fault by which a controller served no request, with who sent that, in words; None for another fault, or where that is
        not known."""
        on, text = self._world.objects.line_of.get(record.controller), record.value
        if on is None or not isinstance(text, MessageText) or text.id != REFUSED_REQUEST.id:
            return None
        asked = bytes.fromhex(str(text.values["bytes"]))
        for order, request in reversed(self._log.frames.sent.items()):
            if request.controller == on[0].name and request.time <= record.time and asked in request.data():
                sent = self._frame(request, order)
                by = sent.before() or sent
                return REFUSED_REQUEST(what=text.message("what") or text.values["what"], bytes=by.link.text)
        return None

    def unheard(self, controller: str, wanted: Resource | None, until: Nanos, after: Nanos = -1) -> FoundCause:
        """The last frame between two moments with a command that would have changed something, and that a controller did not
        hear, with the one that had chosen others to listen."""
        on, frames, programs = self._world.objects.line_of.get(controller), self._log.frames, self._world.programs.get(controller)
        beside = sum(line is on[0] for line, _ in self._world.objects.line_of.values()) if on is not None else 0
        if on is None or programs is None or beside < 2 or self._world.kind(controller).registers is not None:
            return None
        for order, record in reversed(frames.sent.items()):
            if record.controller != on[0].name or record.time > until or on[1] in frames.requests.get(order, ()):
                continue
            if record.time <= after:
                return None
            given = next((one for one in programs.commands(record.data()) if _matches(one.use.writes, wanted)), None)
            if given is not None:
                chose = max((one for one in frames.selecting if one < order), default=None)
                led = [] if chose is None else [covered(self._frame(frames.selecting[chose], chose), Cover.LEVEL)]
                units = frames.requests.get(order, ())
                heard = ", ".join(
                    name for name, (line, unit) in self._world.objects.line_of.items() if line is on[0] and unit in units
                )
                text = NOT_HEARD(command=given.code, controller=controller, heard=HEARD_BY(names=heard) if heard else "")
                link = ChainLink(record.time, controller, text)
                by, place = partial(self._frame, record, order), Place(record.time, order, 1)
                return Cause(link, place, by, Cover.LEVEL, partial(iter, [one for one in led if one is not None]))
        if after < self._log.begin:
            self._log.lack()
        return None

    def of_program(self, controller: str, change: StateChange) -> FoundCause:
        """Cause of a change of the state of a program."""
        group = self._log.group(controller)
        moment = Change(change.time, 0.0, group, self._log.position(group, change.time), change.order)
        found = self.in_controller(controller, moment, Resource(ResourceKind.PROGRAM, ""))
        return found if found is None or found.cover is not None else covered(found, Cover.PROGRAM)

    def begun(self, controller: str, event: Change) -> FoundCause:
        """Start of a program, or what began its controller anew: who switched that, or what had switched it off."""
        if event.position < 0:
            return self.of_program(controller, StateChange(event.time, ProgramState.RUNS, event.order))
        supply = self._world.objects.supplied.get(controller)
        act = next((act for act in self._log.acts_at(event.time, event.order) if _changes(act, controller)), None)
        found = self._all.scripts.acted(act) if act is not None else self._no_supply(controller, event)
        if found is None and supply is not None:
            found = self._all.elements.at_element(supply, event)
        is_first = event is self._log.begins[controller][0] and self._log.reaches_begin()
        link = ChainLink(event.time, controller, words_of(self._log.record(event)))
        before = nothing if found is None and is_first else lambda: found
        lost = None if supply is None else self._lost(f"{supply}.good", event)
        besides = tuple if lost is None else lambda: [lost]
        return Cause(link, Place(event.time, event.order), before, Cover.PROGRAM, besides)

    def begun_in_vain(self, controller: str, wanted: Resource | None, since: Nanos | None, at: Nanos) -> FoundCause:
        """Event that began a controller anew between two moments, if its program, by which ``wanted`` would change, has not come
        to that again, or nothing has started it since, switched that on or moved it. ``since``: by default when the program was
        stopped."""
        event, held = self._log.last_begin(controller, at, LAST), self._all.programs.held(controller, at)
        since = held.place.time if since is None and held is not None and held.place.order >= 0 else since
        if event is None and since is not None and since < self._log.begin:
            self._log.never_happened(*(f"event {one}" for one in BEGINS))
        if event is None or event.position < 0 or since is None or event.time <= since:
            return None
        text, begun = self._not_done(controller, wanted, event, at), self.begun(controller, event)
        return (
            None if text is None or begun is None else covered(begun._replace(link=replace(begun.link, text=text)), Cover.LEVEL)
        )

    def _not_done(self, controller: str, wanted: Resource | None, begun: Change, at: Nanos) -> MessageText | None:
        """The thing that nothing has done between two moments, in words."""
        log, programs, event = self._log, self._all.programs, words_of(self._log.record(begun))
        if wanted is None or (controller in self._world.programs and programs.is_written(controller, wanted)):
            state, alarm = log.states.last(controller, at, LAST), programs.alarm(controller, at)
            was_tried = alarm is not None and alarm.place.time >= begun.time
            is_over = state is not None and state.state in OVER and state.time <= begun.time
            if is_over or wanted is None:
                return NOT_STARTED_SINCE(event=event) if is_over and not was_tried else None
            last = log.last_executed(controller, at)
            written = programs.written(controller, wanted, last + 1)
            is_anew = last >= 0 and log.executed[controller].times[last] > begun.time
            return BEGAN_ANEW(event=event) if is_anew and (written is None or written.place.time < begun.time) else None
        pin = f"{controller}.{wanted.name if wanted.kind is ResourceKind.PIN else f'M{wanted.name}_EN'}"
        if log.has(pin) and not log.level(pin, at):
            return NOT_SWITCHED_ON_SINCE(event=event, name=pin) if (log.since(pin, at) or 0) <= begun.time else None
        if wanted.kind is not ResourceKind.AXIS:
            return None
        moved = any(plan.time > begun.time for plan in log.plans_in_force(controller, wanted.name, at))
        was_tried = moved or self._all.attempts.last(controller, wanted.name, at, after=begun.time) is not None
        return None if was_tried else NOT_COMMANDED_SINCE(event=event, axis=f"{controller}.M{wanted.name}")

    def _lost(self, good: str, event: Change) -> FoundCause:
        """The last loss of a supply, by its signal, before it fed a controller again."""
        changes = (one for one in reversed(self._log.changes.get(good, ())) if (one.time, one.order) < (event.time, event.order))
        off = next((one for one in changes if not one.value and not self._log.is_first(good, one)), None)
        return None if off is None else covered(self._all.change(good, off), Cover.LEVEL)

    def _no_supply(self, controller: str, event: Change) -> FoundCause:
        """The last fault before an event that took the supply of a controller."""
        for fault in reversed(self._log.faults.get(controller, ())):
            record = self._log.record(fault)
            if fault.order < event.order and isinstance(record.value, MessageText) and record.value.id == NO_SUPPLY.id:
                older = self._all.of_fault(record, fault.order)
                return Cause(self._all.fault_link(record), Place(fault.time, fault.order), older, Cover.FAULT)
        self._log.lack_faults()
        return None

    def frame_at(self, controller: str, time: Nanos, before: int) -> FoundCause:
        """The last request at a moment, before an order."""
        group = self._log.group(controller)
        return self._from_outside(controller, Change(time, 0.0, group, self._log.position(group, time), before), -1, "")

    def given(self, controller: str, index: int) -> FoundCause:
        """The frame with a command that came over the line by itself."""
        here = self._log.executed[controller][index]
        return self.sent(controller, here.location.text, index, here.time, here.order)

    def sent(self, controller: str, code: str, index: int, time: Nanos, before: int = LAST) -> FoundCause:
        """The frame with a command, by a moment and before an order: of several with the same one the first that has not been
        executed before the statement with a number."""
        on, executed = self._world.objects.line_of.get(controller), self._log.executed[controller]
        if on is None:
            return None
        group = self._log.group(controller)
        found: list[tuple[TraceRecord, int]] = []
        for position in range(self._log.position(group, time)):
            record, order = self._log.records[group][position], self._log.order(group, position)
            if record.kind == "frame" and self._is_for(controller, record, order):
                lines = "".join(record.data().decode("ascii", "replace").split(" ")).upper().split("\r")
                found += [(record, order)] * lines.count(code.upper())
        earlier = sum(one.number < 0 and one.text == code for one in executed.locations[:index])
        done = earlier if self._log.reaches_begin() else len(found)
        record, order = found[min(done, len(found) - 1)] if found else (None, 0)
        return None if record is None or order > before else covered(self._frame(record, order), Cover.FRAME)

    def came(self, controller: str, here: Executed, event: Change) -> FoundCause:
        """The first frame between a statement and an event that has a line with whose command the reason of the event begins."""
        group, reason = self._log.group(controller), str(dict(self._log.record(event).facts).get("why", ""))
        for position in range(self._log.position(group, here.time - 1), event.position):
            record, order = self._log.records[group][position], self._log.order(group, position)
            if record.kind == "frame" and here.order < order < event.order and self._is_for(controller, record, order):
                lines = record.data().decode("ascii", "replace").upper().replace(" ", "").split("\r")
                if any(line and reason.startswith(f"{line} ") for line in lines):
                    return self._frame(record, order)
        return None

    def variable_set(self, controller: str, name: str, until: Nanos) -> FoundCause:
        """The last action by a moment that set a variable of a program."""
        for act in self._log.acts_before(until, LAST):
            if isinstance(act.what, SetVariable) and (act.what.controller, act.what.name) == (controller, name):
                return self._all.scripts.acted(act)
        return None

    def _statement_at(self, controller: str, change: Change, wanted: Resource | None) -> int | None:
        """The number of the statement that was executed at the moment of a change, before it, and changes what is wanted."""
        executed = self._log.executed[controller]
        for index in range(self._log.last_executed(controller, change.time), -1, -1):
            if executed[index].time < change.time:
                break
            use = self._all.programs.use(controller, index)
            if executed[index].order < change.order and not (use.waits and use.governs):  # an interrupt comes between
                return index if _matches(use.writes, wanted) else None
        return None

    def _from_outside(self, controller: str, change: Change, since: int, point: str) -> FoundCause:
        """A request or another action that reached a controller at the moment of a change, after the order ``since``: the last
        that names the point that changed, or the last of all."""
        found: list[Cause] = []
        for order, record in self._log.at(change.group, change.time):
            if order < since:
                break
            if order >= change.order:
                continue
            if record.kind == "frame" and self._is_for(controller, record, order):
                found.append(self._frame(record, order))
            elif record.controller == controller and record.kind == "input" and not self._is_of_pin(record, order):
                found.append(self._input(record, order))
        return next((one for one in found if point and _name_of(point).search(one.link.text)), next(iter(found), None))

    def _inside(self, controller: str, change: Change, wanted: Resource | None) -> FoundCause:
        """Cause of an act of the controller itself: an input, or the end of what an earlier statement began."""
        inputs: list[tuple[int, str]] = []
        events: list[tuple[int, TraceRecord]] = []
        supply = self._world.objects.supplied.get(controller)
        for order, record in self._log.at(change.group, change.time):
            if order >= change.order or not (record.controller == controller or ("element", supply) in record.facts):
                continue
            if record.kind == "edge" and self._is_input(PinName(controller, record.subject)):
                inputs.append((order, f"{controller}.{record.subject}"))
            elif record.kind == "event" and record.subject != "workpiece":
                events.append((order, record))
        # What it tells about itself leads no farther than its supply.
        first = [*BEGINS, POSITION_ERROR]  # the error comes before what the motor does without a motion
        event = min(
            events, key=lambda one: (one[1].subject not in first, "element" not in dict(one[1].facts), one[0]), default=None
        )
        limit = change.order if event is None else event[0]
        last = max((one for one in inputs if one[0] < limit), default=None)
        facts = {} if event is None else dict(event[1].facts)
        of = Resource(ResourceKind.AXIS, str(facts["axis"])) if "axis" in facts else wanted

        def before() -> FoundCause:
            if last is None and event is not None:
                found = self.commanded(controller, change._replace(order=event[0]), None)
                ended = self._ended(controller, change.time, of)
                found = found or (self._earlier(controller, change.time, of) if ended is None else ended.before())
                return found or self._in_execution(controller, change.time, order, of)
            if last is None:
                return self._earlier(controller, change.time, of)
            edge = next(one for one in self._log.changes[last[1]] if one.order == last[0])
            return self._all.change(last[1], edge)

        if event is None:
            return self._all.fault(controller, change) or self._ended(controller, change.time, wanted) or before()
        order, record = event
        begin = next((one for one in self._log.begins.get(controller, ()) if one.order == order), None)
        if begin is not None:
            return self.begun(controller, begin)
        element = str(facts.get("element"))
        if record.subject == POSITION_ERROR and of is not None:
            before = partial(self._not_followed, controller, change._replace(order=order), of)
        elif element in self._all.parts:  # such as a supply that is off
            before = partial(self._all.elements.at_element, element, change._replace(order=order))
        text = words_of(record)
        return Cause(ChainLink(change.time, controller, text), Place(change.time, order), before)

    def _in_execution(self, controller: str, time: Nanos, before: int, wanted: Resource | None) -> FoundCause:
        """The statement at which a program was ended by itself, at a moment before an order."""
        index, executed = self._log.last_executed(controller, time), self._log.executed[controller]
        state = self._log.states.last(controller, time, LAST)
        is_ended = state is not None and state.time == time and state.order >= before and state.state in OVER
        is_other = wanted is not None and wanted.kind is not ResourceKind.PROGRAM
        if is_other or not is_ended or index < 0 or executed[index].time < time or executed[index].order > before:
            return None
        return self._all.programs.statement(controller, index)

    def _not_followed(self, controller: str, error: Change, wanted: Resource) -> FoundCause:
        """Cause that kept an axis from its position since its motion began, and the command of that."""
        commanded = self._earlier(controller, error.time, wanted)
        driven = [name for name, axis in self._world.axes.items() if axis.spec.drive == (controller, f"M{wanted.name}")]
        begun = -1 if commanded is None else commanded.place.time
        found: list[Cause] = [kept for name in driven if (kept := self._all.axes.kept(name, begun, error)) is not None]
        kept = max(found, key=lambda one: one.place, default=None)
        return commanded if kept is None else along(kept, [covered(commanded, Cover.MOTION)])

    def _ended(self, controller: str, time: Nanos, wanted: Resource | None) -> FoundCause:
        """The motion of an axis that ended at a moment."""
        if wanted is None or wanted.kind is not ResourceKind.AXIS:
            return None
        axes = self._all.axes
        return axes.motion(controller, wanted.name, time) if axes.ended(controller, wanted.name, time) else None

    def _asked_before(self, controller: str, change: Change) -> FoundCause:
        """A request on a line with timing, which is answered later than it came."""
        on = self._world.objects.line_of.get(controller)
        if on is None or not on[0].is_timed:
            return None
        records = self._log.records[change.group]
        for position in range(change.position - 1, max(-1, change.position - MOST_LOOKED_BACK), -1):
            record = records[position]
            if record.kind == "frame" and record.controller == on[0].name:
                order = self._log.order(change.group, position)
                return covered(self._frame(record, order), Cover.FRAME) if self._is_for(controller, record, order) else None
        return None

    def _earlier(self, controller: str, time: Nanos, wanted: Resource | None) -> FoundCause:
        """The last statement before a moment whose effect has ended then, along with one that changed the same meanwhile: the end
        of a PULSE inverts what is there. Without one, the last that changes it."""
        if wanted is None:
            return None
        later: FoundCause = None
        executed, programs, axes = self._log.executed[controller], self._all.programs, self._all.axes
        last = self._log.last_executed(controller, time)
        for index in range(last, max(-1, last - MOST_LOOKED_BACK), -1):
            use = programs.use(controller, index)
            if executed[index].time < time and _matches(use.writes, wanted):
                is_waiting = use.waits and (index == last or executed[index + 1].time >= time)
                is_of_axis = wanted.kind is ResourceKind.AXIS and axes.is_moving(controller, wanted.name, time)
                found = programs.statement(controller, index)
                if use.lasts or is_waiting or is_of_axis:
                    return along(covered(found, Cover.WAIT), [covered(later, Cover.LEVEL)])
                if wanted.kind is not ResourceKind.PIN:
                    return found
                later = later or found
        if last < MOST_LOOKED_BACK:
            self._log.lack()
        return later

    def _is_of_pin(self, record: TraceRecord, order: int) -> bool:
        """Whether an input acts by the level of a pin only."""
        act = next(self._log.acts_at(record.time, order), None)
        return act is not None and isinstance(act.what, do.Press | do.Release | do.Set)

    def _is_input(self, pin: PinName) -> bool:
        return pin in self._world.objects.driven or pin in self._world.objects.circuits

    def _frame(self, record: TraceRecord, order: int) -> Cause:
        client, place = record.subject.rpartition("/")[0], Place(record.time, order)
        meaning = self._log.frames.meaning(record)
        if client == SCRIPTS:
            link = ChainLink(record.time, record.controller, REQUEST(meaning=meaning))
            return Cause(link, place, partial(self._requested, record, order))
        sent = Sent(record.time, record.controller, client)
        return Cause(ChainLink(record.time, record.controller, CLIENT(client=client, meaning=meaning), sent), place, nothing)

    def _requested(self, record: TraceRecord, order: int) -> FoundCause:
        """The step that made a request, which a line with timing carries later."""
        members = {name for name, (line, _) in self._world.objects.line_of.items() if line.name == record.controller}
        meaning = self._log.frames.meaning(record)
        acts = [act for act in self._log.acts_before(record.time, order) if _requests(act, record.controller, members)]
        made = (act for act in acts if self._makes(act, record.data()))
        others = (act for act in acts if not isinstance(act.what, do.Write))
        act = next(made, None) or next((act for act in acts if _names(act, meaning)), None) or next(others, None)
        if act is None:
            self._log.lack()
            return None
        what = SENDS_TO(data=meaning, line=record.controller) if isinstance(act.what, do.Request) else None
        return covered(self._all.scripts.acted(act, what), Cover.FRAME)

    def _makes(self, act: Act, frame: bytes) -> bool:
        """Whether a frame carries one of the requests of an action."""
        match act.what:
            case do.Write() as what:
                return any(pdu in frame for _, pdus in self._world.requests(what) for pdu in pdus)
            case do.Request(pdu=pdu):
                return pdu in frame
        return False

    def _input(self, record: TraceRecord, order: int) -> Cause:
        act = next(self._log.acts_at(record.time, order), None)
        if act is not None:
            return self._all.scripts.acted(act)
        link = ChainLink(record.time, record.controller, FROM_OUTSIDE(what=f"{record.subject} {record.value}"))
        return Cause(link, Place(record.time, order), nothing)


def _matches(writes: Sequence[Resource], wanted: Resource | None) -> bool:
    """Whether a statement changes what is wanted. An empty name is any of its kind."""
    if wanted is None:
        return bool(writes)
    return any(one.kind is wanted.kind and (one.name in ("", wanted.name) or not wanted.name) for one in writes)


def axis_of(point: str) -> Resource | None:
    """The axis or encoder of a point of a controller, by its path; None for another one."""
    found = _AXIS.match(point)
    if found is None:
        return None
    return Resource(ResourceKind.ENCODER if "enc" in point.lower() else ResourceKind.AXIS, found[1] or "")


def _is_spoilt(what: Bytes, unit: int) -> bool:
    """Whether it is a request to a unit with a wrong check sum."""
    whole, is_rtu = len(what.data) >= LEAST_FRAME and what.data[0] == unit, what.kind == "rtu"
    return is_rtu and whole and with_crc(what.data[:-2]) != what.data


def _names(act: Act, meaning: str) -> bool:
    """Whether an action writes what a request is about, or a register with this name."""
    match act.what:
        case do.Write(values):
            return any(_name_of(name).search(meaning) for _, name, _ in values)
    return False


def _name_of(point: str) -> re.Pattern[str]:
    """Pattern of a point in the words of a request."""
    return re.compile(rf"(?<!\w){re.escape(point.partition(':')[0])}(?!\w)", re.IGNORECASE)


def _requests(act: Act, line: str, members: Collection[str]) -> bool:
    """Whether an action sends something over a line."""
    match act.what:
        case do.Write(values):
            return any(controller in members for controller, *_ in values)
        case do.Request() | do.Send() as what:
            return what.line == line
    return False


def _changes(act: Act, controller: str) -> bool:
    match act.what:
        case do.PowerCycle() | do.Turn() | SetVariable() | Download() | See() | Halt() as what:
            return what.controller == controller
        case do.Write(values):
            return any(name == controller for name, *_ in values)
    return False
