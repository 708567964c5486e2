"""The debugger of a world that runs in real time (`steptwin.subject.debugcommands`).

It exists while somebody subscribes to its events. Before the world goes on, the debugger looks ahead (`Debugger.look_ahead`) and
limits it; so time stops at a breakpoint, and `Pause` and `Resume` do what they always do. While time stands it can show the
past, as far as that is kept.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from time import perf_counter
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.debug.breakpoints import AnyPoint
from steptwin.debug.debugger import Debugger, DebugTravel
from steptwin.debug.lookahead import Goal
from steptwin.debug.observer import Logged
from steptwin.debug.values import DataPoint, Events, FormattedValue, LabelPoint, LinePoint, SetPoint, Stopped, StopReason
from steptwin.errors import Misuse, Refusal, SteptwinError
from steptwin.live.pace import Pace
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.timetravel import PART_S, WorldTimeTravel, take_back
from steptwin.live.world import LiveWorld
from steptwin.messages import NONE, Message, text_of
from steptwin.simulation.world.inputs import Download
from steptwin.simulation.world.model import WORLD
from steptwin.simulation.world.snapshot import RecordedInput, SimulationSnapshot
from steptwin.subject import debugcommands as command
from steptwin.subject.dispatch import Action
from steptwin.subject.payloads import BreakpointsPayload, LogPayload, StoppedPayload
from steptwin.tables import complete

_EVENTS = complete("event", command.EVENTS, "codes", {event.code: event for event in Events})


class _Requested(NamedTuple):
    wanted: command.SetBreakpoint
    point: AnyPoint
    times: int = 1
    """How often it was set and not removed: it stays until each of its clients has removed it."""


STOPS_NEED_A_SUBSCRIBER = Message(
    "live.stops-need-a-subscriber", "without a subscriber a stop is not reported: subscribe to events of kind {kind!r} first"
)
TOO_MANY_BREAKPOINTS = Message("live.too-many-breakpoints", "{most} breakpoints are set, as many as may be")
WRONG_BREAKPOINT = Message("live.wrong-breakpoint", "breakpoint: {problem}")
UNKNOWN_BREAKPOINT = Message("live.unknown-breakpoint", "there is no breakpoint {number}; there are {names}")
UNKNOWN_PROGRAM = Message("live.unknown-program", "{controller} has no program {program!r}; there are {names}")


class Debugging:
    """Debugger of ``live``; ``pace`` is that of its time."""

    def __init__(self, live: LiveWorld, realtime: RealTimeDriver, pace: Pace) -> None:
        self._live = live
        self._realtime = realtime
        self._pace = pace
        self._breakpoints: dict[int, _Requested] = {}
        """They stay without a subscriber; time does not stop at them then."""
        self._set: dict[int, SetPoint] = {}
        """Results of setting them."""
        self._next = 1
        self._events: tuple[str, ...] = ()
        self._said = BreakpointsPayload((), ())
        self._open: _OpenDebugger | None = None
        live.subject.on_subscribed = self._subscribed

    def _subscribed(self) -> None:
        if self._open is not None and not self._has_subscribers:
            is_at_stop = self._open.is_at_stop
            self._open.close()
            self._open = None
            if is_at_stop:
                self._live.show("the debugger has disconnected and time is paused: 'steptwin resume' continues it")

    @property
    def _has_subscribers(self) -> bool:
        return StoppedPayload.kind in self._live.subject.subscribers.kinds

    def _opened(self) -> _OpenDebugger:
        """Raises `Refusal` without a subscriber of stops, and `Misuse` for a world that cannot be debugged."""
        if self._open is None:
            if not self._has_subscribers:
                raise Refusal(STOPS_NEED_A_SUBSCRIBER(kind=StoppedPayload.kind))
            self._open = _OpenDebugger(self._live, self._realtime, self._pace, self._renew, self._numbers)
            self._open.debugger.set_events([_EVENTS[name] for name in self._events])
            self._renew()
        return self._open

    # ------------------------------------------------------------------ breakpoints

    def _set_all(self) -> None:
        """Have the debugger stop at all breakpoints; their lines are looked for in the present texts."""
        if self._open is not None:
            found = self._open.debugger.set_breakpoints([one.point for one in self._breakpoints.values()])
            self._set = dict(zip(self._breakpoints, found, strict=True))

    def _renew(self) -> None:
        """`_set_all`, and publish what has changed."""
        self._set_all()
        self._tell()

    def _tell(self) -> None:
        """Publish what time stops at, unless it is unchanged."""
        said = BreakpointsPayload(tuple(self._to_json(number) for number in self._breakpoints), self._events)
        if said != self._said:
            self._said = said
            self._live.subject.publish(self._live.now, WORLD, said)

    def _add(self, wanted: command.SetBreakpoint) -> object:
        self._opened()
        if len(self._breakpoints) >= command.MOST_BREAKPOINTS:
            raise Misuse(TOO_MANY_BREAKPOINTS(most=command.MOST_BREAKPOINTS))
        same = next((number for number, one in self._breakpoints.items() if one.wanted == wanted), None)
        if same is not None:
            found = self._breakpoints[same]
            self._breakpoints[same] = found._replace(times=found.times + 1)
            return self._to_json(same)
        number, self._next = self._next, self._next + 1
        self._breakpoints[number] = _Requested(wanted, _point(wanted))
        self._set_all()
        if problem := self._set[number].problem:
            self._remove(number)
            raise Misuse(WRONG_BREAKPOINT(problem=text_of(problem)))
        self._tell()
        return self._to_json(number)

    def _clear(self, wanted: command.ClearBreakpoint) -> None:
        if wanted.number not in self._breakpoints:
            raise Misuse(UNKNOWN_BREAKPOINT(number=wanted.number, names=list(self._breakpoints) or NONE()))
        found = self._breakpoints[wanted.number]
        if found.times > 1:
            self._breakpoints[wanted.number] = found._replace(times=found.times - 1)
        else:
            self._remove(wanted.number)

    def _remove(self, number: int) -> None:
        del self._breakpoints[number]
        self._set.pop(number, None)
        self._renew()

    def _numbers(self, points: Sequence[int]) -> tuple[int, ...]:
        """Numbers of breakpoints, by those in the debugger."""
        return tuple(number for number, found in self._set.items() if found.number in points)

    def _to_json(self, number: int) -> dict[str, object]:
        found = self._set.get(number)
        given = {name: value for name, value in asdict(self._breakpoints[number].wanted).items() if name != "line"}
        line = self._breakpoints[number].wanted.line if found is None or found.line is None else found.line
        why_not = None if found is None else found.problem or found.note or None
        return {"number": number, **given, "line": line, "problem": why_not}

    def _list(self) -> object:
        return {
            "breakpoints": [self._to_json(number) for number in self._breakpoints],
            "stop_on": list(self._events),
            "stop": None if self._open is None else self._open.stopped,
        }

    def _stop_on(self, wanted: command.StopOn) -> None:
        self._opened().debugger.set_events([_EVENTS[name] for name in wanted.events])
        self._events = wanted.events
        self._tell()

    # ------------------------------------------------------------------ commands

    def actions(self) -> dict[type, Action]:
        return {
            command.Debug: lambda _: self._opened().describe(),
            command.SetBreakpoint: self._add,
            command.ClearBreakpoint: self._clear,
            command.ListBreakpoints: lambda _: self._list(),
            command.StopOn: self._stop_on,
            command.StepProgram: lambda wanted: self._opened().step(wanted),
            command.RunProgram: lambda wanted: self._opened().run(wanted),
            command.LookAt: lambda wanted: self._opened().look_at(wanted.to),
            command.Branch: lambda _: self._opened().branch(),
            command.Stack: lambda wanted: self._opened().stack(wanted.controller),
            command.Values: self._values,
            command.Evaluate: lambda wanted: _value_to_json(self._looked_at().evaluate(wanted.controller, wanted.expression)),
            command.SetValue: self._set_value,
            command.ProgramSource: self._source,
        }

    def _looked_at(self) -> Debugger:
        return self._opened().looked_at

    def _values(self, wanted: command.Values) -> object:
        return [_value_to_json(value) for value in self._looked_at().scope(wanted.controller, wanted.scope).values]

    def _set_value(self, wanted: command.SetValue) -> object:
        return _value_to_json(self._looked_at().set_value(wanted.controller, wanted.name, wanted.expression))

    def _source(self, wanted: command.ProgramSource) -> object:
        texts = self._opened().debugger.texts(wanted.controller)
        if wanted.program not in texts:
            raise Misuse(UNKNOWN_PROGRAM(controller=wanted.controller, program=wanted.program, names=list(texts) or NONE()))
        source = texts[wanted.program]
        return {"program": wanted.program, "source": source.name, "text": source.text}


DEBUGGER_IS_AT_THE_PRESENT = Message(
    "live.debugger-is-at-the-present", "the debugger is at the present: there is nothing to go back to"
)
DEBUGGER_IS_ON_ITS_WAY = Message("live.debugger-is-on-its-way", "the debugger is on its way through the past: pause it first")
WORLD_IS_RUNNING = Message("live.world-is-running", "the world is running: pause it first")


class _OpenDebugger:
    """A debugger at work: the run control of its world.

    ``on_new_text`` is called when a controller has another program; ``numbers`` gives those of breakpoints.
    """

    def __init__(
        self,
        live: LiveWorld,
        realtime: RealTimeDriver,
        pace: Pace,
        on_new_text: Callable[[], None],
        numbers: Callable[[Sequence[int]], tuple[int, ...]],
    ) -> None:
        self._live = live
        self._realtime = realtime
        self._pace = pace
        self._on_new_text = on_new_text
        self._numbers = numbers
        self._time_travel = WorldTimeTravel(live, realtime, pace) if live.snapshots is None else None
        try:
            self.debugger = Debugger(live.world, live.snapshots, live.apply_input, self._take_back)
        except SteptwinError:
            self._end_time_travel()
            raise
        self.debugger.on_log = self._log
        self._goal = Goal()
        self._after = live.now
        """When time began to go on."""
        self._begin: Nanos | None = None
        """Where in the past that was, when it is about to."""
        self._goes = False
        self._stop: Stopped | None = None
        """Why time is about to stand."""
        self._travel: DebugTravel | None = None
        """A way through the past."""
        self.stopped: dict[str, object] | None = None
        """The payload of the present stop; None while time goes on."""
        self._then: Goal | None = None
        """Goal of the search once it has come to the present."""
        live.world.input_subscribers.append(self._given)
        live.run_control = self
        if pace.is_paused:
            self.debugger.stand()
        else:
            self.resumed()

    @property
    def is_at_stop(self) -> bool:
        """Whether time stands because of the debugger, not of a pause."""
        return self.stopped is not None and self.stopped["reason"] != StopReason.PAUSE.value

    def close(self) -> None:
        self._end_travel()
        self._realtime.enter()
        self._live.run_control = None
        self._live.world.input_subscribers.remove(self._given)
        self.debugger.close()
        self._end_time_travel()
        self._live.is_dirty = True
        self._realtime.leave()

    def _end_time_travel(self) -> None:
        if self._time_travel is not None:
            self._time_travel.end()

    def _given(self, given: RecordedInput) -> None:
        if isinstance(given.what, Download):
            self._on_new_text()

    # ------------------------------------------------------------------ run control

    def look_ahead(self, until: Nanos) -> tuple[Nanos, bool]:
        if not self._goes:
            return until, False
        stop = self.debugger.look_ahead(until, self._goal, self._after)
        if stop is None or stop.reason is StopReason.WORLD:  # a script that stops the world does so by itself
            return until, False
        self._stop = stop
        return stop.time, True

    def resumed(self) -> None:
        self._end_travel()
        self.stopped = None
        if not self._goes:
            self._goes = True
            self._after = self._live.now if self._begin is None else self._begin
            self._stop = self._begin = None

    def paused(self) -> None:
        if self._travel is not None:
            self._end_travel()
            self._say(self.debugger.pause())
        elif self._goes:
            self._goes = False
            self._goal = Goal()
            self.debugger.stand()
            self._say(self._stop or Stopped(StopReason.PAUSE, self._live.now))

    def restored(self) -> None:
        self._end_travel()
        self.debugger.gone_back()
        self.debugger.stand()
        self._say(Stopped(StopReason.PAUSE, self._live.now))

    # ------------------------------------------------------------------ commands

    def step(self, wanted: command.StepProgram) -> object:
        debugger = self._standing
        if wanted.way == "back":
            self._go(debugger.stepping_back(wanted.controller))
        else:
            goals = {"in": debugger.into, "over": debugger.over, "out": debugger.out}
            self._forwards(goals[wanted.way](wanted.controller))
        return self.place()

    def run(self, wanted: command.RunProgram) -> object:
        debugger = self._standing
        if wanted.way == command.BACKWARDS:
            self._go(debugger.running_back())
        else:
            self._forwards(Goal())
        return self.place()

    def look_at(self, moment: Nanos) -> object:
        self._go(self._standing.going(moment))
        return self.place()

    def branch(self) -> object:
        debugger = self._standing
        if not debugger.is_past:
            raise Refusal(DEBUGGER_IS_AT_THE_PRESENT())
        debugger.branch()
        return self.place()

    def _take_back(self, snapshot: SimulationSnapshot) -> None:
        take_back(self._live, self._pace, snapshot)

    @property
    def looked_at(self) -> Debugger:
        if self._travel is not None:
            raise Refusal(DEBUGGER_IS_ON_ITS_WAY())
        return self.debugger

    @property
    def _standing(self) -> Debugger:
        if self._goes:
            raise Refusal(WORLD_IS_RUNNING())
        return self.looked_at

    # ------------------------------------------------------------------ through the past

    def _forwards(self, goal: Goal) -> None:
        debugger = self.debugger
        if debugger.is_past:
            self._begin = debugger.now
            self._go(debugger.forwards(goal, debugger.present), goal)
        else:
            self._goal = goal
            self._pace.resume()

    def _go(self, travel: DebugTravel, then: Goal | None = None) -> None:
        self._travel, self._then = travel, then
        self.stopped = None
        asyncio.get_running_loop().call_soon(self._part, travel)

    def _end_travel(self) -> None:
        if self._travel is not None:
            self._travel.close()
            self._travel = self._begin = None

    def _part(self, travel: DebugTravel) -> None:
        if travel is not self._travel:
            return
        until = perf_counter() + PART_S
        try:
            next(travel)
            while perf_counter() < until:
                next(travel)
        except StopIteration as end:
            self._travel = None
            self._arrived(end.value)
        except SteptwinError as error:
            self._travel = None
            self._say(replace(self.debugger.pause(), text=str(error)))
        else:
            asyncio.get_running_loop().call_later(PART_S, self._part, travel)

    def _arrived(self, stop: Stopped) -> None:
        if stop.reason is StopReason.LIMIT and self._then is not None and not self.debugger.is_past:
            self._forwards(self._then)
        else:
            self._begin = None
            self._say(stop)

    # ------------------------------------------------------------------ answers and events

    def place(self) -> dict[str, object]:
        debugger = self.debugger
        return {
            "time_ns": str(debugger.now),
            "present_ns": str(debugger.present),
            "begin_ns": str(debugger.begin),
            "past": debugger.is_past,
            "going": self._goes or self._travel is not None,
        }

    def describe(self) -> object:
        controllers = [{"name": name, "programs": self._programs(name)} for name in self.debugger.threads]
        events = [{"name": event.code, "title": event.title} for event in Events]
        return {"controllers": controllers, "events": events, "scopes": list(command.SCOPES), **self.place()}

    def _programs(self, controller: str) -> Sequence[dict[str, object]]:
        debugger, programs = self.debugger, self._live.world.programs_of(controller)
        return [
            {
                "program": name,
                "source": source.name,
                "lines": sorted(set(debugger.statement_lines(controller, name))),
                "labels": list(programs.labels(name)),
            }
            for name, source in debugger.texts(controller).items()
        ]

    def stack(self, controller: str) -> object:
        return [
            {
                "name": name,
                "program": at.text,
                "source": at.source,
                "line": at.line,
                "column": at.column,
                "end_line": at.end_line,
                "end_column": at.end_column,
            }
            for name, at in self.looked_at.stack(controller)
        ]

    def _say(self, stop: Stopped) -> None:
        debugger = self.debugger
        frames = () if stop.controller is None else debugger.stack(stop.controller)
        at = frames[0].location if frames else None
        said = StoppedPayload(
            stop.reason.value,
            stop.text,
            self._numbers(stop.points),
            None if at is None else at.text,
            None if at is None else at.line,
            debugger.is_past,
        )
        controller = stop.controller or WORLD
        self.stopped = {"time_ns": str(debugger.now), "controller": controller, **said.to_json()}
        self._live.subject.publish(debugger.now, controller, said)

    def _log(self, logged: Logged) -> None:
        at = self.debugger.location(logged.controller, logged.location)
        self._live.subject.publish(logged.time, logged.controller, LogPayload(logged.text, at.text, at.line))


def _point(wanted: command.SetBreakpoint) -> AnyPoint:
    condition, hits = wanted.condition, wanted.hits
    if wanted.label is not None:
        return LabelPoint(label=wanted.label, condition=condition, hits=hits)
    controller = wanted.controller or ""
    if wanted.value is not None:
        return DataPoint(controller=controller, name=wanted.value, condition=condition)
    line, program = wanted.line or 0, wanted.program or ""
    return LinePoint(controller=controller, text=program, line=line, condition=condition, hits=hits, log=wanted.log)


def _value_to_json(value: FormattedValue) -> dict[str, object]:
    return {
        "name": value.name,
        "value": value.text,
        "number": value.number,
        "settable": value.is_settable,
        "expression": value.expression,
    }
