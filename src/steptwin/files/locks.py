"""Locks on open files: flock, or its equivalent on Windows. The system releases them at the end of the process."""

from __future__ import annotations

import os
from importlib import import_module
from typing import Any

try:
    import fcntl
except ImportError:
    fcntl = None

LOCKED_BYTE = 1 << 30
"""Windows locks bytes, which others cannot read then: one far behind the end of the file."""


def lock(file: int) -> None:
    """Lock an open file. Raises `BlockingIOError` where another process, or another part of this one, has locked it."""
    if fcntl is not None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return
    msvcrt: Any = import_module("msvcrt")
    os.lseek(file, LOCKED_BYTE, os.SEEK_SET)
    try:
        msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
    except PermissionError as error:
        raise BlockingIOError(error.errno, error.strerror) from error


def unlock(file: int) -> None:
    """Unlock a file. Windows does not do so at once when it is closed."""
    if fcntl is None:
        msvcrt: Any = import_module("msvcrt")
        os.lseek(file, LOCKED_BYTE, os.SEEK_SET)
        msvcrt.locking(file, msvcrt.LK_UNLCK, 1)
