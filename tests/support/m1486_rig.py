"""A host in virtual time for tests of the M1486: it types commands, reads bytes, and watches pins and motions."""

from __future__ import annotations

from typing import Any

from steptwin.controller import MILLISECOND, SECOND, PinEdge
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.events import M1486Event
from steptwin.m1486.microsteps import FULL_STEP
from steptwin.m1486.variants import variant
from steptwin.motion.divisions import StepTrain
from steptwin.motion.pulses import step_times


class Bench:
    """One chip. Commands take 1 ms unless ``statement_ns`` says otherwise; characters take no time unless ``is_timed``."""

    def __init__(self, kind: str = "B", **options: Any) -> None:
        self.chip = M1486Chip(variant(kind), **options)
        self.trains: list[tuple[int, StepTrain]] = []
        self.edges: list[PinEdge] = []
        self._revision = 0
        self.chip.changed = self._changed
        self._changed()

    def _changed(self) -> None:
        self.edges += self.chip.take_edges()
        if self.chip.drive.revision != self._revision:
            self._revision = self.chip.drive.revision
            self.trains.append((self.chip.now, self.chip.drive.train))

    @property
    def now(self) -> int:
        return self.chip.now

    def raw(self, data: bytes) -> bytes:
        """Send characters; what the chip sends at once."""
        self.chip.receive(data, self.now)
        return self.sent()

    def send(self, *lines: str) -> bytes:
        """Send lines, each with CR."""
        return self.raw("".join(f"{line}\r" for line in lines).encode("latin-1"))

    def file(self, *lines: str) -> bytes:
        return self.send("[", *lines, "]")

    def run(self, seconds: float = 0.0, *, ms: float = 0.0) -> bytes:
        """Let time pass; what the chip sends meanwhile."""
        self.chip.advance(self.now + round(seconds * SECOND + ms * MILLISECOND))
        return self.sent()

    def finish(self, limit: float = 1000.0) -> bytes:
        """Let time pass until nothing happens by itself any more."""
        end = self.now + round(limit * SECOND)
        while (due := self.chip.deadline()) is not None:
            if due > end:
                raise AssertionError(f"the chip is still busy after {limit} s")
            self.chip.advance(due)
        self.chip.advance(max(self.now, self.chip.program.ready))
        return self.sent()

    def sent(self) -> bytes:
        return b"".join(data for _, data in self.chip.to_send(self.now))

    def do(self, *lines: str) -> bytes:
        """Send lines one after the other, each when the one before has been done."""
        answers = b""
        for line in lines:
            answers += self.send(line) + self.finish()
        return answers

    def pin(self, **levels: int) -> None:
        for name, level in levels.items():
            self.chip.set_pin(name, level, self.now)

    def level(self, pin: str) -> int:
        return int(self.chip.pins()[pin])

    @property
    def counter(self) -> int:
        return self.chip.drive.counter_u(self.now)

    @property
    def true(self) -> int:
        return self.chip.drive.true_u(self.now)

    @property
    def variable(self) -> int:
        return self.chip.unit.variable

    def events(self, code: str) -> list[M1486Event]:
        return [event for event in self.chip.events if event.code == code]

    @property
    def wrong(self) -> list[str]:
        return [event.text for event in self.events("wrong-data")]

    def sum_of_pulses(self) -> int:
        """Where all pulses given so far lead, in minimum microsteps: from the trains, pulse by pulse."""
        ends = [begin for begin, _ in self.trains[1:]] + [self.now]
        return sum(way_u(train, begin, end) for (begin, train), end in zip(self.trains, ends, strict=False))


def way_u(train: StepTrain, after: int, until: int) -> int:
    """Where the pulses of a train with ``after`` < time <= ``until`` lead: their number in each division by its grid."""
    times = step_times(train, after, until)
    total = done = 0
    for begin, end, grid in train.intervals():
        change = None if end is None or end == begin else train.pulse_time(end, train.profile.start)
        upto = len(times) if end is None else done if change is None else int((times <= change).sum())
        total += (upto - done) * grid
        done = upto
    return total * train.direction


def seconds(events: list[M1486Event]) -> list[float]:
    return [event.time / SECOND for event in events]


def speed(bench: Bench) -> float:
    """Full steps/s, with its sign."""
    return bench.chip.drive.profile.velocity(bench.now) / FULL_STEP


def moving(*lines: str, kind: str = "B", seconds: float = 0.2) -> Bench:
    """A chip that has been moving for so long."""
    bench = Bench(kind)
    bench.do(*lines)
    bench.send("r")
    while not bench.chip.drive.is_busy:
        bench.run(ms=0.5)
    bench.run(seconds)
    return bench
