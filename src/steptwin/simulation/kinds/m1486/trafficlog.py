"""Words for the traffic on a line of M1486 chips."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

from steptwin.controller import Nanos
from steptwin.m1486.characterlog import CharacterLog, LineSplitter
from steptwin.simulation.kinds.m1486.line import ChipLine
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection

SELECTS = "X"
ALL = "G"


class ChipTrafficLog:
    """Log of the characters of a line. As `steptwin.simulation.kinds.lines.TrafficLog`."""

    def __init__(self, line: ChipLine, prefix: str, sink: Callable[[FrameLine], None]) -> None:
        self._line = line
        self._log = CharacterLog(next(iter(line.chain.chips.values())).variant)
        self._log.sinks.append(lambda shown: sink(shown._replace(link=prefix + shown.link)))
        self._splitters: dict[str, LineSplitter] = {}
        self._listening: Collection[int] | None = None
        """Chips that hear what is sent next, as far as that was sent and has not arrived."""

    def frame(self, now: Nanos, client: str, direction: FrameDirection, data: bytes) -> None:
        if direction is FrameDirection.OUT:
            for byte in data:
                self._log.sent(now, byte)
            return
        splitter = self._splitters.get(client)
        if splitter is None:
            for gone in [name for name in self._splitters if name not in self._line.clients]:
                del self._splitters[gone]
            splitter = self._splitters[client] = LineSplitter(self._log, client)
        splitter.take(data, now)

    def unframed(self, now: Nanos, client: str, count: int) -> None:
        """Every character is one of the line."""

    def changes(self, client: str, data: bytes) -> Collection[int]:
        chips, heard = self._line.chain.chips, set[int]()
        if self._listening is None or not self._line.is_timed:
            self._listening = [one for one, chip in chips.items() if chip.receiver.is_listening]
        for line in _lines(data):
            if line.startswith(SELECTS):
                wanted = line.removeprefix(SELECTS)
                self._listening = [one for one, chip in chips.items() if wanted in (ALL, f"{chip.address:X}")]
            elif line:
                heard.update(self._listening)
        return heard

    def selects(self, data: bytes) -> bool:
        return any(line.startswith(SELECTS) for line in _lines(data))

    def refusal(self, client: str, data: bytes) -> str | None:
        return None  # a chip executes what it receives

    def recorded(self, record: TraceRecord) -> None:
        """A chip announces the byte that it sends."""
        if record.kind == "event" and record.subject == "upload":
            self._log.upload(**dict(record.facts))


def _lines(data: bytes) -> Sequence[str]:
    return data.decode("latin-1").upper().replace(" ", "").replace("\n", "").split("\r")
