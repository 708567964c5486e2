"""An RTU slave port on a line that takes its time.

MIC-32: each character takes its bit times in both directions, a request is there when its last character has arrived, the
device takes one request at a time and at most 100 a second; up to 16 wait, what comes beyond them is dropped.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

from steptwin.errors import Misuse
from steptwin.machine import MILLISECOND, Nanos
from steptwin.state import Stateful
from steptwin.wire import rtu
from steptwin.wire.line import CharacterClock, SerialLine
from steptwin.wire.slave import Device, Direction, FrameObserver, check_units, execute_frame

# MIC-32: the highest rate the manual gives, and the length of the queue.
FRAME_INTERVAL_NS: Nanos = 10 * MILLISECOND
QUEUE_FRAMES = 16
LINE_CHARACTERS = QUEUE_FRAMES * rtu.MAX_FRAME
"""More characters than this never wait for the line: a real sender would not have got rid of them yet."""


@dataclass(frozen=True, slots=True)
class LineTiming:
    """How fast a line and the device on it are.

    ``turnaround_ns`` passes between the request and the first character of the response; it cannot be shorter than the
    gap that ends the request, which is its default. ``interval_ns`` is the least time between two requests taken.
    """

    line: SerialLine
    turnaround_ns: Nanos = rtu.UART_GAP_NS
    interval_ns: Nanos = FRAME_INTERVAL_NS

    def __post_init__(self) -> None:
        if self.turnaround_ns < 0:
            raise Misuse(f"a turnaround of {self.turnaround_ns} ns is negative")
        if self.interval_ns < 0:
            raise Misuse(f"a frame interval of {self.interval_ns} ns is negative")


class TimedRtuSlavePort(Stateful):
    """As `steptwin.wire.slave.RtuSlavePort`, with line timing. Responses leave when their last character would have.

    Call `to_send` at every `deadline`: a request is executed at the moment of the call that finds it due.
    """

    broken = None
    """A line cannot be broken by what is on it; a connection can."""

    __slots__ = (
        "_arriving",
        "_devices",
        "_framer",
        "_free",
        "_incoming",
        "_outgoing",
        "_responses",
        "_timing",
        "_waiting",
        "dropped",
        "on_frame",
        "overrun",
    )
    FIXED = frozenset({"_devices", "_timing", "on_frame"})

    def __init__(
        self,
        devices: Mapping[int, Device],
        timing: LineTiming,
        *,
        gap_ns: Nanos = rtu.BURSTY_GAP_NS,
        on_frame: FrameObserver | None = None,
    ) -> None:
        check_units(devices)
        self._devices = dict(devices)
        self._timing = timing
        self._framer = rtu.RtuFramer(self._devices, gap_ns)
        self._incoming = CharacterClock(timing.line)
        self._outgoing = CharacterClock(timing.line)
        self._arriving: deque[tuple[Nanos, rtu.RtuFrame]] = deque()  # frames whose last character comes at that time
        self._waiting: deque[rtu.RtuFrame] = deque()  # arrived, not yet taken
        self._free: Nanos = 0  # from when on the device takes the next request
        self._responses: deque[tuple[Nanos, bytes]] = deque()
        self.dropped = 0
        """Requests that found the queue full."""
        self.overrun = 0
        """Characters that found no room on the line."""
        self.on_frame = on_frame

    @property
    def rubbish(self) -> int:
        """Bytes received so far that belonged to no frame."""
        return self._framer.rubbish

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        self.receive(data, now)
        return b"".join([response for _, response in self.to_send(now)])

    def receive(self, data: bytes, now: Nanos) -> None:
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
            # A frame inside rubbish may have been there before the byte that shows it.
            self._arriving.append((max(now, clock.end_before(self._framer.fed - frame.end)), frame))

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        self._run(now)
        out = []
        while self._responses and self._responses[0][0] <= now:
            moment, response = self._responses.popleft()
            out.append((moment, response))
            if self.on_frame is not None:
                self.on_frame(moment, Direction.OUT, response)
        return out

    def deadline(self) -> Nanos | None:
        moments = [self._framer.deadline(), self._service()]
        if self._arriving:
            moments.append(self._arriving[0][0])
        if self._responses:
            moments.append(self._responses[0][0])
        return min((moment for moment in moments if moment is not None), default=None)

    def _service(self) -> Nanos | None:
        return self._free if self._waiting else None

    def _run(self, now: Nanos) -> None:
        """Everything due until ``now``: arrivals and executions in the order of their moments."""
        for frame in self._framer.expire(now):
            self._arriving.append((now, frame))
        while True:
            service = self._service()
            arrival = self._arriving[0][0] if self._arriving else None
            if service is not None and service <= now and (arrival is None or service <= arrival):
                self._serve(service, now)
            elif arrival is not None and arrival <= now:
                self._arrive(arrival)
            else:
                return

    def _arrive(self, moment: Nanos) -> None:
        _, frame = self._arriving.popleft()
        if self.on_frame is not None:
            self.on_frame(moment, Direction.IN, frame.raw)
        if frame.unit != rtu.BROADCAST and frame.unit not in self._devices:
            return
        if len(self._waiting) == QUEUE_FRAMES:
            self.dropped += 1
            return
        if not self._waiting:
            self._free = max(self._free, moment)
        self._waiting.append(frame)

    def _serve(self, moment: Nanos, now: Nanos) -> None:
        response = execute_frame(self._devices, self._waiting.popleft(), now)
        self._free = moment + self._timing.interval_ns
        if response:
            sent = self._outgoing.send(len(response), moment + self._timing.turnaround_ns)
            self._free = max(self._free, sent)
            self._responses.append((sent, response))
