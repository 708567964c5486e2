"""A pseudo terminal as a serial line: programs open its symbolic link as they would a serial port."""

from __future__ import annotations

import asyncio
import os
import select
import termios
import tty
from collections.abc import Callable
from pathlib import Path

from steptwin.errors import LineFailure, Misuse
from steptwin.files.ownership import InUse, Ownership
from steptwin.live.cell import Cell
from steptwin.live.links import SLICE_BYTES, Feed, where
from steptwin.machine import Port

PTS = "/dev/pts/"


class PtyLink:
    """A pty whose far end is reached through the symbolic link ``path``.

    A program that opens it meets a new port: what one that went away had begun or had not read is not there for the next. (Where
    the next is there before the hang-up has been noticed, within a fraction of a millisecond, they cannot be told apart.)
    """

    def __init__(self, cell: Cell, path: Path, make_port: Callable[[], Port]) -> None:
        self._cell = cell
        self.path = path.absolute()
        self._make_port = make_port
        self._loop = asyncio.get_running_loop()
        self._owned: Ownership | None = None
        self._master = -1
        self._device = ""
        self._stirring: select.epoll | None = None
        self._feed: Feed | None = None
        self._quiet = True
        """Nobody has sent anything since the last program left."""

    async def open(self) -> Path:
        """Make the pty and its link. Raises `LineFailure`, or `Misuse` where the path is taken."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._take_path()
            self._master, slave = os.openpty()
            self._device = os.ttyname(slave)
            os.close(slave)
            os.set_blocking(self._master, False)
            self._stirring = select.epoll()
            self._stirring.register(self._master, select.EPOLLIN | select.EPOLLET)
            fresh = self.path.with_name(f".{self.path.name}.{os.getpid()}")
            fresh.symlink_to(self._device)
            fresh.replace(self.path)
        except InUse as taken:
            raise Misuse(f"{self.path} is the pseudo terminal of {taken.owner}: choose another --pty") from None
        except OSError as error:
            await self.close()
            raise LineFailure(f"cannot make a pseudo terminal at {self.path}: {where(error)}") from error
        self._left()
        return self.path

    def _take_path(self) -> None:
        """Own the path, unless something lies there that is not what a twin left behind."""
        if self.path.exists() and not self.path.is_symlink():
            raise Misuse(f"{self.path} exists and is no link to a pseudo terminal: choose another --pty")
        self._owned = Ownership(self.path.with_name(f".{self.path.name}.lock"))
        if self.path.is_symlink():
            target = os.readlink(self.path)
            # A number under /dev/pts is given to another process as soon as its owner ends: only the lock shows whose link it is.
            if not target.startswith(PTS) or (self.path.exists() and not self._owned.left_behind):
                self._owned.release()
                raise Misuse(f"{self.path} is somebody's link to {target}: choose another --pty")

    def write(self, data: bytes) -> None:
        """Send; what finds no room or no program there is lost, as on a serial line whose other end does not listen."""
        if self._quiet and _is_hung_up(self._master):
            return
        try:
            os.write(self._master, data)
        except OSError:
            return

    # While no program has the line open the master reports a hang-up, so the loop would never rest on it. An edge-triggered epoll
    # reports that once, and then again when there is something to read or a program has come and gone.

    def _left(self) -> None:
        """The last program closed the line: raw again, emptied of what it had not read, and a new port for the next one."""
        slave = os.open(self._device, os.O_RDWR | os.O_NOCTTY)
        try:
            # The next program may be quick: its settings and what it has sent already must not be touched.
            if not _is_raw(slave):
                tty.setraw(slave, termios.TCSANOW)
            termios.tcflush(slave, termios.TCIFLUSH)
        finally:
            os.close(slave)
        if self._feed is not None:
            self._feed.close()
        self._feed = Feed(self._cell, self._make_port(), self)
        self._quiet = True
        if self._stirring is not None:
            self._loop.add_reader(self._stirring.fileno(), self._stirred)
            # Our own coming and going was reported too.
            self._look(self._stirring)

    def _stirred(self) -> None:
        if self._stirring is not None and not self._look(self._stirring):
            self._left()

    def _look(self, stirring: select.epoll) -> bool:
        """Whether there is something to read; it is read then."""
        if not any(events & select.EPOLLIN for _, events in stirring.poll(0)):
            return False
        self._quiet = False
        self._loop.remove_reader(stirring.fileno())
        self._loop.add_reader(self._master, self._readable)
        return True

    def _readable(self) -> None:
        try:
            data = os.read(self._master, SLICE_BYTES)
        except BlockingIOError:
            return
        except OSError:
            self._loop.remove_reader(self._master)
            self._left()
            return
        if self._feed is not None:
            self._feed.take(data)

    async def close(self) -> None:
        if self._stirring is not None:
            self._loop.remove_reader(self._stirring.fileno())
            self._stirring.close()
            self._stirring = None
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
