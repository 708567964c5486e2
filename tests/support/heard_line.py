"""A line in memory at which somebody listens (`steptwin sniff`)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from line_rig import VirtualWire

from steptwin.controller import MILLISECOND
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection


class HeardWire(VirtualWire):
    """Before the wire of a kind of controllers in the bases of a class: `listen` comes first."""

    def listen(self, decoder: Callable[[Callable[[FrameLine], None]], Any], shown: Callable[[FrameLine], str]) -> None:
        """``decoder`` is made for a sink; ``shown`` are the words about a line."""
        self._begun = self.now
        self._heard: list[str] = []
        self._shown = shown
        self._decoder = decoder(self._take)

    def _take(self, line: FrameLine) -> None:
        arrow = ">" if line.direction is FrameDirection.IN else "<"
        self._heard.append(f"{(line.time - self._begun) / MILLISECOND:.9g} {arrow} {self._shown(line)}")

    def heard(self) -> list[str]:
        """What was heard since the last time."""
        self._expire()
        new = self._heard[:]
        self._heard.clear()
        return new

    def _expire(self) -> None:
        while (due := self._decoder.deadline()) is not None and due <= self.now:
            self._decoder.expire(due)

    def _receive(self, data: bytes) -> bytes:
        self._expire()
        self._decoder.feed(data, self.now, FrameDirection.IN)
        return super()._receive(data)

    def _step(self) -> list[bytes]:
        arrived = super()._step()
        for data in arrived:
            self._expire()
            self._decoder.feed(data, self.now, FrameDirection.OUT)
        return arrived
