"""Terminals of chips in the time of a wire: their thread works only while somebody waits for it, one look at the line after the
other, so that what is typed and shown has its moment."""

from __future__ import annotations

import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
from line_rig import VirtualWire

from steptwin.controller import SECOND
from steptwin.drivers.m1486 import conversation, terminal
from steptwin.drivers.m1486.terminal import ChipTerminal
from steptwin.drivers.tcp import Channel
from steptwin.m1486.variants import Variant


class Turns:
    """Either the script works, or the thread of a terminal until it looks at the line again."""

    def __init__(self, wire: VirtualWire) -> None:
        self._wire = wire
        self._go = threading.Semaphore(0)
        self._back = threading.Semaphore(0)
        self._thread: threading.Thread | None = None

    def install(self, patch: pytest.MonkeyPatch) -> None:
        """Terminals of conversations take turns from now on."""
        turns = self

        class Condition(threading.Condition):
            was_notified = False

            def notify_all(self) -> None:
                self.was_notified = True

            def wait(self, timeout: float | None = None) -> bool:
                self.was_notified = False
                self.release()
                turns.give()
                self.acquire()
                return self.was_notified

        class Thread(threading.Thread):
            def __init__(self, *, target: Callable[[], None], daemon: bool) -> None:
                super().__init__(target=turns.begun, args=(target,), daemon=daemon)
                turns._thread = self

            def join(self, timeout: float | None = None) -> None:
                while turns._thread is self:
                    turns.give()
                super().join(timeout)

        def opened(
            channel: Channel, baud: int, variant: Variant | None, show: Callable[[str], object], *, earlier: int
        ) -> ChipTerminal:
            taking_turns = TurnChannel(channel, turns)
            return ChipTerminal(taking_turns, baud, variant, show, earlier=earlier, clock=lambda: turns._wire.now / SECOND)

        patch.setattr(terminal, "threading", SimpleNamespace(Condition=Condition, Thread=Thread))
        patch.setattr(conversation, "ChipTerminal", opened)
        patch.setattr(conversation, "time", SimpleNamespace(sleep=self.sleep))

    def begun(self, work: Callable[[], None]) -> None:
        """The thread: it works in its turns only."""
        self._go.acquire()
        try:
            work()
        finally:
            self._thread = None
            self._back.release()

    def give(self) -> None:
        """The thread has a turn, if there is one."""
        if self._thread is not None:
            self._go.release()
            self._back.acquire()

    def end(self) -> None:
        """The turn of the thread is over; returns with its next one."""
        self._back.release()
        self._go.acquire()

    def sleep(self, seconds: float) -> None:
        """Time passes, in which the thread looks at the line."""
        end = self._wire.now + round(seconds * SECOND)
        while self._thread is not None and self._wire.now < end:
            self.give()
        if self._wire.now < end:
            self._wire.sleep((end - self._wire.now) / SECOND)


class TurnChannel:
    """A channel whose reader has turns."""

    def __init__(self, channel: Channel, turns: Turns) -> None:
        self._channel: Any = channel
        self._turns = turns
        self.write = self._channel.write
        self.close = self._channel.close

    def read(self, timeout_s: float) -> bytes:
        self._turns.end()
        data: bytes = self._channel.read(timeout_s)
        return data
