"""Signals that end a server: Ctrl-C, SIGTERM and a closed terminal."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Callable
from typing import Any

ENDING = tuple(
    number
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
    if (number := getattr(signal, name, None)) is not None
)  # fmt: skip
"""The ending signals of this system: SIGHUP on POSIX, SIGBREAK (Ctrl-Break) on Windows."""


def on_end(loop: asyncio.AbstractEventLoop, act: Callable[[], object]) -> None:
    """Call ``act`` in ``loop`` for every signal that ends a process, except ignored ones (nohup).

    Where loops take no signals (Windows), the handlers are those of the process and outlive the loop.
    """
    for number in ENDING:
        if signal.getsignal(number) is not signal.SIG_IGN:
            try:
                loop.add_signal_handler(number, act)
            except NotImplementedError:
                signal.signal(number, _handler(loop, act))


def _handler(loop: asyncio.AbstractEventLoop, act: Callable[[], object]) -> Callable[[int, Any], None]:
    def take(number: int, frame: Any) -> None:
        if not loop.is_closed():
            loop.call_soon_threadsafe(act)

    return take
