"""A serial port over the network, the server's side (RFC 2217 over telnet, RFC 854). No I/O.

`over_network` puts it around the port of a twin: whoever connects sees a serial port whose settings he may change. The twin
hears every baud rate alike; what was set is remembered and told.
"""

from __future__ import annotations

from collections.abc import Callable

from steptwin.machine import Nanos
from steptwin.runtime.links import Port, TalkingPort

IAC, DONT, DO, WONT, WILL, SB, SE = 255, 254, 253, 252, 251, 250, 240
BINARY, SUPPRESS_GO_AHEAD, COM_PORT = 0, 3, 44
OPTIONS = frozenset({BINARY, SUPPRESS_GO_AHEAD, COM_PORT})

SIGNATURE, BAUD_RATE, DATA_SIZE, PARITY, STOP_SIZE, CONTROL = range(6)
LINE_STATE_MASK, MODEM_STATE_MASK, PURGE = 10, 11, 12
NOTIFY_MODEM_STATE = 7
ANSWER = 100
"""Added to a command in what the server says."""

CTS_DSR_CD = 0xB0
MOST_HELD = 256
"""Bytes of one subnegotiation; the longest that means anything has six, a signature is what people write."""
WHO = b"steptwin"

# SET-CONTROL: a value belongs to the group whose number asks for it (flow control, BREAK, DTR, RTS, inbound flow control).
_CONTROL_GROUPS = {
    **dict.fromkeys((1, 2, 3, 17, 19), 0),
    5: 4,
    6: 4,
    8: 7,
    9: 7,
    11: 10,
    12: 10,
    **dict.fromkeys((14, 15, 16, 18), 13),
}


class Telnet:
    """Takes a client's stream apart: data for the device, and what is to be answered about the port."""

    def __init__(self) -> None:
        self.broken: str | None = None
        self.baud = 38400
        self._sizes = {DATA_SIZE: 8, PARITY: 1, STOP_SIZE: 1}
        self._control = {0: 1, 4: 6, 7: 8, 10: 11, 13: 14}
        self._ours: set[int] = set()
        self._theirs: set[int] = set()
        self._command = b""  # the beginning of a command, from its IAC on

    def receive(self, data: bytes) -> tuple[bytes, bytes]:
        """The data in it, and the answer to the rest."""
        if not self._command and IAC not in data:
            return data, b""
        plain = bytearray()
        answers = bytearray()
        for byte in data:
            if self._command:
                self._go_on(byte, plain, answers)
            elif byte == IAC:
                self._command = bytes((IAC,))
            else:
                plain.append(byte)
        return bytes(plain), bytes(answers)

    def _go_on(self, byte: int, plain: bytearray, answers: bytearray) -> None:
        command = self._command = self._command + bytes((byte,))
        kind = command[1]
        if len(command) == 2:
            if byte == IAC:
                plain.append(IAC)
            if byte not in (SB, DO, DONT, WILL, WONT):
                self._command = b""
        elif kind == SB:
            if byte == SE and _ends_command(command):
                answers += self._answered(command[2:-2].replace(b"\xff\xff", b"\xff"))
                self._command = b""
            elif len(command) > MOST_HELD:
                self.broken = "a telnet command does not end"
                self._command = b""
        else:
            answers += self._negotiated(kind, byte)
            self._command = b""

    def _negotiated(self, kind: int, option: int) -> bytes:
        """Agree to what is known, refuse the rest, and say nothing about what is so already."""
        side, agree, refuse = (self._ours, WILL, WONT) if kind in (DO, DONT) else (self._theirs, DO, DONT)
        if kind in (DO, WILL):
            if option not in OPTIONS:
                return bytes((IAC, refuse, option))
            if option in side:
                return b""
            side.add(option)
            told = bytes((IAC, agree, option))
            if option == COM_PORT and not self._com_port_elsewhere(side):
                told += self._say(NOTIFY_MODEM_STATE, bytes((CTS_DSR_CD,)))
            return told
        if option not in side:
            return b""
        side.discard(option)
        return bytes((IAC, refuse, option))

    def _com_port_elsewhere(self, side: set[int]) -> bool:
        return COM_PORT in (self._theirs if side is self._ours else self._ours)

    def _answered(self, content: bytes) -> bytes:
        """The answer to a subnegotiation: each setting is taken and told as taken; 0 asks for the present one."""
        if len(content) < 2 or content[0] != COM_PORT:
            return b""
        command, value = content[1], content[2:]
        if command == SIGNATURE:
            return self._say(SIGNATURE, WHO) if not value else b""
        if command == BAUD_RATE and len(value) == 4:
            self.baud = int.from_bytes(value, "big") or self.baud
            return self._say(command, self.baud.to_bytes(4, "big"))
        if len(value) != 1:
            return b""
        if command in self._sizes:
            self._sizes[command] = value[0] or self._sizes[command]
            return self._say(command, bytes((self._sizes[command],)))
        if command == CONTROL:
            return self._say(command, bytes((self._controlled(value[0]),)))
        return self._say(command, value) if command in (LINE_STATE_MASK, MODEM_STATE_MASK, PURGE) else b""

    def _controlled(self, value: int) -> int:
        group = _CONTROL_GROUPS.get(value)
        if group is not None:
            self._control[group] = value
            return value
        return self._control.get(value, value)

    def _say(self, command: int, value: bytes) -> bytes:
        return bytes((IAC, SB, COM_PORT, command + ANSWER)) + escaped(value) + bytes((IAC, SE))


def _ends_command(command: bytes) -> bool:
    """Whether the SE at its end follows an IAC that is not itself a doubled byte."""
    body = command[2:-1]
    return (len(body) - len(body.rstrip(b"\xff"))) % 2 == 1


def escaped(data: bytes) -> bytes:
    """Data as it travels: a byte 255 is doubled."""
    return data.replace(b"\xff", b"\xff\xff")


class Rfc2217Port:
    """The port of a twin behind a network serial port."""

    def __init__(self, port: Port) -> None:
        self._port = port
        self._telnet = Telnet()

    @property
    def broken(self) -> str | None:
        return self._telnet.broken or self._port.broken

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        plain, answers = self._telnet.receive(data)
        return answers + escaped(self._port.exchange(plain, now)) if plain else answers

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        return [(at, escaped(data)) for at, data in self._port.to_send(now)]

    def deadline(self) -> Nanos | None:
        return self._port.deadline()


class TalkingRfc2217Port(Rfc2217Port):
    """The same of a port that speaks unasked."""

    def __init__(self, port: TalkingPort) -> None:
        super().__init__(port)
        self._talking = port

    @property
    def on_output(self) -> Callable[[], None] | None:
        return self._talking.on_output

    @on_output.setter
    def on_output(self, told: Callable[[], None] | None) -> None:
        self._talking.on_output = told

    def close(self) -> None:
        self._talking.close()


def over_network(port: Port) -> Port:
    """``port`` as a network serial port."""
    return TalkingRfc2217Port(port) if isinstance(port, TalkingPort) else Rfc2217Port(port)
