"""``python other_system.py COMMAND ...``: the command ``steptwin`` as on a system with none of what Windows lacks.

No epoll, no poll, no pseudo terminals, no Unix sockets, no users, no fork, no calls that do not wait, no handlers of signals
and no readers in event loops. Windows' own modules are stood in for: ``msvcrt``, and serialx' serial ports (`com_ports`).
asyncio itself remains that of this system.
"""

from __future__ import annotations

import asyncio
import asyncio.unix_events
import importlib.abc
import os
import select
import selectors  # noqa: F401 - as long as there is epoll
import signal
import socket
import subprocess  # noqa: F401 - that of this system
import sys
from functools import partial
from importlib.machinery import ModuleSpec
from importlib.util import spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

MODULES = ("termios", "fcntl", "resource", "pty", "tty", "grp", "pwd")
NAMES: tuple[tuple[ModuleType, tuple[str, ...]], ...] = (
    (select, ("epoll", "poll")),
    (socket, ("AF_UNIX", "MSG_DONTWAIT")),
    (signal, ("SIGHUP", "SIGQUIT", "SIGALRM", "SIGUSR1", "pthread_sigmask", "pause")),
    (
        os,
        (
            "getuid", "geteuid", "getgid", "getegid", "fork", "forkpty", "openpty", "ttyname", "pread", "pwrite",
            "O_NONBLOCK", "O_NOFOLLOW", "O_DIRECTORY", "O_CLOEXEC", "O_NOCTTY",
        ),
    ),
)  # fmt: skip
LOOP_METHODS = ("add_signal_handler", "remove_signal_handler", "add_reader", "remove_reader", "add_writer", "create_unix_server")


class _Finder(importlib.abc.MetaPathFinder):
    def find_spec(self, fullname: str, path: Any, target: Any = None) -> ModuleSpec | None:
        if fullname in MODULES:
            raise ModuleNotFoundError(f"No module named {fullname!r}", name=fullname)
        if fullname == "serialx.platforms.serial_win32":
            return spec_from_file_location(fullname, Path(__file__).with_name("com_ports.py"))
        return None


def msvcrt_stand_in() -> ModuleType:
    """``msvcrt`` as far as it is used: locks of bytes, which here are flocks of files."""
    import fcntl

    module: Any = ModuleType("msvcrt")
    module.LK_NBLCK, module.LK_UNLCK = 2, 0

    def locking(file: int, mode: int, count: int) -> None:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB if mode == module.LK_NBLCK else fcntl.LOCK_UN)
        except BlockingIOError as error:
            raise PermissionError(13, "Permission denied") from error

    module.locking = locking
    module.kbhit = lambda: False
    return module


def _absent(*arguments: object, **named: object) -> NoReturn:
    raise NotImplementedError


def become_another_system() -> None:
    """From now on, in this process, what Windows lacks is missing. Before steptwin is imported."""
    sys.modules["msvcrt"] = msvcrt_stand_in()
    socket.socketpair = partial(socket.socketpair, socket.AF_UNIX)  # event loops have one, on Windows too
    for name in MODULES:
        sys.modules.pop(name, None)
    sys.meta_path.insert(0, _Finder())
    for module, names in NAMES:
        for name in names:
            delattr(module, name)
    for name in LOOP_METHODS:
        setattr(asyncio.unix_events._UnixSelectorEventLoop, name, _absent)


if __name__ == "__main__":
    become_another_system()
    from steptwin.cli import main

    main()
