"""A world in real time, and the places of its lines for programs outside."""

from __future__ import annotations

from collections.abc import Callable

from steptwin.errors import Misuse
from steptwin.files import session as sessions
from steptwin.files.world import World
from steptwin.machine import Nanos
from steptwin.world.actions import Bytes, Leave, Outside
from steptwin.world.lines import Place

MOST_INPUTS = 200_000
MOST_INPUT_BYTES = 16 << 20
"""Where a recorded session ends, so that its memory and its file stay bounded."""


class LiveWorld:
    """A world as a `Cell` keeps it up with real time."""

    def __init__(self, world: World, tell: Callable[[str], None] = lambda _: None) -> None:
        self.world = world
        self._tell = tell
        self._recorded_bytes = sum(_size(given.what) for given in world.inputs)
        self._full: sessions.Session | None = None
        self.stale = True
        """Something was done to it since somebody asked for the deadline."""
        self.on_stop: Callable[[], None] | None = None
        """Told when a script has stopped it: nothing happens by itself from then on."""

    @property
    def now(self) -> Nanos:
        return self.world.now

    def outside(self, what: Outside) -> None:
        """Do something from outside at the present moment, recorded where a session was asked for. Raises `Misuse`."""
        world = self.world
        if world.keeps_inputs:
            if len(world.inputs) >= MOST_INPUTS or self._recorded_bytes >= MOST_INPUT_BYTES:
                self._end_session()
            else:
                self._recorded_bytes += _size(what)
        world.outside(what)

    def _end_session(self) -> None:
        world = self.world
        self._full = sessions.session_of(world)
        world.keeps_inputs = False
        world.inputs.clear()
        self._tell(f"the session is full and ends at {world.time:g} s, after {len(self._full.inputs)} inputs")

    def session(self) -> sessions.Session:
        """The session up to now, or up to where it was full. Raises `Misuse` where none is recorded."""
        if self._full is not None:
            return self._full
        if not self.world.keeps_inputs:
            raise Misuse("this world records no session: start it with --session FILE")
        return sessions.session_of(self.world)

    def advance(self, now: Nanos) -> None:
        world = self.world
        while (due := self._due()) is not None and due <= now:
            world.advance(due)
            if world.stopped is not None:
                break
            for kernel in world.kernels:
                at = kernel.deadline()
                if at is not None and at <= due:
                    kernel.advance(due)
        world.advance(now)
        if world.stopped is not None and self.on_stop is not None:
            self.on_stop()

    def deadline(self) -> Nanos | None:
        self.stale = False
        return self._due()

    def _due(self) -> Nanos | None:
        if self.world.stopped is not None:
            return None
        dues = [due for kernel in self.world.kernels if (due := kernel.deadline()) is not None]
        own = self.world.next()
        return min(dues if own is None else [*dues, own], default=None)


def _size(what: Outside) -> int:
    return len(what.data) if isinstance(what, Bytes) else 0


class PlacePort:
    """A place on a line for a program outside."""

    broken: str | None = None

    def __init__(self, live: LiveWorld, line: str, place: str, kind: str) -> None:
        self._live = live
        self._line = line
        self._name = place
        self._kind = kind
        self.on_output: Callable[[], None] | None = None

    def _place(self) -> Place:
        place = self._live.world.lines[self._line].connect(self._name, self._kind)
        place.on_output = self._came
        return place

    def _came(self) -> None:
        if self.on_output is not None:
            self.on_output()

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        place = self._place()
        place.on_output = None  # what comes at once is given back at once
        self._live.outside(Bytes(self._line, self._name, self._kind, data))
        self._live.stale = True
        answer = b"".join(piece for _, piece in place.take(now))
        place.on_output = self._came
        self.broken = place.port.broken
        return answer

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        self._live.world.touch(self._line)
        return self._place().take(now)

    def deadline(self) -> Nanos | None:
        """Nothing to be asked for: ``on_output`` tells when there is something."""
        return None

    def close(self) -> None:
        self._live.outside(Leave(self._line, self._name))
