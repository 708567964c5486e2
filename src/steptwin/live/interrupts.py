"""Ctrl-C for commands that keep their results so far."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any, Self


class FirstInterrupt:
    """A context in which the first SIGINT only sets ``came``; the second one ends the process as usual.

    It has no effect outside the main thread.
    """

    def __init__(self) -> None:
        self.came = False
        self._usual: Any = None
        self._is_set = False

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            self._usual = signal.signal(signal.SIGINT, self._take)
            self._is_set = True
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._put_back()

    def _take(self, number: int, frame: FrameType | None) -> None:
        self.came = True
        self._put_back()

    def _put_back(self) -> None:
        if self._is_set:
            self._is_set = False
            signal.signal(signal.SIGINT, self._usual)
