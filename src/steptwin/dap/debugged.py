"""Controllers that are debugged, and the numbers by which the editor refers to it: threads, frames, groups of values, lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

from steptwin.dap.sources import Sources
from steptwin.dap.target import Target
from steptwin.debug.debugger import DebugTravel
from steptwin.debug.values import Location
from steptwin.errors import Misuse

ResponseBody: TypeAlias = Mapping[str, object]
"""Body of a response or an event."""
Arguments: TypeAlias = Mapping[str, Any]

FRAMES = 1000
"""Frames of a thread, at most: a frame has the number of its thread times this, and its depth."""


class Debugged:
    """Nothing before a launch or an attachment."""

    def __init__(self) -> None:
        self.target: Target | None = None
        self.travel: DebugTravel | None = None
        """The run in progress."""
        self.sources = Sources(())
        self.first_line = self.first_column = 1
        """The editor counts from here."""

    def stopped(self) -> Target:
        """The target while nothing runs. Raises `Misuse`."""
        if self.travel is not None:
            raise Misuse("the program runs: pause it first")
        return self.started()

    def started(self) -> Target:
        """The target, whether it runs or not. Raises `Misuse` if there is none."""
        if self.target is None:
            raise Misuse("nothing was launched, and no twin was attached to")
        return self.target

    def controller(self, thread: object) -> str:
        """The controller that a thread is, by its number. Raises `Misuse`."""
        threads = self.started().threads
        if not isinstance(thread, int) or not 1 <= thread <= len(threads):
            raise Misuse(f"threadId = {thread!r}: permitted are 1 to {len(threads)}")
        return threads[thread - 1]

    def controller_of_frame(self, frame: object) -> str:
        """Controller of a frame; the first controller where no frame is named."""
        return self.controller(1) if frame is None else self.controller_of(frame, "frameId")

    def controller_of(self, reference: object, name: str) -> str:
        """Controller of a frame or scope by its number; ``name`` is that of the argument that has it. Raises `Misuse`."""
        threads = self.started().threads
        if not isinstance(reference, int) or not 1 <= reference // FRAMES <= len(threads):
            raise Misuse(f"{name} = {reference!r}: nothing that is shown has this number")
        return threads[reference // FRAMES - 1]

    def controller_of_scope(self, reference: int) -> str:
        return self.controller_of(reference, "variablesReference")

    def placed(self, location: Location) -> ResponseBody:
        """A location as the protocol has it."""
        line, column = self.first_line - 1, self.first_column - 1
        return {
            "source": self.sources.to_json(location.controller, location.text),
            "line": location.line + line,
            "column": location.column + column,
            "endLine": location.end_line + line,
            "endColumn": location.end_column + column,
        }
