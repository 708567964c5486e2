"""Features of operating systems. Other modules ask here, so that they need not know on which system they run."""

from __future__ import annotations

import errno
import os
import select
import signal
import sys
from pathlib import Path

HAS_EPOLL = hasattr(select, "epoll")
"""Linux: many descriptors are watched as one. Elsewhere links are asyncio's."""

HAS_PTYS = hasattr(os, "openpty")
"""Pseudo terminals: Linux and macOS."""

HAS_OWNERS = hasattr(os, "fchown")
"""Files have an owner, a group and permissions: not on Windows."""

READ_FLAGS = (
    os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
)  # fmt: skip
"""Open for reading: no waiting for the other end of a pipe, not inherited by processes, no translation of line ends."""
OWN_SIGNAL: signal.Signals = getattr(signal, "SIGUSR1", None) or signal.Signals(21)
"""A signal that means what a program says; where there is no SIGUSR1, the SIGBREAK of Windows, which is 21."""

WRITE_FLAGS = os.O_WRONLY | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
"""Open for writing: not inherited by processes, no translation of line ends."""
PIPE_FLAGS = WRITE_FLAGS | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0)
"""Open a pipe or a device for writing: no waiting for the other end."""
LOCK_FLAGS = READ_FLAGS | os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
"""Make or open a file to lock it, through no symbolic link."""


def reason(error: Exception) -> str:
    """The reason of an error as text; of a system error without the additions of libraries, such as the address."""
    if not isinstance(error, OSError):
        return str(error) or type(error).__name__
    if "ssl" in sys.modules and isinstance(error, sys.modules["ssl"].SSLError):  # its number is none of the system
        said = getattr(error, "verify_message", None) or (error.reason or str(error)).replace("_", " ")
        return said.lower()
    number = error.errno if error.errno in errno.errorcode else None
    return (error.strerror or str(error) if number is None else os.strerror(number)).lower() or type(error).__name__


def user() -> int | None:
    """The number of this user; None where users have no numbers (Windows)."""
    return os.getuid() if hasattr(os, "getuid") else None


def is_own(found: os.stat_result) -> bool:
    """Whether a file belongs to this user. Windows does not say; the directories used there are private to the user."""
    number = user()
    return number is None or found.st_uid == number


def sync_directory(directory: Path) -> None:
    """Make renames and new names in a directory survive power loss, where a directory can be opened (not on Windows) and its file
    system can do that. Raises `OSError` for a disk that fails."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    try:
        handle = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
    except PermissionError:  # names can be made in it, but not be listed
        return
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in {errno.EINVAL, errno.ENOTSUP}:
            raise
    finally:
        os.close(handle)


def processors() -> int:
    """The processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def process_exists(number: int) -> bool:
    """Whether a process of this number is running."""
    if sys.platform == "win32":  # on Windows os.kill ends the process, whatever the signal
        import ctypes

        synchronize = 0x00100000
        kernel = ctypes.windll.kernel32
        handle = kernel.OpenProcess(synchronize, False, number)
        if handle:
            kernel.CloseHandle(handle)
        return bool(handle)
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True  # of another user
    return True
