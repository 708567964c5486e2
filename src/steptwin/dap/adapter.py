"""An editor's session with a debugger, as the Debug Adapter Protocol has it: requests in, responses and events out.

It reads and writes nothing by itself. What runs is run in parts (`Adapter.go_on`), so that requests are answered meanwhile.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

from steptwin.dap.arguments import data_point, label_point, line_points
from steptwin.dap.attach import AttachedTwin
from steptwin.dap.capabilities import CAPABILITIES
from steptwin.dap.launch import Launch, open_world, read_launch
from steptwin.dap.sources import Sources, texts_of
from steptwin.dap.target import Target
from steptwin.debug.breakpoints import AnyPoint
from steptwin.debug.debugger import Debugger, DebugTravel
from steptwin.debug.values import Events, Location, SetPoint, ShownValue, Stopped, StopReason
from steptwin.durations import duration
from steptwin.errors import LineFailure, Misuse, Refusal, SteptwinError
from steptwin.files.world import World
from steptwin.machine import SECOND
from steptwin.subject.debugcommands import SCOPES
from steptwin.why.answer import Answer

_Body: TypeAlias = Mapping[str, object]
_SendEvent: TypeAlias = Callable[[str, _Body], None]
"""An event and its body."""
Arguments: TypeAlias = Mapping[str, Any]

LOOK_S = 0.1
"""Period of the check whether another client lets an attached twin continue."""
DATA_ACCESS = "write"
"""Reading a value changes nothing, and is not noticed."""
FRAMES = 1000
"""Frames of a thread, at most: a frame has the number of its thread times this, and its depth."""
_REASONS: Mapping[StopReason, str] = {
    StopReason.ENTRY: "entry",
    StopReason.STEP: "step",
    StopReason.BREAKPOINT: "breakpoint",
    StopReason.FUNCTION: "function breakpoint",
    StopReason.DATA: "data breakpoint",
    StopReason.EXCEPTION: "exception",
}
"""The others are pauses, for editors."""
_HELP = (
    "an expression such as n + 1 or IN3 = ON shows a value; 'go 1.5 s' goes to a moment of the past; 'branch' has the world go on"
    " from there, so that values can be changed; 'why OUT3 == 0' shows the chain of causes of a condition or a signal, 'why'"
    " alone what the program waits for"
)


class Adapter:
    """One session. ``send`` takes the events."""

    def __init__(self, send: _SendEvent) -> None:
        self._send = send
        self._debugger: Target | None = None
        self._world: World | None = None
        self._launch: Launch | None = None
        self._attached: AttachedTwin | None = None
        self._stops_on_entry = self._is_no_debug = False
        self._travel: DebugTravel | None = None
        self._sources = Sources(())
        self._lines: dict[Path, list[AnyPoint]] = {}
        """Breakpoints in lines, by file."""
        self._labels: list[AnyPoint] = []
        self._data: list[AnyPoint] = []
        self._first_line = self._first_column = 1
        self.has_ended = False
        """The session is over."""

    @property
    def is_running(self) -> bool:
        return self._travel is not None

    @property
    def patience_s(self) -> float | None:
        """How long a request may be waited for before `go_on`; None: for ever."""
        return 0.0 if self.is_running else None if self._attached is None else LOOK_S

    # ------------------------------------------------------------------ requests

    def answer(self, command: str, arguments: Arguments) -> _Body:
        """The body of the response. Raises `SteptwinError` for what cannot be done."""
        handler = _HANDLERS.get(command)
        if handler is None:
            raise Misuse(f"{command}: there is no such request here")
        try:
            return handler(self, arguments)
        except SteptwinError:
            raise
        except KeyError as error:
            raise Misuse(f"{command}: the argument {error.args[0]} is missing") from error
        except (TypeError, ValueError, AttributeError) as error:
            raise Misuse(f"{command}: an argument is of another type: {error}") from error

    def after(self, command: str) -> None:
        """What comes after the response to a request that was answered."""
        if command in ("launch", "attach"):
            self._send("initialized", {})

    def _stopped(self) -> Target:
        """The debugger, which stands."""
        if self.is_running:
            raise Misuse("the program runs: pause it first")
        return self._started()

    def _started(self) -> Target:
        if self._debugger is None:
            raise Misuse("nothing was launched, and no twin was attached to")
        return self._debugger

    def _initialize(self, arguments: Arguments) -> _Body:
        self._first_line = 1 if arguments.get("linesStartAt1", True) else 0
        self._first_column = 1 if arguments.get("columnsStartAt1", True) else 0
        return CAPABILITIES

    def _launch_world(self, arguments: Arguments) -> _Body:
        self._check_fresh("launch")
        asked = read_launch(arguments)
        world = open_world(asked, self._tell)
        try:
            debugger = Debugger(world)
            sources = Sources(texts_of(debugger, asked.folder))
            if asked.world is not None and asked.program is not None:
                sources.check(asked.program, asked.world)
        except SteptwinError:
            world.close()
            raise
        debugger.on_log = lambda logged: self._log(logged.time, logged.text, debugger.location(logged.machine, logged.place))
        self._world, self._launch, self._debugger, self._sources = world, asked, debugger, sources
        self._stops_on_entry, self._is_no_debug = asked.stop_on_entry, asked.no_debug
        return {}

    def _attach(self, arguments: Arguments) -> _Body:
        self._check_fresh("attach")
        twin, stops = arguments.get("twin"), arguments.get("stopOnEntry", False)
        if twin is not None and not isinstance(twin, str):
            raise Misuse(f"attach: twin = {twin!r}: expected the name, file or address of a running twin")
        attached = AttachedTwin(twin, self._log_of_twin)
        self._debugger = self._attached = attached
        self._sources = Sources(texts_of(attached, attached.folder))
        self._stops_on_entry = bool(stops) or not attached.was_going
        return {}

    def _check_fresh(self, command: str) -> None:
        if self._debugger is not None:
            raise Misuse(f"{command}: this session has something to debug already")

    def _configuration_done(self, arguments: Arguments) -> _Body:
        debugger = self._stopped()
        self._run(debugger.running_to_entry() if self._stops_on_entry else debugger.running())
        return {}

    def _restart(self, arguments: Arguments) -> _Body:
        if self._world is None:
            raise Misuse("restart: a twin that runs has no beginning to go to; disconnect and attach again")
        if self.is_running:
            self._end_travel()
        debugger = self._started()
        debugger.go(debugger.begin)
        debugger.branch()
        return self._configuration_done(arguments)

    def _end(self, arguments: Arguments) -> _Body:
        self._end_travel()
        if not self.has_ended:
            self.has_ended = True
            self._send("terminated", {})
        if self._world is not None:
            self._world.close()
        if self._attached is not None:
            attached, self._attached, self._debugger = self._attached, None, None
            with suppress(LineFailure):  # it has ended already
                attached.close()
        return {}

    # ------------------------------------------------------------------ breakpoints

    def _set_lines(self, arguments: Arguments) -> _Body:
        path = self._sources.path(arguments["source"])
        texts = self._sources.of(path)
        wanted: Sequence[Arguments] = arguments.get("breakpoints") or ()
        if not texts:
            reason = f"{path.name} is no program of this session: there are {self._sources.known}"
            return {"breakpoints": [{"verified": False, "message": reason} for _ in wanted]}
        points: list[AnyPoint] = [point for one in wanted for point in line_points(one, self._first_line, texts)]
        self._lines[path] = points
        # One breakpoint of the editor is one in each controller that executes the file.
        found = self._set_all(points)[:: len(texts)]
        return {"breakpoints": [self._point(one, arguments["source"]) for one in found]}

    def _set_labels(self, arguments: Arguments) -> _Body:
        self._labels = [label_point(one) for one in arguments["breakpoints"]]
        return {"breakpoints": [self._point(one) for one in self._set_all(self._labels)]}

    def _data_info(self, arguments: Arguments) -> _Body:
        debugger = self._stopped()
        reference = arguments.get("variablesReference") or 0
        machine = self._machine_of_scope(reference) if reference else self._machine_of_frame(arguments.get("frameId"))
        name = arguments["name"]
        try:
            debugger.evaluate(machine, name)
        except Misuse as error:
            return {"dataId": None, "description": str(error)}
        return {"dataId": f"{machine}/{name}", "description": f"{name} of {machine}", "accessTypes": [DATA_ACCESS]}

    def _set_data(self, arguments: Arguments) -> _Body:
        wanted = [(data_point(one), one.get("accessType") or DATA_ACCESS) for one in arguments["breakpoints"]]
        self._data = [point for point, access in wanted if access == DATA_ACCESS]
        found = iter(self._set_all(self._data))
        return {
            "breakpoints": [
                self._point(next(found))
                if access == DATA_ACCESS
                else {
                    "verified": False,
                    "message": f"accessType = {access!r}: it can stop when a value changes ({DATA_ACCESS!r})",
                }
                for _, access in wanted
            ]
        }

    def _set_all(self, wanted: Sequence[AnyPoint]) -> Sequence[SetPoint]:
        """Set all breakpoints; what became of some of them."""
        everything: list[AnyPoint] = [*(point for points in self._lines.values() for point in points), *self._labels, *self._data]
        debugger = self._started()
        found = debugger.set_breakpoints(everything)
        if self._is_no_debug:
            debugger.set_breakpoints(())
        by_point = dict(zip(everything, found, strict=True))
        return [by_point[point] for point in wanted]

    def _point(self, found: SetPoint, source: object = None) -> _Body:
        body: dict[str, object] = {"id": found.number, "verified": found.is_set and not found.note}
        if message := found.problem or found.note:
            body["message"] = message
        if found.line is not None:
            body |= {"line": found.line - 1 + self._first_line, "source": source}
        return body

    def _set_events(self, arguments: Arguments) -> _Body:
        known = {event.code: event for event in Events}
        unknown = [name for name in arguments["filters"] if name not in known]
        if unknown:
            raise Misuse(f"setExceptionBreakpoints: {unknown[0]!r} is none of {', '.join(known)}")
        if not self._is_no_debug:
            self._started().set_events([known[name] for name in arguments["filters"]])
        return {}

    def _locations(self, arguments: Arguments) -> _Body:
        texts = self._sources.of(self._sources.path(arguments["source"]))
        first = arguments["line"] - self._first_line + 1
        last = arguments.get("endLine", arguments["line"]) - self._first_line + 1
        if not texts:
            return {"breakpoints": []}
        lines = self._started().statement_lines(texts[0].machine, texts[0].text)
        return {"breakpoints": [{"line": line - 1 + self._first_line} for line in sorted(set(lines)) if first <= line <= last]}

    # ------------------------------------------------------------------ running

    def _run(self, travel: DebugTravel) -> None:
        self._travel = travel

    def _starting(self, arguments: Arguments, *, name: str) -> _Body:
        debugger = self._stopped()
        machine = self._machine(arguments["threadId"])
        travels: Mapping[str, Callable[[], DebugTravel]] = {
            "continue": debugger.running,
            "reverseContinue": debugger.running_back,
            "next": lambda: debugger.stepping_over(machine),
            "stepIn": lambda: debugger.stepping_in(machine),
            "stepOut": lambda: debugger.stepping_out(machine),
            "stepBack": lambda: debugger.stepping_back(machine),
        }
        self._run(travels[name]())
        return {"allThreadsContinued": True} if name == "continue" else {}

    def go_on(self) -> None:
        """Do a part of what runs; where nothing does, see what others do with an attached twin."""
        try:
            if self._travel is None:
                self._look()
            else:
                next(self._travel)
        except StopIteration as end:
            self._travel = None
            self._report(end.value)
        except SteptwinError as error:
            self._travel = None
            self._tell(f"error: {error}", "stderr")
            if self._attached is None:
                self._report(self._started().pause())
            else:
                self._end({})

    def _look(self) -> None:
        travel = None if self._attached is None else self._attached.unasked()
        if travel is not None:
            self._run(travel)
            self._send("continued", {"threadId": 1, "allThreadsContinued": True})

    def _end_travel(self) -> None:
        if self._travel is not None:
            self._travel.close()
            self._travel = None

    def _pause(self, arguments: Arguments) -> _Body:
        if self.is_running:
            self._end_travel()
            self._report(self._started().pause())
        return {}

    def _report(self, stop: Stopped) -> None:
        debugger, asked = self._started(), self._launch
        if stop.reason is StopReason.IDLE and debugger.has_ended and not (asked is not None and asked.stop_at_end):
            self._tell(f"{stop.text} at {_seconds(stop.time)}")
            self.has_ended = True
            self._send("terminated", {})
            self._send("exited", {"exitCode": 0})
            return
        threads = debugger.threads
        where = f" of {_seconds(debugger.present)}: the past" if debugger.is_past else ""
        body: dict[str, object] = {
            "reason": _REASONS.get(stop.reason, "pause"),
            "description": f"{stop.reason.value} at {_seconds(stop.time)}{where}",
            "threadId": threads.index(stop.machine) + 1 if stop.machine in threads else 1,
            "allThreadsStopped": True,
        }
        if stop.text:
            body["text"] = stop.text
        if stop.points:
            body["hitBreakpointIds"] = list(stop.points)
        self._send("stopped", body)

    # ------------------------------------------------------------------ what is shown

    def _threads(self, arguments: Arguments) -> _Body:
        return {"threads": [{"id": number, "name": name} for number, name in enumerate(self._started().threads, start=1)]}

    def _machine(self, thread: object) -> str:
        threads = self._started().threads
        if not isinstance(thread, int) or not 1 <= thread <= len(threads):
            raise Misuse(f"threadId = {thread!r}: permitted are 1 to {len(threads)}")
        return threads[thread - 1]

    def _machine_of_frame(self, frame: object) -> str:
        """Of the first controller where no frame is named."""
        return self._machine(1) if frame is None else self._machine_of(frame, "frameId")

    def _machine_of(self, reference: object, name: str) -> str:
        """Of a frame or scope by its number."""
        threads = self._started().threads
        if not isinstance(reference, int) or not 1 <= reference // FRAMES <= len(threads):
            raise Misuse(f"{name} = {reference!r}: nothing that is shown has this number")
        return threads[reference // FRAMES - 1]

    def _stack(self, arguments: Arguments) -> _Body:
        thread = arguments["threadId"]
        frames = self._stopped().stack(self._machine(thread))
        first = arguments.get("startFrame") or 0
        count = arguments.get("levels") or len(frames)
        shown = [
            {"id": thread * FRAMES + depth, "name": frame.name, **self._placed(frame.location)}
            for depth, frame in list(enumerate(frames))[first : first + count]
        ]
        return {"stackFrames": shown, "totalFrames": len(frames)}

    def _placed(self, location: Location) -> _Body:
        line, column = self._first_line - 1, self._first_column - 1
        return {
            "source": self._sources.plain(location.machine, location.text),
            "line": location.line + line,
            "column": location.column + column,
            "endLine": location.end_line + line,
            "endColumn": location.end_column + column,
        }

    def _loaded(self, arguments: Arguments) -> _Body:
        return {"sources": self._sources.all()}

    def _source(self, arguments: Arguments) -> _Body:
        return {"content": self._sources.numbered(arguments["sourceReference"]).source.text}

    def _scopes(self, arguments: Arguments) -> _Body:
        frame = arguments["frameId"]
        self._machine_of(frame, "frameId")
        thread = frame // FRAMES
        return {
            "scopes": [
                {"name": name, "variablesReference": thread * FRAMES + number, "expensive": name == "Registers"}
                for number, name in enumerate(SCOPES, start=1)
            ]
        }

    def _machine_of_scope(self, reference: int) -> str:
        return self._machine_of(reference, "variablesReference")

    def _scope_of(self, reference: int) -> str:
        number = reference % FRAMES
        if not 1 <= number <= len(SCOPES):
            raise Misuse(f"variablesReference = {reference}: there is no such group of values")
        return SCOPES[number - 1]

    def _variables(self, arguments: Arguments) -> _Body:
        reference = arguments["variablesReference"]
        found = self._stopped().scope(self._machine_of_scope(reference), self._scope_of(reference)).values
        first = arguments.get("start") or 0
        count = arguments.get("count") or len(found)
        return {"variables": [_variable(value) for value in found[first : first + count]]}

    def _evaluate(self, arguments: Arguments) -> _Body:
        debugger, text = self._stopped(), arguments["expression"].strip()
        if arguments.get("context") == "repl":
            word, _, rest = text.partition(" ")
            if word == "why":
                machine = self._machine_of_frame(arguments.get("frameId"))
                return {"result": _why(debugger, machine, rest.strip()).text(), "variablesReference": 0}
            if word == "help":
                return {"result": _HELP, "variablesReference": 0}
            if word == "branch" and not rest:
                debugger.branch()
                return {"result": f"the world goes on from {_seconds(debugger.now)}", "variablesReference": 0}
            if word == "go" and rest:
                self._report(debugger.go(duration(rest)))
                return {"result": f"at {_seconds(debugger.now)}", "variablesReference": 0}
        value = debugger.evaluate(self._machine_of_frame(arguments.get("frameId")), text)
        return {"result": value.text, "variablesReference": 0}

    def _set_variable(self, arguments: Arguments) -> _Body:
        machine = self._machine_of_scope(arguments["variablesReference"])
        return {"value": self._stopped().set_value(machine, arguments["name"], arguments["value"]).text}

    def _set_expression(self, arguments: Arguments) -> _Body:
        machine = self._machine_of_frame(arguments.get("frameId"))
        return {"value": self._stopped().set_value(machine, arguments["expression"].strip(), arguments["value"]).text}

    # ------------------------------------------------------------------ the console

    def _tell(self, text: str, category: str = "console") -> None:
        self._send("output", {"category": category, "output": f"{text}\n"})

    def _log(self, time: int, text: str, location: Location) -> None:
        self._send("output", {"category": "console", "output": f"{_seconds(time)}  {text}\n", **self._placed(location)})

    def _log_of_twin(self, time: int, machine: str, text: str, program: str, line: int) -> None:
        self._log(time, text, Location(machine, program, "", line, 1, line, 1))


_RUNNING = ("continue", "reverseContinue", "next", "stepIn", "stepOut", "stepBack")
_HANDLERS: Mapping[str, Callable[[Adapter, Arguments], _Body]] = {
    "initialize": Adapter._initialize,
    "launch": Adapter._launch_world,
    "attach": Adapter._attach,
    "configurationDone": Adapter._configuration_done,
    "restart": Adapter._restart,
    "disconnect": Adapter._end,
    "terminate": Adapter._end,
    "setBreakpoints": Adapter._set_lines,
    "setFunctionBreakpoints": Adapter._set_labels,
    "dataBreakpointInfo": Adapter._data_info,
    "setDataBreakpoints": Adapter._set_data,
    "setExceptionBreakpoints": Adapter._set_events,
    "breakpointLocations": Adapter._locations,
    "pause": Adapter._pause,
    "threads": Adapter._threads,
    "stackTrace": Adapter._stack,
    "loadedSources": Adapter._loaded,
    "source": Adapter._source,
    "scopes": Adapter._scopes,
    "variables": Adapter._variables,
    "evaluate": Adapter._evaluate,
    "setVariable": Adapter._set_variable,
    "setExpression": Adapter._set_expression,
    **{name: partial(Adapter._starting, name=name) for name in _RUNNING},
}


def _why(debugger: Target, machine: str, question: str) -> Answer:
    """A name alone is first one of the controller that is shown. Raises `Misuse`."""
    if not question.isidentifier() or question in debugger.threads:
        return debugger.why(question or machine)
    try:
        return debugger.why(f"{machine}.{question}")
    except (Misuse, Refusal):
        if any(value.name.lower() == question.lower() for value in debugger.scope(machine, SCOPES[0]).values):
            hint = "a data breakpoint stops where it changes"
            raise Misuse(f"{question} is a variable of {machine}, of which no past is noted: {hint}") from None
        return debugger.why(question)


def _variable(value: ShownValue) -> _Body:
    hint = {} if value.is_settable else {"presentationHint": {"attributes": ["readOnly"]}}
    evaluated = {"evaluateName": value.expression} if value.expression else {}
    return {"name": value.name, "value": value.text, "variablesReference": 0, **evaluated, **hint}


def _seconds(time: int) -> str:
    return f"{time / SECOND:.6f} s"
