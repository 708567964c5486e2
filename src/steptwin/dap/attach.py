"""The debugger of a twin that runs in another process, over its control endpoint (`steptwin.live.debugging`)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from steptwin.controller import Nanos
from steptwin.debug.breakpoints import AnyPoint
from steptwin.debug.debugger import DebugTravel
from steptwin.debug.values import (
    DataPoint,
    Events,
    FormattedValue,
    LabelPoint,
    LinePoint,
    Location,
    Scope,
    SetPoint,
    StackFrame,
    Stopped,
    StopReason,
)
from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse
from steptwin.live.remote import RemoteSubject
from steptwin.live.twins import find_controller
from steptwin.subject import debugcommands as command
from steptwin.subject.commands import Command, EndPoints, Pause, Resume, Time
from steptwin.subject.events import Event
from steptwin.subject.payloads import LogPayload, PacePayload, StoppedPayload
from steptwin.subject.subscriptions import filter_of
from steptwin.why.answer import Answer, read_answer

PART_S = 0.05
"""Time-out for the twin; then the editor is served again."""
MOST_EVENTS = 10_000

Log = Callable[[Nanos, str, str, str, int], None]
"""Moment, controller, text that is logged, program and line."""


class AttachedTwin:
    """The twin that ``text`` names (None: the only one), found as by commands (`steptwin.live.twins`). See `Target`.

    Raises `LineFailure` where it does not answer, `Misuse` and `Refusal` where it is none or cannot be debugged.
    """

    def __init__(self, text: str | None, log: Log) -> None:
        name, _ = find_controller(text)
        self._subject = RemoteSubject(name)
        self._log = log
        self._set: dict[AnyPoint, SetPoint] = {}
        self._has_set_events = False
        try:
            self._subscription = self._subject.subscribe(filter_of(["stopped", "log", "pace"]), MOST_EVENTS)
            self._found = self._ask(command.Debug())
            self._events_before: list[str] = self._ask(command.ListBreakpoints())["stop_on"]
            self._texts = {one["name"]: self._sources(one) for one in self._found["controllers"]}
            file = self._ask(EndPoints()).get("file")
        except BaseException:
            self._subject.close()
            raise
        self.folder = Path(file).parent if file else Path()
        """Names of files in the world begin here."""
        self.was_going = bool(self._found["going"])
        """Whether time went on when this began; a machine that stands does not start because a debugger has come."""

    def _ask(self, wanted: Command) -> Any:
        return self._subject.do(wanted).value

    def _sources(self, controller: Mapping[str, Any]) -> dict[str, SourceText]:
        found = [self._ask(command.ProgramSource(controller["name"], one["program"])) for one in controller["programs"]]
        return {one["program"]: SourceText(one["source"], one["text"]) for one in found}

    def close(self) -> None:
        """Detach; a twin that went on when this began goes on, and stops at the events at which it did."""
        try:
            self.set_breakpoints(())
            if self._has_set_events:
                self._ask(command.StopOn(tuple(self._events_before)))
            if self.was_going and self._ask(Time())["paused"]:
                self._ask(Resume())
        finally:
            self._subject.close()

    # ------------------------------------------------------------------ where it stands

    def _place(self) -> Mapping[str, Any]:
        return self._ask(command.Debug())

    @property
    def now(self) -> Nanos:
        return int(self._place()["time_ns"])

    @property
    def present(self) -> Nanos:
        return int(self._place()["present_ns"])

    @property
    def begin(self) -> Nanos:
        return int(self._place()["begin_ns"])

    @property
    def is_past(self) -> bool:
        return bool(self._place()["past"])

    @property
    def has_ended(self) -> bool:
        """A twin that runs waits for what comes from outside."""
        return False

    @property
    def threads(self) -> Sequence[str]:
        return list(self._texts)

    def texts(self, controller: str) -> Mapping[str, SourceText]:
        return self._texts[controller]

    def statement_lines(self, controller: str, text: str) -> Sequence[int]:
        programs = next(one["programs"] for one in self._found["controllers"] if one["name"] == controller)
        return next(one["lines"] for one in programs if one["program"] == text)

    def stack(self, controller: str) -> Sequence[StackFrame]:
        return [
            StackFrame(
                one["name"],
                Location(
                    controller,
                    one["program"],
                    one["source"],
                    one["line"],
                    one["column"],
                    one["end_line"],
                    one["end_column"],
                ),
            )
            for one in self._ask(command.Stack(controller))
        ]

    # ------------------------------------------------------------------ values

    def scope(self, controller: str, name: str) -> Scope:
        return Scope(name, [_value(one) for one in self._ask(command.Values(controller, name))])

    def evaluate(self, controller: str, text: str) -> FormattedValue:
        return _value(self._ask(command.Evaluate(controller, text)))

    def set_value(self, controller: str, name: str, text: str) -> FormattedValue:
        return _value(self._ask(command.SetValue(controller, name, text)))

    def why(self, question: str) -> Answer:
        return read_answer(self._ask(command.AskWhy(question, self.now)))

    # ------------------------------------------------------------------ breakpoints

    def set_breakpoints(self, points: Sequence[AnyPoint]) -> Sequence[SetPoint]:
        """Set these and none of the others that were set here; those of other clients stay."""
        for point in [one for one in self._set if one not in points]:
            number = self._set.pop(point).number
            if number in [one["number"] for one in self._ask(command.ListBreakpoints())["breakpoints"]]:
                self._ask(command.ClearBreakpoint(number))
        return [self._one(point) for point in points]

    def _one(self, point: AnyPoint) -> SetPoint:
        if point not in self._set:
            try:
                answer = self._ask(_wanted(point))
            except Misuse as error:
                return SetPoint(0, problem=str(error))
            self._set[point] = SetPoint(answer["number"], (), answer["line"], note=answer["problem"] or "")
        return self._set[point]

    def set_events(self, events: Iterable[Events]) -> None:
        self._ask(command.StopOn(tuple(event.code for event in events)))
        self._has_set_events = True

    # ------------------------------------------------------------------ time

    def running(self) -> DebugTravel:
        if self._place()["going"]:
            return self._until_stopped()
        return self._after(command.RunProgram())

    def running_to_entry(self) -> DebugTravel:
        """A twin that runs has no entry: it is paused."""
        return self._at_once(self.pause())

    def running_back(self) -> DebugTravel:
        return self._after(command.RunProgram(command.BACKWARDS))

    def stepping_in(self, controller: str) -> DebugTravel:
        return self._after(command.StepProgram(controller, "in"))

    def stepping_over(self, controller: str) -> DebugTravel:
        return self._after(command.StepProgram(controller, "over"))

    def stepping_out(self, controller: str) -> DebugTravel:
        return self._after(command.StepProgram(controller, "out"))

    def stepping_back(self, controller: str) -> DebugTravel:
        return self._after(command.StepProgram(controller, "back"))

    def go(self, moment: Nanos) -> Stopped:
        self._drop()
        self._ask(command.LookAt(moment))
        while True:
            for event in self._events(PART_S):
                if isinstance(event.payload, StoppedPayload):
                    return self._stop(event, event.payload)
                if isinstance(event.payload, PacePayload) and not event.payload.paused:
                    raise Misuse("another client has let time go on")

    def branch(self) -> None:
        self._ask(command.Branch())
        self._drop()

    def pause(self) -> Stopped:
        self._ask(Pause())
        return Stopped(StopReason.PAUSE, self._drop())

    def _drop(self) -> Nanos:
        """The place of the debugger, after all events up to now."""
        now = self.now
        for _ in self._stops(0.0):
            pass
        return now

    def _after(self, wanted: Command) -> DebugTravel:
        self._drop()
        self._ask(wanted)
        return self._until_stopped()

    def _until_stopped(self) -> DebugTravel:
        while True:
            for stop in self._stops(PART_S):
                return stop
            yield

    def _at_once(self, stop: Stopped) -> DebugTravel:
        yield from ()
        return stop

    def unasked(self) -> DebugTravel | None:
        """Run that another client has begun meanwhile; None for none."""
        for event in self._events(0.0):
            if isinstance(event.payload, StoppedPayload):
                return self._at_once(self._stop(event, event.payload))
            if isinstance(event.payload, PacePayload) and not event.payload.paused:
                return self._until_stopped()
        return None

    def _stops(self, timeout_s: float) -> Iterator[Stopped]:
        for event in self._events(timeout_s):
            if isinstance(event.payload, StoppedPayload):
                yield self._stop(event, event.payload)

    def _events(self, timeout_s: float) -> Iterator[Event]:
        if not len(self._subscription):
            self._subject.pump(timeout_s)
        while len(self._subscription):
            (event,) = self._subscription.take(1).events
            if isinstance(event.payload, LogPayload):
                said = event.payload
                self._log(event.time, event.controller, said.words, said.program, said.line)
            else:
                yield event

    def _stop(self, event: Event, stopped: StoppedPayload) -> Stopped:
        controller = event.controller if event.controller in self._texts else None
        return Stopped(StopReason(stopped.reason), event.time, controller, stopped.what, stopped.breakpoints)


def _value(found: Mapping[str, Any]) -> FormattedValue:
    return FormattedValue(found["name"], found["value"], found["number"], found["settable"], found.get("expression", ""))


def _wanted(point: AnyPoint) -> command.SetBreakpoint:
    match point:
        case LinePoint():
            return command.SetBreakpoint(
                controller=point.controller,
                program=point.text,
                line=point.line,
                condition=point.condition,
                hits=point.hits,
                log=point.log,
            )
        case LabelPoint():
            return command.SetBreakpoint(label=point.label, condition=point.condition, hits=point.hits)
        case DataPoint():
            return command.SetBreakpoint(controller=point.controller, value=point.name, condition=point.condition)
