"""Keys and signals that end a motion by hand."""

from __future__ import annotations

import contextlib
import signal
import sys
from collections.abc import Callable, Generator
from importlib import import_module
from typing import Any

ENDING = tuple(found for name in ("SIGTERM", "SIGHUP", "SIGBREAK") if (found := getattr(signal, name, None)) is not None)
"""Besides Ctrl-C; Windows has no SIGHUP, others no SIGBREAK."""


@contextlib.contextmanager
def interruptible() -> Generator[None]:
    """SIGTERM and a closed terminal end a motion as Ctrl-C does."""
    kept = {number: signal.signal(number, signal.default_int_handler) for number in ENDING}
    try:
        yield
    finally:
        for number, handler in kept.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def keys() -> Generator[Callable[[], bool]]:
    """Whether a key was pressed."""
    if not sys.stdin.isatty():
        yield lambda: False
        return
    try:
        import termios
        import tty
    except ImportError:  # Windows
        console: Any = import_module("msvcrt")
        yield console.kbhit
        return
    import select

    kept = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    try:
        yield lambda: bool(select.select([sys.stdin], [], [], 0)[0])
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSAFLUSH, kept)
