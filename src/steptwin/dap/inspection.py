"""Requests for what an editor shows of programs that stand: threads, frames, texts, groups of values."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from steptwin.dap.debugged import FRAMES, Arguments, Debugged, ResponseBody
from steptwin.debug.values import FormattedValue
from steptwin.errors import Misuse
from steptwin.subject.debugcommands import SCOPES


class Inspection:
    """Nothing of it changes what is debugged."""

    def __init__(self, debugged: Debugged) -> None:
        self._debugged = debugged

    @property
    def handlers(self) -> Mapping[str, Callable[[Arguments], ResponseBody]]:
        return {
            "threads": self._threads,
            "stackTrace": self._stack,
            "loadedSources": self._loaded,
            "source": self._source,
            "scopes": self._scopes,
            "variables": self._variables,
        }

    def _threads(self, arguments: Arguments) -> ResponseBody:
        return {
            "threads": [{"id": number, "name": name} for number, name in enumerate(self._debugged.started().threads, start=1)]
        }

    def _stack(self, arguments: Arguments) -> ResponseBody:
        thread = arguments["threadId"]
        frames = self._debugged.stopped().stack(self._debugged.controller(thread))
        first = arguments.get("startFrame") or 0
        count = arguments.get("levels") or len(frames)
        shown = [
            {"id": thread * FRAMES + depth, "name": frame.name, **self._debugged.placed(frame.location)}
            for depth, frame in list(enumerate(frames))[first : first + count]
        ]
        return {"stackFrames": shown, "totalFrames": len(frames)}

    def _loaded(self, arguments: Arguments) -> ResponseBody:
        return {"sources": self._debugged.sources.all()}

    def _source(self, arguments: Arguments) -> ResponseBody:
        return {"content": self._debugged.sources.numbered(arguments["sourceReference"]).source.text}

    def _scopes(self, arguments: Arguments) -> ResponseBody:
        frame = arguments["frameId"]
        self._debugged.controller_of(frame, "frameId")
        thread = frame // FRAMES
        return {
            "scopes": [
                {"name": name, "variablesReference": thread * FRAMES + number, "expensive": name == "Registers"}
                for number, name in enumerate(SCOPES, start=1)
            ]
        }

    def _variables(self, arguments: Arguments) -> ResponseBody:
        reference = arguments["variablesReference"]
        found = self._debugged.stopped().scope(self._debugged.controller_of_scope(reference), _scope_of(reference)).values
        first = arguments.get("start") or 0
        count = arguments.get("count") or len(found)
        return {"variables": [_variable(value) for value in found[first : first + count]]}


def _variable(value: FormattedValue) -> ResponseBody:
    hint = {} if value.is_settable else {"presentationHint": {"attributes": ["readOnly"]}}
    evaluated = {"evaluateName": value.expression} if value.expression else {}
    return {"name": value.name, "value": value.text, "variablesReference": 0, **evaluated, **hint}


def _scope_of(reference: int) -> str:
    number = reference % FRAMES
    if not 1 <= number <= len(SCOPES):
        raise Misuse(f"variablesReference = {reference}: there is no such group of values")
    return SCOPES[number - 1]
