"""The talk of checks with a MIC488: PDUs in, answers out, as RTU frames or behind an MBAP header."""

from __future__ import annotations

import struct
from typing import NamedTuple

from steptwin.drivers.mic488.motion import MOVING
from steptwin.errors import LineFailure
from steptwin.mic488.registermap import RegisterMap
from steptwin.mic488.registers import AXES
from steptwin.verify.check import CheckRequest, CheckSteps, NotRestored, Probes, Undecided
from steptwin.wire import pdu, rtu
from steptwin.wire.crc import crc16

TRIES = 3
"""Tries of a write that puts a value back, and of a read whose answer was lost."""
_MBAP = 7


class ModbusAnswer(NamedTuple):
    """The PDU of an answer; empty for silence."""

    pdu: bytes

    @property
    def refusal(self) -> int | None:
        """The exception code."""
        return self.pdu[1] if len(self.pdu) == 2 and self.pdu[0] & pdu.REFUSED else None

    def __str__(self) -> str:
        if not self.pdu:
            return "silence"
        return f"answer {self.pdu.hex(' ')}" if self.refusal is None else refused(self.refusal)


def refused(code: int) -> str:
    return f"exception {code:02X} ({pdu.EXCEPTION_NAMES.get(code, 'unknown')})"


def read(address: int, count: int, function: int = pdu.READ_HOLDING_REGISTERS) -> bytes:
    return struct.pack(">BHH", function, address, count)


def write(address: int, *words: int) -> bytes:
    """Function 16."""
    head = struct.pack(">BHHB", pdu.WRITE_MULTIPLE_REGISTERS, address, len(words), 2 * len(words))
    return head + struct.pack(f">{len(words)}H", *words)


def write_one(address: int, word: int) -> bytes:
    """Function 06."""
    return struct.pack(">BHH", pdu.WRITE_SINGLE_REGISTER, address, word)


class ModbusTalk:
    """With the controller ``unit``. ``axis`` and ``distance_u``: what may move, and how far.

    ``is_detected``: the firmware was not given, and reads do not tell 1.40 from 1.70.
    """

    def __init__(
        self,
        unit: int,
        registers: RegisterMap,
        *,
        framed: bool,
        wait_s: float,
        is_detected: bool = False,
        axis: int = 1,
        distance_u: float = 0.0,
    ) -> None:
        self.unit = unit
        self.registers = registers
        self.firmware = registers.firmware.name
        self.may_be_older = is_detected and self.firmware == "1.70"
        self.framed = framed
        self.wait_s = wait_s
        self.axis = axis
        self.distance_u = distance_u
        self.probes = Probes()
        self.has_echo = False
        """Whether the adapter sends back what it is sent."""
        self._number = 0

    def at(self, key: str, index: int | None = None) -> int:
        return self.registers.of(key, index).address

    # ------------------------------------------------------------------ exchanges

    def hello(self) -> CheckSteps[None]:
        """The first exchange, which finds adapters with an echo. Raises `LineFailure` if no controller responds."""
        request = read(self.at("DATA_TYPE"), 1)
        received = b""
        if not self.framed:
            frame = rtu.encode_frame(self.unit, request)
            received = yield CheckRequest(frame, self.wait_s, lambda came: _frame(came.removeprefix(frame), self.unit) != b"")
            self.has_echo = received.startswith(frame)
        if not (yield from self.ask(request)).pdu:
            raise LineFailure(f"unit {self.unit} does not respond")

    def ask(self, request: bytes, *, unit: int | None = None, at_once: bool = False) -> CheckSteps[ModbusAnswer]:
        to = self.unit if unit is None else unit
        if not self.framed:
            return (yield from self.raw(rtu.encode_frame(to, request), at_once=at_once))
        self._number = self._number + 1 & 0xFFFF
        head = struct.pack(">HHHB", self._number, 0, len(request) + 1, to)
        whole = yield CheckRequest(head + request, self.wait_s, lambda came: _tcp_answer(came, self._number) is not None, at_once)
        return ModbusAnswer(_tcp_answer(whole, self._number) or b"")

    def raw(self, frame: bytes, *, at_once: bool = False) -> CheckSteps[ModbusAnswer]:
        """Bytes of any kind on a serial line; the answer of this controller to them."""
        skip = len(frame) if self.has_echo else 0
        came = yield CheckRequest(frame, self.wait_s, lambda come: _frame(come[skip:], self.unit) != b"", at_once)
        return ModbusAnswer(_frame(came[skip:], self.unit)[1:-2])

    def words(self, address: int, count: int) -> CheckSteps[tuple[int, ...]]:
        """Registers that can be read. Raises `Undecided`."""
        for _ in range(TRIES):
            if (answer := (yield from self.ask(read(address, count)))).pdu:
                break
        if len(answer.pdu) != 2 + 2 * count or answer.refusal is not None:
            raise Undecided(f"registers {address} to {address + count - 1} cannot be read: {answer}")
        return struct.unpack(f">{count}H", answer.pdu[2:])

    # ------------------------------------------------------------------ comparisons

    def expect_refusal(self, what: str, request: bytes, code: int) -> CheckSteps[None]:
        answer = yield from self.ask(request)
        self.probes.holds(what, refused(code), str(answer), answer.refusal == code)

    def expect_answer(self, what: str, request: bytes, *, unit: int | None = None) -> CheckSteps[None]:
        answer = yield from self.ask(request, unit=unit)
        self.probes.holds(what, "an answer", str(answer), bool(answer.pdu) and answer.refusal is None)

    def expect_silence(self, what: str, frame: bytes) -> CheckSteps[None]:
        answer = yield from self.raw(frame)
        self.probes.holds(what, "silence", str(answer), not answer.pdu)

    # ------------------------------------------------------------------ changes that are put back

    def at_rest(self) -> CheckSteps[None]:
        """Raises `Undecided` unless no axis moves and no program runs."""
        status = yield from self.words(self.at("STATUS", 1), AXES)
        moving = [f"M{n} (status {code})" for n, code in enumerate(status, 1) if code in MOVING]
        if moving:
            raise Undecided(f"needs axes at rest: {', '.join(moving)}")
        (program,) = yield from self.words(self.at("PROGRAM_CTRL"), 1)
        if program:
            raise Undecided("a program runs or is paused")

    def remember(self, name: str, address: int, count: int) -> CheckSteps[tuple[int, ...]]:
        """The present value of what is about to be changed."""
        words = yield from self.words(address, count)
        self.probes.unrestored[name] = f"{name} (address {address}) = {' '.join(f'{word:04X}' for word in words)} hex"
        return words

    def keep(self, name: str, address: int, words: tuple[int, ...]) -> CheckSteps[None]:
        """Write what was remembered only if it has changed. Raises `NotRestored`."""
        if (yield from self.ask(read(address, len(words)))).pdu[2:] == struct.pack(f">{len(words)}H", *words):
            del self.probes.unrestored[name]
        else:
            yield from self.put_back(name, address, words)

    def put_back(self, name: str, address: int, words: tuple[int, ...]) -> CheckSteps[None]:
        """Write what was remembered, and read it. Raises `NotRestored`."""
        for _ in range(TRIES):
            request = write(address, *words) if len(words) > 1 else write_one(address, *words)
            yield from self.ask(request)
            answer = yield from self.ask(read(address, len(words)))
            if answer.pdu[2:] == struct.pack(f">{len(words)}H", *words):
                del self.probes.unrestored[name]
                return
        raise NotRestored(f"not put back: {self.probes.unrestored[name]}; write it again")


def _frame(received: bytes, unit: int) -> bytes:
    """The RTU frame of ``unit`` with which the received bytes end; empty without one."""
    for start, byte in enumerate(received[:-3]):
        if byte == unit and crc16(received[start:]) == 0:
            return received[start:]
    return b""


def _tcp_answer(received: bytes, number: int) -> bytes | None:
    """The PDU of the answer with this number."""
    while len(received) > _MBAP:
        found, _, length = struct.unpack_from(">HHH", received)
        size = _MBAP - 1 + length
        if len(received) < size:
            return None
        if found == number:
            return received[_MBAP:size]
        received = received[size:]
    return None
