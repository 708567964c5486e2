"""A gateway in front of a line with timing (MIC-32).

All ports share one line, on which the gateway is the only master. Requests go over it in the order in which they came, and each
takes the time of its characters, of the controller and of the response; the controller may serve another port first. If the queue
is full, a request is refused with exception 06.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import insort
from collections import deque
from typing import NamedTuple
from weakref import WeakSet

from steptwin.controller import Nanos
from steptwin.state import Plain, Stateful
from steptwin.wire import mbap, rtu
from steptwin.wire.crc import with_crc
from steptwin.wire.pdu import DEVICE_BUSY, GATEWAY_TARGET_FAILED, READS, REFUSED, exception_pdu
from steptwin.wire.slave import FrameCallback, FrameDirection, SlavePort, tcp_response
from steptwin.wire.timed import TimedUnits, Turn

QUEUE_REQUESTS = 16
"""Most requests in the queue, for all ports of one kind."""
RTU_BYTES = 3
"""Bytes of unit and CRC in an RTU frame."""


class _Waiting(NamedTuple):
    """A request in the queue."""

    since: Nanos
    number: int
    """Number of the request, counted over all ports of the gateway."""
    units: tuple[int, ...]
    raw: bytes
    pdu: bytes


class ModbusGateway(Stateful):
    """The line behind any number of ports, and the order of their requests."""

    FIXED = ("_waiting_ports", "units")
    __slots__ = (*FIXED, "_count", "_free", "_sent")

    def __init__(self, units: TimedUnits) -> None:
        self.units = units
        self._free: Nanos = 0  # when the last response has left the line
        self._count = 0
        self._sent: tuple[int, Turn] | None = None
        """The number of the request that is on the line, or has come to its controllers and waits there."""
        self._waiting_ports: WeakSet[GatewayPort] = WeakSet()

    def enqueue(self, port: GatewayPort, units: tuple[int, ...], raw: bytes, pdu: bytes, now: Nanos) -> bool:
        """Add a request of ``port`` to the queue; False when the queue is full."""
        if sum(len(other.waiting) for other in self._waiting_ports if type(other) is type(port)) >= QUEUE_REQUESTS:
            return False
        self._count += 1
        port.waiting.append(_Waiting(now, self._count, units, raw, pdu))
        self._waiting_ports.add(port)
        self._send()
        return True

    def requeue(self, port: GatewayPort) -> None:
        """Take over the waiting requests of ``port`` after they were replaced."""
        if port.waiting:
            self._waiting_ports.add(port)
        else:
            self._waiting_ports.discard(port)

    def drop(self, port: GatewayPort) -> None:
        """Forget the waiting requests of ``port``, also one that is on the line."""
        if self._sent is not None and port.waiting and port.waiting[0].number == self._sent[0]:
            self.units.withdraw(self._sent[1])
            self._sent = None
        port.waiting.clear()
        self._waiting_ports.discard(port)
        self._send()

    def deadline(self) -> Nanos | None:
        """The moment at which the request on the line is executed, if its controllers serve no other port first."""
        return None if self._sent is None else self.units.due(self._sent[1])

    def run(self, now: Nanos) -> None:
        """Execute the requests that are due by ``now``."""
        while self._sent is not None and self.units.serves(self._sent[1]) and (due := self.units.due(self._sent[1])) <= now:
            self._serve(self._sent[1], due, now)
            self._send()

    def _send(self) -> None:
        """Begin to send the next request, if the line is free."""
        if self._sent is None and self._waiting_ports:
            request = min(self._waiting_ports, key=_turn).waiting[0]
            begin = max(request.since, self._free)
            arrival = begin + self.units.timing.line.duration(len(request.pdu) + RTU_BYTES)
            self._sent = request.number, self.units.wait(request.units, arrival)

    def _serve(self, turn: Turn, moment: Nanos, now: Nanos) -> None:
        port = min(self._waiting_ports, key=_turn)
        self._sent = None
        request = port.waiting.popleft()
        if not port.waiting:
            self._waiting_ports.discard(port)
        port.on_line(request.raw, moment)
        timing = self.units.timing
        self._free = moment
        for unit in request.units:
            response = self.units.devices[unit].execute(request.pdu, now)
            is_answered = not port.is_broadcast(request.raw)
            if port.on_write is not None and request.pdu[0] not in READS:
                port.on_write(moment, unit, request.pdu, response if is_answered else b"")
            if is_answered:
                self._free = moment + timing.turnaround_ns + timing.line.duration(len(response) + RTU_BYTES)
                port.respond(request.raw, response, self._free)
        self.units.done(turn, moment, self._free)


def _turn(port: GatewayPort) -> tuple[Nanos, int]:
    return port.waiting[0][:2]


class GatewayPort(SlavePort, ABC):
    """Base of the ports of a `Gateway`; responses leave when they have come over the line. Call `to_send` at every `deadline`."""

    FIXED = ("__weakref__", "_gateway")
    __slots__ = (*FIXED, "_responses", "waiting")

    def __init__(self, gateway: ModbusGateway, *, on_frame: FrameCallback | None = None) -> None:
        super().__init__(on_frame)
        self._gateway = gateway
        self._responses: list[tuple[Nanos, bytes]] = []
        self.waiting: deque[_Waiting] = deque()

    @abstractmethod
    def _requests(self, data: bytes, now: Nanos) -> list[bytes]:
        """The requests completed by ``data``."""

    @abstractmethod
    def _addressed(self, raw: bytes) -> tuple[tuple[int, ...], bytes]:
        """The units to which a request is addressed, and its PDU."""

    @abstractmethod
    def is_broadcast(self, raw: bytes) -> bool:
        """Whether a request is not answered."""

    @abstractmethod
    def _response(self, raw: bytes, pdu: bytes) -> bytes:
        """The frame that answers the request ``raw`` with ``pdu``."""

    def _refuse(self, raw: bytes, now: Nanos) -> None:
        """Respond to a request for a unit that is not served, if the protocol has a response."""

    def set_state(self, plain: Plain) -> None:
        super().set_state(plain)
        self._gateway.requeue(self)

    def close(self) -> None:
        """The connection is closed; its waiting requests are dropped."""
        self._gateway.drop(self)

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        self._gateway.run(now)
        for raw in self._requests(data, now):
            self._request(raw, now)
        return b"".join([response for _, response in self.to_send(now)])

    def on_line(self, raw: bytes, moment: Nanos) -> None:
        """The request ``raw`` is executed at ``moment``."""

    def _request(self, raw: bytes, now: Nanos) -> None:
        self.requests += 1
        units, pdu = self._addressed(raw)
        if not units:
            if not self.is_broadcast(raw):
                self._refuse(raw, now)
        elif not self._gateway.enqueue(self, units, raw, pdu, now) and not self.is_broadcast(raw):
            self.respond(raw, exception_pdu(pdu[0], DEVICE_BUSY), now)

    def respond(self, raw: bytes, pdu: bytes, moment: Nanos) -> None:
        """The answer ``pdu`` to the request ``raw`` leaves at ``moment``."""
        if pdu[0] >= REFUSED:
            self.exceptions += 1
        insort(self._responses, (moment, self._response(raw, pdu)), key=lambda response: response[0])

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        self._gateway.run(now)
        out = []
        while self._responses and self._responses[0][0] <= now:
            moment, response = self._responses.pop(0)
            out.append((moment, response))
            if self.on_frame is not None:
                self.on_frame(moment, FrameDirection.OUT, response)
        return out

    def deadline(self) -> Nanos | None:
        moments = [self._responses[0][0]] if self._responses else []
        due = self._gateway.deadline() if self.waiting else None
        if due is not None:
            moments.append(due)
        return min(moments, default=None)


class TcpGatewayPort(GatewayPort):
    """One Modbus TCP connection, as `steptwin.wire.slave.TcpSlavePort` otherwise (MIC-2, MIC-23)."""

    __slots__ = ("_framer",)

    def __init__(self, gateway: ModbusGateway, *, on_frame: FrameCallback | None = None) -> None:
        super().__init__(gateway, on_frame=on_frame)
        self._framer = mbap.TcpFramer()

    @property
    def broken(self) -> str | None:
        """The reason for which the connection has to be closed, or None."""
        return self._framer.broken

    def _requests(self, data: bytes, now: Nanos) -> list[bytes]:
        requests = [frame.raw for frame in self._framer.feed(data)]
        if self.on_frame is not None:
            for raw in requests:
                self.on_frame(now, FrameDirection.IN, raw)
        return requests

    def _addressed(self, raw: bytes) -> tuple[tuple[int, ...], bytes]:
        units, unit, pdu = self._gateway.units, raw[6], raw[mbap.HEADER_BYTES :]
        if len(units.devices) == 1 and unit in (0, 255):
            return tuple(units.devices), pdu
        if unit == rtu.BROADCAST:
            return tuple(units.addressed(unit, pdu[0])), pdu
        return (unit,) if unit in units.devices else (), pdu

    def is_broadcast(self, raw: bytes) -> bool:
        return raw[6] == rtu.BROADCAST and len(self._gateway.units.devices) > 1

    def _response(self, raw: bytes, pdu: bytes) -> bytes:
        return tcp_response(raw, pdu)

    def _refuse(self, raw: bytes, now: Nanos) -> None:
        self.respond(raw, exception_pdu(raw[7], GATEWAY_TARGET_FAILED), now)


class ScriptPort(GatewayPort):
    """RTU frames of the scripts of a world: their requests wait for those of Modbus TCP clients and are not lost.

    The callback is called for a request when it is executed, and not for a unit that is not served.
    """

    broken = None
    __slots__ = ("_framer",)

    def __init__(self, gateway: ModbusGateway, *, on_frame: FrameCallback | None = None) -> None:
        super().__init__(gateway, on_frame=on_frame)
        self._framer = rtu.RtuFramer(gateway.units.devices)

    def _requests(self, data: bytes, now: Nanos) -> list[bytes]:
        return [frame.raw for frame in self._framer.feed(data, now)]

    def _addressed(self, raw: bytes) -> tuple[tuple[int, ...], bytes]:
        return tuple(self._gateway.units.addressed(raw[0], raw[1])), raw[1:-2]

    def is_broadcast(self, raw: bytes) -> bool:
        return raw[0] == rtu.BROADCAST

    def _response(self, raw: bytes, pdu: bytes) -> bytes:
        return with_crc(raw[:1] + pdu)

    def on_line(self, raw: bytes, moment: Nanos) -> None:
        if self.on_frame is not None:
            self.on_frame(moment, FrameDirection.IN, raw)

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        for frame in self._framer.expire(now):
            self._request(frame.raw, now)
        return super().to_send(now)

    def deadline(self) -> Nanos | None:
        return min((due for due in (super().deadline(), self._framer.deadline()) if due is not None), default=None)
