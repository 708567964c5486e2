"""A serial port over the network, the server's side (RFC 2217 over telnet, RFC 854). No I/O.

`over_network` wraps the port of a twin: the client sees a serial port with settings. Settings that do not match the line of
the twin (`TwinLine`) are reported; with real line timing no data pass then, in either direction.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from steptwin.controller import Nanos, Port, SendingPort, SourcedPort, sends_by_itself

IAC, DONT, DO, WONT, WILL, SB, SE = 255, 254, 253, 252, 251, 250, 240
BINARY, SUPPRESS_GO_AHEAD, COM_PORT = 0, 3, 44
OPTIONS = frozenset({BINARY, SUPPRESS_GO_AHEAD, COM_PORT})

SIGNATURE, BAUD_RATE, DATA_SIZE, PARITY, STOP_SIZE, CONTROL = range(6)
LINE_STATE_MASK, MODEM_STATE_MASK, PURGE = 10, 11, 12
NOTIFY_MODEM_STATE = 7
ANSWER = 100
"""Added to a command in answers of the server."""

CTS_DSR_CD = 0xB0
MOST_HELD = 256
"""Bytes of one subnegotiation; the longest that means anything has six, a signature is free text."""
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


BAUD_TOLERANCE = 0.03
"""Rates that differ by less than this are read without errors: a receiver samples the last bit of ten in its middle half."""
_PARITIES = {1: "N", 2: "O", 3: "E", 4: "M", 5: "S"}
_STOP_BITS = {1: "1", 2: "2", 3: "1.5"}


def _unnoticed(text: str) -> None:
    """For ports without a receiver of notices."""


@dataclass(frozen=True, slots=True)
class TwinLine:
    """The serial line of a twin, 8N1. ``baud`` gives its present rate in bit/s; ``notice`` takes notices for the user."""

    baud: Callable[[], int] = lambda: 38400
    is_timed: bool = False
    notice: Callable[[str], None] = _unnoticed


class Telnet:
    """Parses a client's stream into data for the device and commands about the port, with their answers.

    ``baud``, ``data_bits``, ``parity`` (1 none, 2 odd, 3 even, 4 mark, 5 space) and ``stop_bits`` (1, 2, 3 for 1.5) are set by
    the client; at first they are those of the line.
    """

    def __init__(self, baud: int = 38400) -> None:
        self.broken: str | None = None
        self.baud = baud
        self._sizes = {DATA_SIZE: 8, PARITY: 1, STOP_SIZE: 1}
        self._control = {0: 1, 4: 6, 7: 8, 10: 11, 13: 14}
        self._ours: set[int] = set()
        self._theirs: set[int] = set()
        self._command = b""  # the beginning of a command, from its IAC on

    @property
    def settings(self) -> str:
        """The client's settings, such as ``9600 bit/s 8E1``."""
        sizes = self._sizes
        parity, stop = sizes[PARITY], sizes[STOP_SIZE]
        return f"{self.baud} bit/s {sizes[DATA_SIZE]}{_PARITIES.get(parity, '?')}{_STOP_BITS.get(stop, '?')}"

    def fits(self, baud: int) -> bool:
        """Whether characters of the client are read as they are by a line with 8N1 at ``baud``. Further stop bits are a pause."""
        sizes = self._sizes
        return abs(self.baud - baud) <= BAUD_TOLERANCE * baud and (sizes[DATA_SIZE], sizes[PARITY]) == (8, 1)

    def receive(self, data: bytes) -> tuple[bytes, bytes]:
        """The data in the received bytes, and the answer to the commands in them."""
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
        """Accept known options, refuse others; no answer if the state is unchanged."""
        side, agree, refuse = (self._ours, WILL, WONT) if kind in (DO, DONT) else (self._theirs, DO, DONT)
        if kind in (DO, WILL):
            if option not in OPTIONS:
                return bytes((IAC, refuse, option))
            if option in side:
                return b""
            side.add(option)
            answer = bytes((IAC, agree, option))
            if option == COM_PORT and not self._com_port_elsewhere(side):
                answer += self._encode(NOTIFY_MODEM_STATE, bytes((CTS_DSR_CD,)))
            return answer
        if option not in side:
            return b""
        side.discard(option)
        return bytes((IAC, refuse, option))

    def _com_port_elsewhere(self, side: set[int]) -> bool:
        return COM_PORT in (self._theirs if side is self._ours else self._ours)

    def _answered(self, content: bytes) -> bytes:
        """The answer to a subnegotiation: each setting is taken and confirmed; 0 asks for the present one."""
        if len(content) < 2 or content[0] != COM_PORT:
            return b""
        command, value = content[1], content[2:]
        if command == SIGNATURE:
            return self._encode(SIGNATURE, WHO) if not value else b""
        if command == BAUD_RATE and len(value) == 4:
            self.baud = int.from_bytes(value, "big") or self.baud
            return self._encode(command, self.baud.to_bytes(4, "big"))
        if len(value) != 1:
            return b""
        if command in self._sizes:
            self._sizes[command] = value[0] or self._sizes[command]
            return self._encode(command, bytes((self._sizes[command],)))
        if command == CONTROL:
            return self._encode(command, bytes((self._controlled(value[0]),)))
        return self._encode(command, value) if command in (LINE_STATE_MASK, MODEM_STATE_MASK, PURGE) else b""

    def _controlled(self, value: int) -> int:
        group = _CONTROL_GROUPS.get(value)
        if group is not None:
            self._control[group] = value
            return value
        return self._control.get(value, value)

    def _encode(self, command: int, value: bytes) -> bytes:
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

    def __init__(self, port: Port, line: TwinLine) -> None:
        self._port = port
        self._line = line
        self._telnet = Telnet(line.baud())
        self._reported = ""
        """The settings of the last event."""

    def used_by(self, source: str) -> None:
        if isinstance(self._port, SourcedPort):
            self._port.used_by(source)

    @property
    def broken(self) -> str | None:
        return self._telnet.broken or self._port.broken

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        plain, answers = self._telnet.receive(data)
        return answers + escaped(self._port.exchange(plain, now)) if plain and self._passes() else answers

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        sent = self._port.to_send(now)
        return [(at, escaped(data)) for at, data in sent] if sent and self._passes() else []

    def _passes(self) -> bool:
        """Whether characters pass with the present settings; a notice if the settings do not match."""
        line, telnet = self._line, self._telnet
        baud = line.baud()
        if telnet.fits(baud):
            self._reported = ""
            return True
        mismatch = f"{telnet.settings} is set by its client, the line has {baud} bit/s 8N1"
        if mismatch != self._reported:
            self._reported = mismatch
            effect = "no character gets through" if line.is_timed else "served all the same, as line timing is off"
            line.notice(f"network port: {mismatch}: {effect}")
        return not line.is_timed

    def deadline(self) -> Nanos | None:
        return self._port.deadline()

    def close(self) -> None:
        self._port.close()


class SendingRfc2217Port(Rfc2217Port):
    """The same for a port with unsolicited output."""

    def __init__(self, port: SendingPort, line: TwinLine) -> None:
        super().__init__(port, line)
        self._sending = port

    @property
    def on_output(self) -> Callable[[], None] | None:
        return self._sending.on_output

    @on_output.setter
    def on_output(self, callback: Callable[[], None] | None) -> None:
        self._sending.on_output = callback


def over_network(port: Port, line: TwinLine) -> Port:
    """``port``, which is on ``line``, as a network serial port."""
    return SendingRfc2217Port(port, line) if sends_by_itself(port) else Rfc2217Port(port, line)
