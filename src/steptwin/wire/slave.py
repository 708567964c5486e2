"""Devices behind a Modbus line: the frames addressed to them are executed and answered.

A port serves one line or one connection, as a `steptwin.controller.Port`.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterable, Mapping
from typing import Protocol, TypeAlias

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.state import Stateful
from steptwin.wire import mbap, rtu
from steptwin.wire.crc import crc16, with_crc
from steptwin.wire.line import SerialLine
from steptwin.wire.pdu import GATEWAY_TARGET_FAILED, READS, REFUSED, WRITE_MULTIPLE_REGISTERS, WRITES, exception_pdu

_PLAIN = bytes(3)
"""Protocol 0 and a length below 256, in an MBAP header from its third byte."""
_HEADERS = {size: bytes((0, 0, 0, size - 6)) for size in range(8, 261)}
"""The third to the sixth byte of an MBAP header, by the size of the whole frame."""
_LENGTHS = [bytes((size + 1,)) for size in range(255)]
"""The low byte of the length in the header of a response, by the size of its PDU."""


class SlaveDevice(Protocol):
    """A device that executes the requests for a unit."""

    def execute(self, pdu: bytes, now: Nanos) -> bytes:
        """Advance to ``now``, execute a request PDU and return the response PDU; a refusal is an exception PDU."""
        ...


class FrameDirection(enum.Enum):
    IN = "in"
    OUT = "out"


FrameCallback: TypeAlias = Callable[[Nanos, FrameDirection, bytes], None]
"""Called with the moment, the direction and the bytes of every whole frame on the wire, also of foreign units and broadcasts."""

WriteCallback: TypeAlias = Callable[[Nanos, int, bytes, bytes], None]
"""Called with the moment, the unit, the request PDU and the response PDU of every request that was executed and is no read. Unit
0 is a broadcast, whose response PDU is empty."""

PauseCallback: TypeAlias = Callable[[int, Nanos], None]
"""Called after a request with a pause of more than 750 µs, for which the device drops a frame (MIC-15): with its unit
(0: broadcast) and the pause, ns."""

PAUSE_REPORT_NS: Nanos = SECOND
"""Least interval between two reports of a port."""


class SlavePort(Stateful):
    """Base of the ports with devices behind them."""

    FIXED = ("exceptions", "on_frame", "on_write", "requests")
    __slots__ = (*FIXED,)

    def __init__(self, on_frame: FrameCallback | None) -> None:
        self.on_frame = on_frame
        self.on_write: WriteCallback | None = None
        self.requests = 0
        """Number of whole requests received so far, also of foreign units. Counters are no state: a restore leaves them."""
        self.exceptions = 0
        """Number of answers with an exception."""

    @property
    def lost(self) -> int:
        """Number of requests lost because the controller was busy."""
        return 0

    @property
    def unframed(self) -> int:
        """Number of bytes received so far that belonged to no frame; 0 where such bytes end the connection."""
        return 0

    def is_lone_read(self, data: bytes) -> bool:
        """Whether ``data`` is one whole read request and no bytes are held: its execution leaves the port unchanged."""
        return False

    def close(self) -> None:
        """The port has nothing to release."""


def check_units(devices: Mapping[int, SlaveDevice]) -> None:
    """`Misuse` unless there are devices and their units are 1 to 247."""
    if not devices:
        raise Misuse("a slave port needs at least one unit")
    for unit in devices:
        if not 1 <= unit <= rtu.MAX_UNIT:
            raise Misuse(f"unit {unit} is outside 1 to {rtu.MAX_UNIT}")


def execute_frame(
    devices: Mapping[int, SlaveDevice], frame: rtu.RtuFrame, now: Nanos, on_write: WriteCallback | None = None
) -> bytes:
    """Execute an RTU frame on the devices to which it is addressed; returns the response frame, empty if there is none.

    Foreign units and function codes that no request can have are ignored (MIC-1). A broadcast write is executed by every
    device and never answered, a broadcast read ignored (MIC-2).
    """
    raw = frame.raw
    unit, function = raw[0], raw[1]
    if not 0 < function < REFUSED:
        return b""
    if unit == rtu.BROADCAST:
        broadcast(devices.values(), raw[1:-2], now)
        if on_write is not None and function in WRITES:
            on_write(now, unit, raw[1:-2], b"")
    device = devices.get(unit)
    if device is None:  # a foreign unit, or a broadcast
        return b""
    response = device.execute(raw[1:-2], now)
    if on_write is not None and function not in READS:
        on_write(now, unit, raw[1:-2], response)
    return with_crc(raw[:1] + response)


def broadcast(devices: Iterable[SlaveDevice], pdu: bytes, now: Nanos) -> None:
    """Execute a request to unit 0: every device executes a write; a read is ignored (MIC-2)."""
    if pdu[0] in WRITES:
        for device in devices:
            device.execute(pdu, now)


def tcp_response(request: bytes, pdu: bytes) -> bytes:
    """The Modbus TCP frame that answers the frame ``request`` with ``pdu``."""
    return request[:4] + (len(pdu) + 1).to_bytes(2, "big") + request[6:7] + pdu


class PauseReports(Stateful):
    """Reports requests that the device would have dropped because of a pause (MIC-15)."""

    FIXED = ("_callback",)
    __slots__ = (*FIXED, "_next")

    def __init__(self, observer: PauseCallback | None) -> None:
        self._callback = observer
        self._next: Nanos = 0

    def served(self, frame: rtu.RtuFrame, now: Nanos) -> None:
        if frame.pause > rtu.UART_GAP_NS and now >= self._next and self._callback is not None:
            self._next = now + PAUSE_REPORT_NS
            self._callback(frame.unit, frame.pause)


class RtuSlavePort(SlavePort):
    """One RTU line without line timing (with it: `steptwin.wire.timed`).

    ``devices`` is read once. ``gap_ns`` is the silence that ends a burst (MIC-15). ``line`` gives the time of the
    characters of a delivery; without it a delivery takes no time.
    """

    broken = None
    """A serial line stays open whatever is received; only connections are closed."""

    FIXED = ("_devices", "_held", "_line")
    __slots__ = (*FIXED, "_framer", "_pauses")

    def __init__(
        self,
        devices: Mapping[int, SlaveDevice],
        *,
        gap_ns: Nanos = rtu.BURSTY_GAP_NS,
        line: SerialLine | None = None,
        on_frame: FrameCallback | None = None,
        on_pause: PauseCallback | None = None,
    ) -> None:
        super().__init__(on_frame)
        check_units(devices)
        self._devices = dict(devices)
        self._framer = rtu.RtuFramer(self._devices, gap_ns)
        self._held = self._framer.held
        self._line = line
        self._pauses = PauseReports(on_pause)

    @property
    def unframed(self) -> int:
        """Number of bytes received so far that belonged to no frame."""
        return self._framer.unframed

    def is_lone_read(self, data: bytes) -> bool:
        is_whole = len(data) == 8 and not self._held and self._line is None
        return is_whole and data[0] in self._devices and data[1] in READS and crc16(data) == 0

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        # Fast path without the framer: nearly always one whole request arrives alone.
        size = len(data)
        if size >= 8 and not self._held:
            device = self._devices.get(data[0])
            if device is not None:
                function = data[1]
                wanted = 8 if function <= 6 else 9 + data[6] if function == WRITE_MULTIPLE_REGISTERS else 0
                if size == wanted and function > 0 and size <= rtu.MAX_FRAME and crc16(data) == 0:
                    response = data[:1] + device.execute(data[1:-2], now)
                    self.requests += 1
                    if response[1] >= REFUSED:
                        self.exceptions += 1
                    if self.on_write is not None and function not in READS:
                        self.on_write(now, data[0], data[1:-2], response[1:])
                    response += crc16(response).to_bytes(2, "little")
                    if self.on_frame is not None:
                        self.on_frame(now, FrameDirection.IN, data)
                        self.on_frame(now, FrameDirection.OUT, response)
                    return response
        begin = now if self._line is None else now - self._line.duration(size)
        return self._execute(self._framer.feed(data, begin, now), now)

    def _execute(self, frames: list[rtu.RtuFrame], now: Nanos) -> bytes:
        responses = []
        for frame in frames:
            response = execute_frame(self._devices, frame, now, self.on_write)
            self.requests += 1
            if response and response[1] >= REFUSED:
                self.exceptions += 1
            if self.on_frame is not None:
                self.on_frame(now, FrameDirection.IN, frame.raw)
                if response:
                    self.on_frame(now, FrameDirection.OUT, response)
            if frame.pause and (frame.unit == rtu.BROADCAST or frame.unit in self._devices):
                self._pauses.served(frame, now)
            responses.append(response)
        return b"".join(responses)

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        response = self._execute(self._framer.expire(now), now) if self._held else b""
        return [(now, response)] if response else []

    def deadline(self) -> Nanos | None:
        return self._framer.deadline()


class TcpSlavePort(SlavePort):
    """One Modbus TCP connection. ``devices`` is read once.

    MIC-23: a single device is addressed by 0 and 255 too. With several, 0 is a broadcast, which is not answered (MIC-2). Any
    other unit is answered with exception 0B at once, as gateways do. When `broken` has a reason, the shell sends the responses
    and closes the connection.
    """

    FIXED = ("_devices",)
    __slots__ = (*FIXED, "_framer", "broken")

    def __init__(self, devices: Mapping[int, SlaveDevice], *, on_frame: FrameCallback | None = None) -> None:
        super().__init__(on_frame)
        check_units(devices)
        self._devices = dict(devices)
        if len(devices) == 1:
            (device,) = devices.values()
            self._devices[0] = self._devices[255] = device
        self._framer = mbap.TcpFramer()
        self.broken: str | None = None
        """The reason for which the connection has to be closed, or None."""

    def is_lone_read(self, data: bytes) -> bool:
        framer = self._framer
        is_whole = len(data) == 12 and data[2:5] == _PLAIN and data[5] == 6 and not framer.held and not framer.broken
        return is_whole and data[7] in READS

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        # Fast path without the framer: nearly always one whole request arrives alone.
        framer = self._framer
        if data[2:6] == _HEADERS.get(len(data)) and not framer.held and not framer.broken:
            device = self._devices.get(data[6])
            if device is not None and self.on_frame is None and (self.on_write is None or data[7] in READS):
                pdu = device.execute(data[7:], now)
                self.requests += 1
                if pdu[0] >= REFUSED:
                    self.exceptions += 1
                return data[:5] + _LENGTHS[len(pdu)] + data[6:7] + pdu
        frames = framer.feed(data)
        self.broken = framer.broken
        return b"".join([self._answer(frame.raw, now) for frame in frames])

    def _answer(self, raw: bytes, now: Nanos) -> bytes:
        unit, pdu = raw[6], raw[7:]
        device = self._devices.get(unit)
        if device is not None:
            answer = device.execute(pdu, now)
            response = tcp_response(raw, answer)
            if self.on_write is not None and pdu[0] not in READS:
                self.on_write(now, unit, pdu, answer)
        elif unit == rtu.BROADCAST:
            broadcast(self._devices.values(), pdu, now)
            response = b""
            if self.on_write is not None and pdu[0] in WRITES:
                self.on_write(now, unit, pdu, b"")
        else:
            response = tcp_response(raw, exception_pdu(pdu[0], GATEWAY_TARGET_FAILED))
        self.requests += 1
        if response and response[7] >= REFUSED:
            self.exceptions += 1
        if self.on_frame is not None:
            self.on_frame(now, FrameDirection.IN, raw)
            if response:
                self.on_frame(now, FrameDirection.OUT, response)
        return response

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        return []

    def deadline(self) -> Nanos | None:
        return None
