"""Requests that set breakpoints: in lines, at labels, at changes of values, for kinds of events."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from steptwin.dap.arguments import data_point, label_point, line_points
from steptwin.dap.debugged import Arguments, Debugged, ResponseBody
from steptwin.debug.breakpoints import AnyPoint
from steptwin.debug.values import Events, SetPoint
from steptwin.errors import Misuse

DATA_ACCESS = "write"
"""Reading a value changes nothing, and is not noticed."""


class EditorBreakpoints:
    """The protocol sets those of one file or of one kind at a time; what is debugged is given all of them."""

    def __init__(self, debugged: Debugged) -> None:
        self._debugged = debugged
        self._lines: dict[Path, list[AnyPoint]] = {}
        """By file."""
        self._labels: list[AnyPoint] = []
        self._data: list[AnyPoint] = []
        self.is_off = False
        """Nothing stops: the editor launched without debugging."""

    @property
    def handlers(self) -> Mapping[str, Callable[[Arguments], ResponseBody]]:
        return {
            "setBreakpoints": self._set_lines,
            "setFunctionBreakpoints": self._set_labels,
            "dataBreakpointInfo": self._data_info,
            "setDataBreakpoints": self._set_data,
            "setExceptionBreakpoints": self._set_events,
            "breakpointLocations": self._locations,
        }

    def _set_lines(self, arguments: Arguments) -> ResponseBody:
        path = self._debugged.sources.path(arguments["source"])
        texts = self._debugged.sources.of(path)
        wanted: Sequence[Arguments] = arguments.get("breakpoints") or ()
        if not texts:
            reason = f"{path.name} is not a program of this session: there are {self._debugged.sources.known}"
            return {"breakpoints": [{"verified": False, "message": reason} for _ in wanted]}
        points: list[AnyPoint] = [point for one in wanted for point in line_points(one, self._debugged.first_line, texts)]
        self._lines[path] = points
        # One breakpoint of the editor is one in each controller that executes the file.
        found = self._set_all(points)[:: len(texts)]
        return {"breakpoints": [self._point(one, arguments["source"]) for one in found]}

    def _set_labels(self, arguments: Arguments) -> ResponseBody:
        self._labels = [label_point(one) for one in arguments["breakpoints"]]
        return {"breakpoints": [self._point(one) for one in self._set_all(self._labels)]}

    def _data_info(self, arguments: Arguments) -> ResponseBody:
        debugger = self._debugged.stopped()
        reference = arguments.get("variablesReference") or 0
        controller = (
            self._debugged.controller_of_scope(reference)
            if reference
            else self._debugged.controller_of_frame(arguments.get("frameId"))
        )
        name = arguments["name"]
        try:
            debugger.evaluate(controller, name)
        except Misuse as error:
            return {"dataId": None, "description": str(error)}
        return {"dataId": f"{controller}/{name}", "description": f"{name} of {controller}", "accessTypes": [DATA_ACCESS]}

    def _set_data(self, arguments: Arguments) -> ResponseBody:
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
        debugger = self._debugged.started()
        found = debugger.set_breakpoints(everything)
        if self.is_off:
            debugger.set_breakpoints(())
        by_point = dict(zip(everything, found, strict=True))
        return [by_point[point] for point in wanted]

    def _point(self, found: SetPoint, source: object = None) -> ResponseBody:
        body: dict[str, object] = {"id": found.number, "verified": found.is_set and not found.note}
        if message := found.problem or found.note:
            body["message"] = message
        if found.line is not None:
            body |= {"line": found.line - 1 + self._debugged.first_line, "source": source}
        return body

    def _set_events(self, arguments: Arguments) -> ResponseBody:
        known = {event.code: event for event in Events}
        unknown = [name for name in arguments["filters"] if name not in known]
        if unknown:
            raise Misuse(f"setExceptionBreakpoints: {unknown[0]!r} is none of {', '.join(known)}")
        if not self.is_off:
            self._debugged.started().set_events([known[name] for name in arguments["filters"]])
        return {}

    def _locations(self, arguments: Arguments) -> ResponseBody:
        texts = self._debugged.sources.of(self._debugged.sources.path(arguments["source"]))
        first = arguments["line"] - self._debugged.first_line + 1
        last = arguments.get("endLine", arguments["line"]) - self._debugged.first_line + 1
        if not texts:
            return {"breakpoints": []}
        lines = self._debugged.started().statement_lines(texts[0].controller, texts[0].text)
        return {
            "breakpoints": [
                {"line": line - 1 + self._debugged.first_line} for line in sorted(set(lines)) if first <= line <= last
            ]
        }
