"""What goes over the lines of a world in words: ``up --log-frames``."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from steptwin.live.world import LiveWorld
from steptwin.m1486.chip import Event
from steptwin.machine import Nanos
from steptwin.wire.slave import Direction, FrameObserver
from steptwin.words.characters import CharacterLog, LineSplitter
from steptwin.words.frames import FrameLine, FrameLog
from steptwin.world.lines import ChipLine, ModbusLine
from steptwin.world.trace import Record


def follow_frames(live: LiveWorld, sink: Callable[[FrameLine], None]) -> None:
    """Put what is exchanged on every line into words for ``sink``; ports that are made from now on are followed.

    Where there are several lines, a link is shown with its line: ``bus/tcp-1``.
    """
    world = live.world
    for line in world.lines.values():
        prefix = "" if len(world.lines) == 1 else f"{line.name}/"
        if isinstance(line, ModbusLine):
            line.follow_frames(_Frames(line, prefix, sink))
        elif isinstance(line, ChipLine):
            follower = _Characters(line, prefix, sink)
            line.follow_frames(follower)
            names = {name for name, (on, _) in world.plan.line_of.items() if on is line}
            world.trace.watchers.append(partial(follower.announce, names))


class _Frames:
    """Of a Modbus line."""

    def __init__(self, line: ModbusLine, prefix: str, sink: Callable[[FrameLine], None]) -> None:
        self._line = line
        self._prefix = prefix
        self._log = FrameLog(line.devices)
        self._log.sinks.append(sink)
        self._observers: dict[str, FrameObserver] = {}

    def frame(self, now: Nanos, place: str, direction: Direction, data: bytes) -> None:
        observer = self._observers.get(place)
        if observer is None:
            for gone in [name for name in self._observers if name not in self._line.places]:
                del self._observers[gone]
            there = self._line.places.get(place)
            tcp = there is not None and there.kind == "tcp"
            observer = self._observers[place] = self._log.observer(self._prefix + place, tcp=tcp)
        observer(now, direction, data)

    def rubbish(self, now: Nanos, place: str, count: int) -> None:
        self._log.rubbish(now, self._prefix + place, count)


class _Characters:
    """Of a line of M1486 chips."""

    def __init__(self, line: ChipLine, prefix: str, sink: Callable[[FrameLine], None]) -> None:
        self._line = line
        self._log = CharacterLog(next(iter(line.chain.chips.values())).variant)
        self._log.sinks.append(lambda shown: sink(shown._replace(link=prefix + shown.link)))
        self._splitters: dict[str, LineSplitter] = {}

    def frame(self, now: Nanos, place: str, direction: Direction, data: bytes) -> None:
        if direction is Direction.OUT:
            for byte in data:
                self._log.sent(now, byte)
            return
        splitter = self._splitters.get(place)
        if splitter is None:
            for gone in [name for name in self._splitters if name not in self._line.places]:
                del self._splitters[gone]
            splitter = self._splitters[place] = LineSplitter(self._log, place)
        splitter.take(data, now)

    def rubbish(self, now: Nanos, place: str, count: int) -> None:
        """Every character is one of the line."""

    def announce(self, chips: set[str], record: Record) -> None:
        """A chip announces the byte that it sends."""
        if record.kind == "event" and record.subject == "upload" and record.machine in chips:
            self._log.upload(Event(record.time, record.subject, str(record.value)))
