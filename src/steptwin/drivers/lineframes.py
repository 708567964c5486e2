"""The frames of a line of a driver, for those who subscribe to them."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import partial
from typing import Any, NamedTuple

from steptwin.drivers.exchange import Exchanger, LineRequest
from steptwin.errors import LineFailure
from steptwin.wire.slave import FrameDirection

FRAMES = "line frames"
"""The key of the `LineFrames` in a line's shared state."""


class SeenFrame(NamedTuple):
    """A frame or characters to the device with an address on the line, or from it. One that did not come has no bytes."""

    device: Hashable
    direction: FrameDirection
    raw: bytes
    meaning: str


class LineFrames:
    """The frames of a line. While nobody subscribes to them, nothing is observed or put into words.

    ``observe`` is called with whether somebody subscribes; the protocol then calls `take`.
    """

    def __init__(self, exchanger: Exchanger[Any, Any], observe: Callable[[bool], object]) -> None:
        self._exchanger = exchanger
        self._observe = observe
        self._sinks: list[Callable[[SeenFrame], object]] = []

    def subscribe(self, sink: Callable[[SeenFrame], object]) -> Callable[[], None]:
        """Give each frame to ``sink``; the result ends that."""
        self._sinks.append(sink)
        if len(self._sinks) == 1:
            self._observe(True)
            self._exchanger.on_missed = self._missed
        return partial(self._end, sink)

    def _end(self, sink: Callable[[SeenFrame], object]) -> None:
        if sink in self._sinks:
            self._sinks.remove(sink)
            if not self._sinks:
                self._observe(False)
                self._exchanger.on_missed = None

    def take(self, device: Hashable, direction: FrameDirection, raw: bytes, meaning: str) -> None:
        for sink in list(self._sinks):
            sink(SeenFrame(device, direction, raw, meaning))

    def _missed(self, request: LineRequest, error: LineFailure) -> None:
        self.take(request.device, FrameDirection.OUT, b"", str(error))
