"""A pseudo terminal as a serial line: programs open its symbolic link as they would a serial port."""

from __future__ import annotations

import asyncio
import os
import select
import termios
import tty
from collections.abc import Callable
from pathlib import Path

from steptwin.controller import Port
from steptwin.errors import LineFailure, Misuse
from steptwin.files.ownership import InUse, Ownership
from steptwin.live.links import SLICE_BYTES, Feed
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.system import HAS_EPOLL, reason

DEVICES = ("/dev/pts/", "/dev/ttys")
"""Path prefixes of pseudo terminals on Linux and macOS."""
LOOK_S = 0.02
"""Interval at which a newly connected program is detected without epoll, s."""


class PtyLink:
    """A pty whose far end is reached through the symbolic link ``path``.

    Each program that opens it gets a new port: unfinished requests and unread data of the previous program are dropped. (A
    program that opens it within a fraction of a millisecond after the previous one cannot be distinguished from it.)
    """

    def __init__(self, realtime: RealTimeDriver, path: Path, make_port: Callable[[], Port]) -> None:
        self._realtime = realtime
        self.path = path.absolute()
        self._make_port = make_port
        self._loop = asyncio.get_running_loop()
        self._owned: Ownership | None = None
        self._master = -1
        self._device = ""
        self._stirring: select.epoll | None = None
        self._next_look: asyncio.Handle | None = None
        self._feed: Feed | None = None
        self._quiet = True
        """Whether nothing has been sent since the last program closed it."""

    async def open(self) -> Path:
        """Make the pty and its link. Raises `LineFailure`, or `Misuse` if the path is in use."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._take_path()
            self._master, slave = os.openpty()
            self._device = os.ttyname(slave)
            os.close(slave)
            os.set_blocking(self._master, False)
            if HAS_EPOLL:
                self._stirring = select.epoll()
                self._stirring.register(self._master, select.EPOLLIN | select.EPOLLET)
            fresh = self.path.with_name(f".{self.path.name}.{os.getpid()}")
            fresh.symlink_to(self._device)
            fresh.replace(self.path)
        except InUse as taken:
            raise Misuse(f"{self.path} is the pseudo terminal of {taken.owner}: choose another --pty") from None
        except OSError as error:
            await self.close()
            raise LineFailure(f"cannot make a pseudo terminal at {self.path}: {reason(error)}") from error
        self._left()
        return self.path

    def _take_path(self) -> None:
        """Take the path, unless something other than the link of an ended twin exists there."""
        if self.path.exists() and not self.path.is_symlink():
            raise Misuse(f"{self.path} exists and is not a link to a pseudo terminal: choose another --pty")
        self._owned = Ownership(self.path.with_name(f".{self.path.name}.lock"))
        if self.path.is_symlink():
            target = os.readlink(self.path)
            # A number under /dev/pts is given to another process as soon as its owner ends: only the lock shows whose link it is.
            if not target.startswith(DEVICES) or (self.path.exists() and not self._owned.left_behind):
                self._owned.release()
                raise Misuse(f"{self.path} is an existing link to {target}: choose another --pty")

    def write(self, data: bytes) -> None:
        """Send bytes; without room or without a program at the other end they are lost, as on a serial line."""
        if self._quiet and (self._stirring is None or _is_hung_up(self._master)):
            return
        try:
            os.write(self._master, data)
        except OSError:
            return

    # While no program has the line open the master reports a hang-up, so the loop would never rest on it. An edge-triggered epoll
    # reports that once, and then again when there is something to read or a program has come and gone. Where there is no epoll
    # the terminal is read from time to time.

    def _left(self) -> None:
        """Prepare the line for the next program after the last one has closed it."""
        self._make_raw()
        if self._feed is not None:
            self._feed.close()
        self._feed = Feed(self._realtime, self._make_port(), self)
        self._quiet = True
        if self._stirring is not None:
            self._loop.add_reader(self._stirring.fileno(), self._stirred)
            # Our own coming and going was reported too.
            self._look(self._stirring)
        else:
            self._next_look = self._loop.call_later(LOOK_S, self._look_again)

    def _make_raw(self) -> None:
        """Set raw mode again and discard unread data."""
        slave = os.open(self._device, os.O_RDWR | os.O_NOCTTY)
        try:
            # The next program may be quick: its settings and what it has sent already must not be touched.
            if not _is_raw(slave):
                tty.setraw(slave, termios.TCSANOW)
            termios.tcflush(slave, termios.TCIFLUSH)
        finally:
            os.close(slave)

    def _stirred(self) -> None:
        if self._stirring is not None and not self._look(self._stirring):
            self._left()

    def _look(self, stirring: select.epoll) -> bool:
        """Read pending input; returns whether there was any."""
        if not any(events & select.EPOLLIN for _, events in stirring.poll(0)):
            return False
        self._quiet = False
        self._loop.remove_reader(stirring.fileno())
        self._loop.add_reader(self._master, self._readable)
        return True

    def _look_again(self) -> None:
        """Check whether a program has opened the line."""
        self._next_look = None
        try:
            data = self._read()
        except BlockingIOError:  # it has sent nothing yet
            data = b""
        else:
            if not data:
                if not _is_raw(self._master):  # a program came and went meanwhile
                    self._make_raw()
                self._next_look = self._loop.call_later(LOOK_S, self._look_again)
                return
        self._quiet = False
        self._loop.add_reader(self._master, self._readable)
        self._take(data)

    def _readable(self) -> None:
        try:
            data = self._read()
        except BlockingIOError:
            return
        if data:
            self._take(data)
        else:
            self._loop.remove_reader(self._master)
            self._left()

    def _read(self) -> bytes:
        """The received bytes; empty if no program has the line open. Raises `BlockingIOError`."""
        try:
            return os.read(self._master, SLICE_BYTES)
        except BlockingIOError:
            raise
        except OSError:
            return b""

    def _take(self, data: bytes) -> None:
        if self._feed is not None and data:
            self._feed.take(data)

    async def close(self) -> None:
        if self._stirring is not None:
            self._loop.remove_reader(self._stirring.fileno())
            self._stirring.close()
            self._stirring = None
        if self._next_look is not None:
            self._next_look.cancel()
            self._next_look = None
        if self._feed is not None:
            self._feed.close()
            self._feed = None
        if self._master >= 0:
            self._loop.remove_reader(self._master)
            os.close(self._master)
            self._master = -1
        if self._owned is not None:
            if self.path.is_symlink() and os.readlink(self.path) == self._device:
                self.path.unlink()
            self._owned.release()
            self._owned = None


def _is_hung_up(master: int) -> bool:
    """Whether no program has the terminal open."""
    poll = select.poll()
    poll.register(master, 0)
    return bool(poll.poll(0))


def _is_raw(terminal: int) -> bool:
    iflag, oflag, _, lflag, *_ = termios.tcgetattr(terminal)
    return not (
        iflag & (termios.ICRNL | termios.INLCR | termios.IGNCR | termios.ISTRIP | termios.IXON)
        or oflag & termios.OPOST
        or lflag & (termios.ICANON | termios.ECHO | termios.ISIG | termios.IEXTEN)
    )
