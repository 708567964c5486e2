"""An editor's session with a debugger, as the Debug Adapter Protocol has it: requests in, responses and events out.

It reads and writes nothing by itself. What runs is run in parts (`Adapter.go_on`), so that requests are answered meanwhile.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import TypeAlias

from steptwin.controller import SECOND
from steptwin.dap.attach import AttachedTwin
from steptwin.dap.breakpoints import EditorBreakpoints
from steptwin.dap.capabilities import CAPABILITIES
from steptwin.dap.debugged import Arguments, Debugged, ResponseBody
from steptwin.dap.inspection import Inspection
from steptwin.dap.launch import Launch, open_world, read_launch
from steptwin.dap.sources import Sources, texts_of
from steptwin.dap.target import Target
from steptwin.debug.debugger import Debugger, DebugTravel
from steptwin.debug.values import Location, Stopped, StopReason
from steptwin.durations import duration
from steptwin.errors import LineFailure, Misuse, Refusal, SteptwinError
from steptwin.files.world import World
from steptwin.subject.debugcommands import SCOPES
from steptwin.why.answer import Answer

_SendEvent: TypeAlias = Callable[[str, ResponseBody], None]
"""An event and its body."""

LOOK_S = 0.1
"""Period of the check whether another client lets an attached twin continue."""
_REASONS: Mapping[StopReason, str] = {
    StopReason.ENTRY: "entry",
    StopReason.STEP: "step",
    StopReason.BREAKPOINT: "breakpoint",
    StopReason.FUNCTION: "function breakpoint",
    StopReason.DATA: "data breakpoint",
    StopReason.EXCEPTION: "exception",
}
"""The others are pauses, for editors."""
_RUNNING = ("continue", "reverseContinue", "next", "stepIn", "stepOut", "stepBack")
_HELP = (
    "an expression such as n + 1 or IN3 = ON shows a value; 'go 1.5 s' goes to a moment of the past; 'branch' has the world go on"
    " from there, so that values can be changed; 'why OUT3 == 0' shows the chain of causes of a condition or a signal, 'why'"
    " alone what the program waits for"
)


class Adapter:
    """One session. ``send`` takes the events."""

    def __init__(self, send: _SendEvent) -> None:
        self._send = send
        self._debugged = Debugged()
        self._breakpoints = EditorBreakpoints(self._debugged)
        self._world: World | None = None
        self._launch: Launch | None = None
        self._attached: AttachedTwin | None = None
        self._stops_on_entry = False
        self.has_ended = False
        """The session is over."""
        self._handlers: Mapping[str, Callable[[Arguments], ResponseBody]] = {
            "initialize": self._initialize,
            "launch": self._launch_world,
            "attach": self._attach,
            "configurationDone": self._configuration_done,
            "restart": self._restart,
            "disconnect": self._end,
            "terminate": self._end,
            "pause": self._pause,
            "evaluate": self._evaluate,
            "setVariable": self._set_variable,
            "setExpression": self._set_expression,
            **{name: partial(self._starting, name=name) for name in _RUNNING},
            **self._breakpoints.handlers,
            **Inspection(self._debugged).handlers,
        }

    @property
    def is_running(self) -> bool:
        return self._debugged.travel is not None

    @property
    def patience_s(self) -> float | None:
        """How long a request may be waited for before `go_on`; None: for ever."""
        return 0.0 if self.is_running else None if self._attached is None else LOOK_S

    # ------------------------------------------------------------------ requests

    def answer(self, command: str, arguments: Arguments) -> ResponseBody:
        """The body of the response. Raises `SteptwinError` for what cannot be done."""
        handler = self._handlers.get(command)
        if handler is None:
            raise Misuse(f"{command}: there is no such request here")
        try:
            return handler(arguments)
        except SteptwinError:
            raise
        except KeyError as error:
            raise Misuse(f"{command}: the argument {error.args[0]} is missing") from error
        except (TypeError, ValueError, AttributeError) as error:
            raise Misuse(f"{command}: an argument is of another type: {error}") from error

    def after(self, command: str) -> None:
        """Send what comes after the response to a request that was answered."""
        if command in ("launch", "attach"):
            self._send("initialized", {})

    def _initialize(self, arguments: Arguments) -> ResponseBody:
        self._debugged.first_line = 1 if arguments.get("linesStartAt1", True) else 0
        self._debugged.first_column = 1 if arguments.get("columnsStartAt1", True) else 0
        return CAPABILITIES

    def _launch_world(self, arguments: Arguments) -> ResponseBody:
        self._check_fresh("launch")
        asked = read_launch(arguments)
        world = open_world(asked, self._output)
        try:
            debugger = Debugger(world)
            sources = Sources(texts_of(debugger, asked.folder))
            if asked.world is not None and asked.program is not None:
                sources.check(asked.program, asked.world)
        except SteptwinError:
            world.close()
            raise
        debugger.on_log = lambda logged: self._log(
            logged.time, logged.text, debugger.location(logged.controller, logged.location)
        )
        self._world, self._launch, self._debugged.target, self._debugged.sources = world, asked, debugger, sources
        self._stops_on_entry, self._breakpoints.is_off = asked.stop_on_entry, asked.no_debug
        return {}

    def _attach(self, arguments: Arguments) -> ResponseBody:
        self._check_fresh("attach")
        twin, stops = arguments.get("twin"), arguments.get("stopOnEntry", False)
        if twin is not None and not isinstance(twin, str):
            raise Misuse(f"attach: twin = {twin!r}: expected the name, file or address of a running twin")
        attached = AttachedTwin(twin, self._log_of_twin)
        self._debugged.target = self._attached = attached
        self._debugged.sources = Sources(texts_of(attached, attached.folder))
        self._stops_on_entry = bool(stops) or not attached.was_going
        return {}

    def _check_fresh(self, command: str) -> None:
        if self._debugged.target is not None:
            raise Misuse(f"{command}: this session has something to debug already")

    def _configuration_done(self, arguments: Arguments) -> ResponseBody:
        debugger = self._debugged.stopped()
        self._run(debugger.running_to_entry() if self._stops_on_entry else debugger.running())
        return {}

    def _restart(self, arguments: Arguments) -> ResponseBody:
        if self._world is None:
            raise Misuse("restart: a twin that runs has no beginning to go to; disconnect and attach again")
        if self.is_running:
            self._end_travel()
        debugger = self._debugged.started()
        debugger.go(debugger.begin)
        debugger.branch()
        return self._configuration_done(arguments)

    def _end(self, arguments: Arguments) -> ResponseBody:
        self._end_travel()
        if not self.has_ended:
            self.has_ended = True
            self._send("terminated", {})
        if self._world is not None:
            self._world.close()
        if self._attached is not None:
            attached, self._attached, self._debugged.target = self._attached, None, None
            with suppress(LineFailure):  # it has ended already
                attached.close()
        return {}

    # ------------------------------------------------------------------ running

    def _run(self, travel: DebugTravel) -> None:
        self._debugged.travel = travel

    def _starting(self, arguments: Arguments, *, name: str) -> ResponseBody:
        debugger = self._debugged.stopped()
        controller = self._debugged.controller(arguments["threadId"])
        travels: Mapping[str, Callable[[], DebugTravel]] = {
            "continue": debugger.running,
            "reverseContinue": debugger.running_back,
            "next": lambda: debugger.stepping_over(controller),
            "stepIn": lambda: debugger.stepping_in(controller),
            "stepOut": lambda: debugger.stepping_out(controller),
            "stepBack": lambda: debugger.stepping_back(controller),
        }
        self._run(travels[name]())
        return {"allThreadsContinued": True} if name == "continue" else {}

    def go_on(self) -> None:
        """Do a part of what runs; where nothing does, see what others do with an attached twin."""
        try:
            if self._debugged.travel is None:
                self._look()
            else:
                next(self._debugged.travel)
        except StopIteration as end:
            self._debugged.travel = None
            self._report(end.value)
        except SteptwinError as error:
            self._debugged.travel = None
            self._output(f"error: {error}", "stderr")
            if self._attached is None:
                self._report(self._debugged.started().pause())
            else:
                self._end({})

    def _look(self) -> None:
        travel = None if self._attached is None else self._attached.unasked()
        if travel is not None:
            self._run(travel)
            self._send("continued", {"threadId": 1, "allThreadsContinued": True})

    def _end_travel(self) -> None:
        if self._debugged.travel is not None:
            self._debugged.travel.close()
            self._debugged.travel = None

    def _pause(self, arguments: Arguments) -> ResponseBody:
        if self.is_running:
            self._end_travel()
            self._report(self._debugged.started().pause())
        return {}

    def _report(self, stop: Stopped) -> None:
        debugger, asked = self._debugged.started(), self._launch
        if stop.reason is StopReason.IDLE and debugger.has_ended and not (asked is not None and asked.stop_at_end):
            self._output(f"{stop.text} at {_seconds(stop.time)}")
            self.has_ended = True
            self._send("terminated", {})
            self._send("exited", {"exitCode": 0})
            return
        threads = debugger.threads
        where = f" of {_seconds(debugger.present)}: the past" if debugger.is_past else ""
        body: dict[str, object] = {
            "reason": _REASONS.get(stop.reason, "pause"),
            "description": f"{stop.reason.value} at {_seconds(stop.time)}{where}",
            "threadId": threads.index(stop.controller) + 1 if stop.controller in threads else 1,
            "allThreadsStopped": True,
        }
        if stop.text:
            body["text"] = stop.text
        if stop.points:
            body["hitBreakpointIds"] = list(stop.points)
        self._send("stopped", body)

    # ------------------------------------------------------------------ expressions

    def _evaluate(self, arguments: Arguments) -> ResponseBody:
        debugger, text = self._debugged.stopped(), arguments["expression"].strip()
        if arguments.get("context") == "repl":
            word, _, rest = text.partition(" ")
            if word == "why":
                controller = self._debugged.controller_of_frame(arguments.get("frameId"))
                return {"result": _why(debugger, controller, rest.strip()).text(more=""), "variablesReference": 0}
            if word == "help":
                return {"result": _HELP, "variablesReference": 0}
            if word == "branch" and not rest:
                debugger.branch()
                return {"result": f"the world goes on from {_seconds(debugger.now)}", "variablesReference": 0}
            if word == "go" and rest:
                self._report(debugger.go(duration(rest)))
                return {"result": f"at {_seconds(debugger.now)}", "variablesReference": 0}
        value = debugger.evaluate(self._debugged.controller_of_frame(arguments.get("frameId")), text)
        return {"result": value.text, "variablesReference": 0}

    def _set_variable(self, arguments: Arguments) -> ResponseBody:
        controller = self._debugged.controller_of_scope(arguments["variablesReference"])
        return {"value": self._debugged.stopped().set_value(controller, arguments["name"], arguments["value"]).text}

    def _set_expression(self, arguments: Arguments) -> ResponseBody:
        controller = self._debugged.controller_of_frame(arguments.get("frameId"))
        return {"value": self._debugged.stopped().set_value(controller, arguments["expression"].strip(), arguments["value"]).text}

    # ------------------------------------------------------------------ the console

    def _output(self, text: str, category: str = "console") -> None:
        self._send("output", {"category": category, "output": f"{text}\n"})

    def _log(self, time: int, text: str, location: Location) -> None:
        self._send("output", {"category": "console", "output": f"{_seconds(time)}  {text}\n", **self._debugged.placed(location)})

    def _log_of_twin(self, time: int, controller: str, text: str, program: str, line: int) -> None:
        self._log(time, text, Location(controller, program, "", line, 1, line, 1))


def _why(debugger: Target, controller: str, question: str) -> Answer:
    """A name alone is first one of the controller that is shown. Raises `Misuse`."""
    if not question.isidentifier() or question in debugger.threads:
        return debugger.why(question or controller)
    try:
        return debugger.why(f"{controller}.{question}")
    except (Misuse, Refusal):
        if any(value.name.lower() == question.lower() for value in debugger.scope(controller, SCOPES[0]).values):
            hint = "a data breakpoint stops where it changes"
            raise Misuse(f"{question} is a variable of {controller}, of which no past is noted: {hint}") from None
        return debugger.why(question)


def _seconds(time: int) -> str:
    return f"{time / SECOND:.6f} s"
