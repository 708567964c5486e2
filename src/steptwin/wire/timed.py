"""Controllers with the timing of a serial line and of their firmware (MIC-32).

Each character takes its bit times in both directions. A request is complete when its last character has arrived. A controller
serves one request at a time, and executes at most 100 per second, of all its ports together. Each port has room for one request,
which waits for its turn; requests that arrive on a port before its response has left are lost, as on a UART without a buffer
(`steptwin.wire.gateway` has a queue).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from steptwin.controller import MILLISECOND, Nanos
from steptwin.errors import Misuse
from steptwin.state import Stateful
from steptwin.wire import rtu
from steptwin.wire.crc import with_crc
from steptwin.wire.line import CharacterClock, SerialLine
from steptwin.wire.pdu import READS, REFUSED, WRITES
from steptwin.wire.slave import FrameCallback, FrameDirection, PauseCallback, PauseReports, SlaveDevice, SlavePort, check_units

# MIC-32: the highest rate the manual gives.
FRAME_INTERVAL_NS: Nanos = 10 * MILLISECOND
LINE_CHARACTERS = 16 * rtu.MAX_FRAME
"""Most characters that wait for the line; a real sender could not have sent more."""


@dataclass(frozen=True, slots=True)
class LineTiming:
    """Timing of a line and of the device on it.

    ``turnaround_ns`` passes between the request and the first character of the response; it cannot be shorter than the
    gap that ends the request, which is its default. ``interval_ns`` is the least time between two requests executed.
    ``strict``: a pause above 750 µs inside a frame drops the burst, as the device does (MIC-15).
    """

    line: SerialLine
    turnaround_ns: Nanos = rtu.UART_GAP_NS
    interval_ns: Nanos = FRAME_INTERVAL_NS
    strict: bool = False

    def __post_init__(self) -> None:
        if self.turnaround_ns < 0:
            raise Misuse(f"a turnaround of {self.turnaround_ns} ns is negative")
        if self.interval_ns < 0:
            raise Misuse(f"a frame interval of {self.interval_ns} ns is negative")


class Turn(NamedTuple):
    """A request that waits for its controllers. Turns come in the order in which the requests have arrived."""

    arrival: Nanos
    number: int


class TimedUnits(Stateful):
    """Controllers behind any number of ports, until when each is busy, and what waits for it. ``devices`` is read once."""

    FIXED = ("devices", "timing")
    __slots__ = (*FIXED, "_busy", "_count", "_next", "_waiting")

    def __init__(self, devices: Mapping[int, SlaveDevice], timing: LineTiming) -> None:
        check_units(devices)
        self.devices = dict(devices)
        self.timing = timing
        self._busy = dict.fromkeys(devices, 0)
        self._next = dict.fromkeys(devices, 0)  # the earliest moment of the next execution of each
        self._count = 0
        self._waiting: dict[Turn, tuple[int, ...]] = {}

    def addressed(self, unit: int, function: int) -> list[int]:
        """The units that a request is for; none for a foreign unit or a broadcast that is not a write (MIC-2)."""
        if unit == rtu.BROADCAST:
            return list(self.devices) if function in WRITES else []
        return [unit] if unit in self.devices and 0 < function < REFUSED else []

    def wait(self, units: tuple[int, ...], arrival: Nanos) -> Turn:
        """Let a request for ``units`` that arrives at ``arrival`` wait until `serves`; `done` or `withdraw` ends it."""
        self._count += 1
        turn = Turn(arrival, self._count)
        self._waiting[turn] = units
        return turn

    def withdraw(self, turn: Turn) -> None:
        """A request is not to be executed: its port has been closed."""
        self._waiting.pop(turn, None)

    def due(self, turn: Turn) -> Nanos:
        """When the units of a request are free for it, as far as is known now: not before the requests before it (`serves`)."""
        free = {unit: max(self._next[unit], self._busy[unit]) for unit in self._next}
        moment = turn.arrival
        for other in sorted(other for other in self._waiting if other <= turn):
            units = self._waiting[other]
            moment = max(other.arrival, *(free[unit] for unit in units))
            free |= dict.fromkeys(units, moment)
        return moment

    def serves(self, turn: Turn) -> bool:
        """Whether none of its units has an earlier request."""
        units = self._waiting[turn]
        return not any(other < turn and not set(units).isdisjoint(its) for other, its in self._waiting.items())

    def done(self, turn: Turn, executed: Nanos, sent: Nanos) -> None:
        """A request was executed at ``executed``, and its response has left at ``sent``."""
        for unit in self._waiting.pop(turn):
            self._next[unit] = executed + self.timing.interval_ns
            self._busy[unit] = sent


class TimedRtuSlavePort(SlavePort):
    """As `steptwin.wire.slave.RtuSlavePort`, with line timing. Responses leave when their last character would have.

    Call `to_send` at every `deadline`: a request is executed at the moment of the call that finds it due. ``gap_ns`` is the
    silence that ends a burst; with strict timing 750 µs.
    """

    broken = None
    """A serial line stays open whatever is received; only connections are closed."""

    FIXED = ("_units",)
    __slots__ = (
        *FIXED,
        "_arriving",
        "_busy",
        "_executing",
        "_framer",
        "_incoming",
        "_outgoing",
        "_pauses",
        "_responses",
        "dropped",
        "overrun",
    )

    def __init__(
        self,
        units: TimedUnits,
        *,
        gap_ns: Nanos = rtu.BURSTY_GAP_NS,
        on_frame: FrameCallback | None = None,
        on_pause: PauseCallback | None = None,
    ) -> None:
        super().__init__(on_frame)
        self._units = units
        timing = units.timing
        self._framer = rtu.StrictRtuFramer(units.devices) if timing.strict else rtu.RtuFramer(units.devices, gap_ns)
        self._incoming = CharacterClock(timing.line)
        self._outgoing = CharacterClock(timing.line)
        self._arriving: deque[tuple[Nanos, rtu.RtuFrame]] = deque()  # each frame with the moment of its last character
        self._executing: dict[int, tuple[Turn, rtu.RtuFrame]] = {}  # the request of each unit that waits for its turn
        self._busy: dict[int, Nanos] = {}  # when the last response of each unit has left
        self._responses: deque[tuple[Nanos, bytes]] = deque()
        self._pauses = PauseReports(on_pause)
        self.dropped = 0
        """Requests lost because one of this port was being served; a broadcast counts once for each unit."""
        self.overrun = 0
        """Characters lost because `LINE_CHARACTERS` were waiting."""

    @property
    def unframed(self) -> int:
        """Number of bytes received so far that belonged to no frame."""
        return self._framer.unframed

    @property
    def lost(self) -> int:
        return self.dropped

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        self._receive(data, now)
        return b"".join([response for _, response in self.to_send(now)])

    def _receive(self, data: bytes, now: Nanos) -> None:
        self._run(now)
        clock = self._incoming
        room = max(0, LINE_CHARACTERS - clock.waiting(now))
        self.overrun += max(0, len(data) - room)
        data = data[:room]
        if not data:
            return
        begin = max(now, clock.end)
        end = clock.send(len(data), now)
        for frame in self._framer.feed(data, begin, end):
            # A frame inside noise may have ended before the byte that completes its recognition.
            self._arriving.append((max(now, clock.end_before(self._framer.fed - frame.end)), frame))

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        self._run(now)
        out = []
        while self._responses and self._responses[0][0] <= now:
            moment, response = self._responses.popleft()
            out.append((moment, response))
            if response[1] >= REFUSED:
                self.exceptions += 1
            if self.on_frame is not None:
                self.on_frame(moment, FrameDirection.OUT, response)
        return out

    def deadline(self) -> Nanos | None:
        moments = [self._units.due(turn) for turn, _ in self._executing.values()]
        gap = self._framer.deadline()
        if gap is not None:
            moments.append(gap)
        if self._arriving:
            moments.append(self._arriving[0][0])
        if self._responses:
            moments.append(self._responses[0][0])
        return min(moments, default=None)

    def _run(self, now: Nanos) -> None:
        """Process everything due by ``now``: arrivals and executions in the order of their moments."""
        for frame in self._framer.expire(now):
            # The controller waits for the end of a burst, too: its turnaround begins with that silence.
            ended = self._incoming.end_before(self._framer.fed - frame.end) if self._units.timing.strict else now
            self._arriving.append((ended, frame))
        while True:
            executions = [
                (self._units.due(turn), unit) for unit, (turn, _) in self._executing.items() if self._units.serves(turn)
            ]
            execution = min(executions, default=None)
            arrival = self._arriving[0][0] if self._arriving else None
            if execution is not None and execution[0] <= now and (arrival is None or execution[0] <= arrival):
                self._execute(*execution, now)
            elif arrival is not None and arrival <= now:
                self._arrive(arrival)
            else:
                return

    def _arrive(self, moment: Nanos) -> None:
        _, frame = self._arriving.popleft()
        self.requests += 1
        if self.on_frame is not None:
            self.on_frame(moment, FrameDirection.IN, frame.raw)
        for unit in self._units.addressed(frame.unit, frame.raw[1]):
            if unit in self._executing or frame.begin < max(self._busy.get(unit, 0), self._outgoing.end):
                self.dropped += 1
            else:
                self._executing[unit] = self._units.wait((unit,), moment), frame

    def close(self) -> None:
        """The port is closed: requests that wait are not executed."""
        for turn, _ in self._executing.values():
            self._units.withdraw(turn)
        self._executing.clear()

    def _execute(self, moment: Nanos, unit: int, now: Nanos) -> None:
        turn, frame = self._executing.pop(unit)
        answer = self._units.devices[unit].execute(frame.pdu, now)
        if self.on_write is not None and frame.pdu[0] not in READS:
            self.on_write(moment, unit, frame.pdu, b"" if frame.unit == rtu.BROADCAST else answer)
        response = with_crc(frame.raw[:1] + answer)
        sent = moment
        if frame.unit != rtu.BROADCAST:
            sent = self._outgoing.send(len(response), moment + self._units.timing.turnaround_ns)
            self._responses.append((sent, response))
        self._units.done(turn, moment, sent)
        self._busy[unit] = sent
        self._pauses.served(frame, now)
