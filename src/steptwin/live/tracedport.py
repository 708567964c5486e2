"""The way of a request of a program outside as spans: the line, and the device that executes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from steptwin.controller import Nanos, SendingPort, SourcedPort
from steptwin.tracing import span
from steptwin.wire.pdu import REFUSED
from steptwin.wire.slave import SlaveDevice


class TracedPort:
    """A port of a line; what a program sends is a span. Later answers are not part of it."""

    def __init__(self, port: SendingPort, line: str) -> None:
        self._port = port
        self._line = line
        self._source = ""

    def used_by(self, source: str) -> None:
        self._source = source
        if isinstance(self._port, SourcedPort):
            self._port.used_by(source)

    @property
    def broken(self) -> str | None:
        return self._port.broken

    @property
    def on_output(self) -> Callable[[], None] | None:
        return self._port.on_output

    @on_output.setter
    def on_output(self, call: Callable[[], None] | None) -> None:
        self._port.on_output = call

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        known = {"line": self._line, "source": self._source, "request": data.hex()}
        with span(f"line {self._line}", known) as traced_span:
            answer = self._port.exchange(data, now)
            traced_span.set_attribute("answer", answer.hex())
            traced_span.set_attribute("time_ns", now)
        return answer

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        return self._port.to_send(now)

    def deadline(self) -> Nanos | None:
        return self._port.deadline()

    def close(self) -> None:
        self._port.close()


class _TracedDevice:
    def __init__(self, device: SlaveDevice, unit: int, name: str) -> None:
        self._execute = device.execute
        self._unit = unit
        self._name = name

    def execute(self, pdu: bytes, now: Nanos) -> bytes:
        known = {"controller": self._name, "unit": self._unit, "function": pdu[0], "time_ns": now}
        with span(f"device {self._name}", known) as traced_span:
            answer = self._execute(pdu, now)
            traced_span.set_attribute("outcome", "refusal" if answer and answer[0] >= REFUSED else "done")
        return answer


def traced(devices: Mapping[int, SlaveDevice], names: Mapping[int, str]) -> dict[int, SlaveDevice]:
    """The devices of a line, whose requests are spans."""
    return {unit: _TracedDevice(device, unit, names[unit]) for unit, device in devices.items()}
