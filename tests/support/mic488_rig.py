"""A master in virtual time for tests of the MIC488 and its programs: it makes its PDUs itself and has addresses from the manuals.

Nothing here uses the product's register table or encoding, so that a mistake there cannot hide itself.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from manual_registers import BASES, controls

from steptwin.controller import SECOND, PinEdge
from steptwin.mic488.config import AxisConfig, ControllerConfig, read_config
from steptwin.mic488.core import Mic488Event
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.encoder import Coupling
from steptwin.mic488.inifile import IniFile
from steptwin.mic488.program_banks import LoadedProgram, load
from steptwin.simulation.logic.contacts import PositionSwitch, place
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.wires import PinName
from steptwin.wbc.check import check
from steptwin.wbc.dialect import dialect_for
from steptwin.wbc.positions import PositionTable, parse_positions

OFFSETS = BASES
WORDS = {one.name: one.address - BASES["1.70"] for one in controls("1.70", is_word=True) if not one.name[1].isdigit()}
VALUES = {
    re.sub(r"^M1_|(?<=^ENC)1", "", one.name): one.address - BASES["1.70"]
    for one in controls("1.70", is_word=False)
    if one.name.startswith(("M1_", "ENC1_"))
}
"""Addresses from the base: of registers of the controller, and of axis 1."""
EN, STOP, JOG, USER_REG_READ, USER_REG_SAVE, USER_REG_ZERO, IN, OUT = 2000, 2004, 2008, 2100, 2101, 2102, 5000, 6000

EXAMPLES = Path(__file__).parents[2] / "examples" / "mic488"
STOPPED, RUNNING, PAUSED = 0, 1, 2
MM = AxisConfig(unit=3, gear=100.0, acc=200.0, dec=200.0, vel=50.0)
"""A spindle."""


def real_words(value: float) -> tuple[int, int]:
    high, low = struct.unpack(">HH", struct.pack(">f", value))
    return low, high


def dint_words(value: int) -> tuple[int, int]:
    return value & 0xFFFF, value >> 16 & 0xFFFF


def read_pdu(function: int, address: int, count: int) -> bytes:
    return struct.pack(">BHH", function, address, count)


def coil_pdu(address: int, on: bool) -> bytes:
    return struct.pack(">BHH", 5, address, 0xFF00 if on else 0)


def word_pdu(address: int, value: int) -> bytes:
    return struct.pack(">BHH", 6, address, value & 0xFFFF)


def words_pdu(address: int, *words: int) -> bytes:
    return struct.pack(f">BHHB{len(words)}H", 16, address, len(words), 2 * len(words), *words)


def controller(*axes: AxisConfig, **others: object) -> ControllerConfig:
    """A configuration whose first axes are given; the rest is default."""
    given = axes + (AxisConfig(),) * (4 - len(axes))
    return replace(ControllerConfig(), axes=given, **others)  # type: ignore[arg-type]


def loaded(text: str, rows: str = "", firmware: str = "1.70") -> tuple[LoadedProgram, PositionTable]:
    """A program with its position table as banks take them."""
    table, wrong = parse_positions(rows)
    assert wrong == []
    return load(check(text, table, dialect=dialect_for(firmware))), table


class Refused(AssertionError):
    """A request the test expected to succeed was answered with an exception."""


class Rig:
    """A controller in a scheduler, its present moment, and everything that came out of it."""

    def __init__(self, config: ControllerConfig | None = None, firmware: str = "1.70", **options: Any) -> None:
        self.device = Mic488Device(config or ControllerConfig(), firmware, **options)
        self.base = OFFSETS[firmware]
        self.scheduler = Scheduler()
        self.scheduler.add("m", self.device)
        self.edges: list[PinEdge] = []
        self.scheduler.edge_subscribers.append(lambda name, edge: self.edges.append(edge))
        self.now = 0
        self.dint = False

    # -------------------------------------------------------------- time and the world

    def wait(self, seconds: float) -> None:
        self.wait_ns(round(seconds * SECOND))

    def wait_ns(self, nanoseconds: int) -> None:
        self.now += nanoseconds
        self.scheduler.advance(self.now)
        self.device.advance(self.now)

    def until(self, axis: int, *statuses: int, within: float = 100.0) -> None:
        """Wait from event to event until ``axis`` has one of ``statuses``."""
        end = self.now + round(within * SECOND)
        while self.status(axis) not in statuses:
            due = self.scheduler.deadline()
            assert due is not None, f"nothing will happen; status of M{axis} is {self.status(axis)}"
            assert due <= end, f"M{axis} has status {self.status(axis)} after {within} s"
            self.wait_ns(due - self.now)

    def pin(self, pin: str, value: float) -> None:
        self.scheduler.advance(self.now)
        self.device.set_pin(pin, value, self.now)
        self.scheduler.deadline()

    def pins(self) -> Mapping[str, float]:
        return self.device.pins()

    def switch(self, axis: int, low: int | None, high: int | None, pin: str, *, normally_closed: bool = False) -> None:
        self.scheduler.advance(self.now)
        place(self.scheduler, PositionSwitch("m", axis, low, high, PinName("m", pin), normally_closed))
        self.scheduler.deadline()

    def events(self, code: str) -> list[Mic488Event]:
        return [event for event in self.device.events if event.code == code]

    # -------------------------------------------------------------- requests

    def ask(self, pdu: bytes) -> bytes:
        self.scheduler.advance(self.now)
        response = self.device.execute(pdu, self.now)
        self.scheduler.deadline()
        return response

    def _ask(self, pdu: bytes) -> bytes:
        response = self.ask(pdu)
        if response[0] & 0x80:
            raise Refused(f"{pdu.hex(' ')} was answered with exception {response[1]}")
        return response

    def exception(self, pdu: bytes) -> int:
        """Code of the exception ``pdu`` is answered with, 0 when it is served."""
        response = self.ask(pdu)
        if response[0] & 0x80:
            assert len(response) == 2
            assert response[0] == pdu[0] | 0x80
            return response[1]
        return 0

    def coil(self, address: int, on: bool) -> None:
        pdu = coil_pdu(address, on)
        assert self._ask(pdu) == pdu

    def read_words(self, address: int, count: int) -> list[int]:
        response = self._ask(read_pdu(3, address, count))
        assert response[:2] == bytes((3, 2 * count))
        return list(struct.unpack(f">{count}H", response[2:]))

    def write_words(self, address: int, *words: int) -> None:
        pdu = words_pdu(address, *words)
        assert self._ask(pdu) == pdu[:5]

    def bits(self, function: int, address: int, count: int) -> list[int]:
        response = self._ask(read_pdu(function, address, count))
        assert response[:2] == bytes((function, (count + 7) // 8))
        return [response[2 + i // 8] >> i % 8 & 1 for i in range(count)]

    # -------------------------------------------------------------- registers by name

    def address(self, key: str, axis: int = 1) -> int:
        return self.base + (WORDS[key] if key in WORDS else VALUES[key] + 2 * (axis - 1))

    def word(self, key: str, value: int | None = None) -> int:
        """Read a WORD register; with ``value`` write it first (function 06)."""
        if value is not None:
            pdu = word_pdu(self.address(key), value)
            assert self._ask(pdu) == pdu
            return value
        return self.read_words(self.address(key), 1)[0]

    def encoded(self, key: str, value: float) -> tuple[int, int]:
        return dint_words(int(value)) if self.dint or key == "ENC_IMP" else real_words(value)

    def set(self, key: str, value: float, axis: int = 1) -> None:
        self.write_words(self.address(key, axis), *self.encoded(key, value))

    def set_pdu(self, key: str, value: float, axis: int = 1) -> bytes:
        return words_pdu(self.address(key, axis), *self.encoded(key, value))

    def get(self, key: str, axis: int = 1) -> float:
        low, high = self.read_words(self.address(key, axis), 2)
        raw = struct.pack(">HH", high, low)
        return struct.unpack(">i" if self.dint or key == "ENC_IMP" else ">f", raw)[0]

    def status(self, axis: int = 1) -> int:
        return self.read_words(self.base + 9 + axis, 1)[0]

    def position(self, axis: int = 1) -> float:
        return self.get("POS_ACT", axis)

    def velocity(self, axis: int = 1) -> float:
        return self.get("VEL_ACT", axis)

    def enable(self, *axes: int) -> None:
        self.word("M_ENABLE", sum(1 << axis - 1 for axis in axes or (1,)))

    def stop(self, axis: int = 1) -> None:
        self.coil(STOP + axis - 1, True)

    def jog(self, axis: int, direction: int, on: bool) -> None:
        self.coil(JOG + 2 * (axis - 1) + (direction < 0), on)

    def use_dint(self) -> None:
        self.word("DATA_TYPE", 1)
        self.dint = True

    def load(self, text: str, rows: str = "", bank: int = 0) -> None:
        program, table = loaded(text, rows, self.device.firmware.name)
        self.device.load_program(bank, program)
        self.device.load_positions(bank, table)

    # -------------------------------------------------------------- the program: PROGRAM_CTRL

    def start(self) -> None:
        self.word("PROGRAM_CTRL", RUNNING)

    def pause(self) -> None:
        self.word("PROGRAM_CTRL", PAUSED)

    def halt(self) -> None:
        self.word("PROGRAM_CTRL", STOPPED)

    @property
    def state(self) -> int:
        return self.word("PROGRAM_CTRL")

    @property
    def m_status(self) -> int:
        return self.word("M_STATUS")

    # -------------------------------------------------------------- user registers

    def i(self, number: int, value: int | None = None) -> int:
        if value is not None:
            self.write_words(number, value & 0xFFFF)
        word = self.read_words(number, 1)[0]
        return word - 0x10000 if word & 0x8000 else word

    def d(self, number: int) -> int:
        low, high = self.read_words(number, 2)
        return struct.unpack(">i", struct.pack(">HH", high, low))[0]

    def r(self, number: int, value: float | None = None) -> float:
        if value is not None:
            high, low = struct.unpack(">HH", struct.pack(">f", value))
            self.write_words(number, low, high)
        low, high = self.read_words(number, 2)
        return struct.unpack(">f", struct.pack(">HH", high, low))[0]

    # -------------------------------------------------------------- pins

    def out(self, number: int) -> bool:
        return self.pins()[f"OUT{number}"] == 1.0

    def pin_until(self, pin: str, level: float, within: float = 100.0) -> float:
        """Wait from event to event until ``pin`` has ``level``; the moment in seconds."""
        end = self.now + round(within * SECOND)
        while self.pins()[pin] != level:
            due = self.scheduler.deadline()
            assert due is not None, f"nothing will happen, and {pin} is {self.pins()[pin]:g}"
            assert due <= end, f"{pin} is {self.pins()[pin]:g} after {within} s"
            self.wait_ns(due - self.now)
        return self.now / SECOND

    def changes(self, pin: str) -> list[tuple[float, float]]:
        """(seconds, level) of every change of an output pin so far."""
        return [(edge.time / SECOND, edge.value) for edge in self.edges if edge.pin == pin]


def programmed(text: str, rows: str = "", config: ControllerConfig | None = None, firmware: str = "1.70", **options: Any) -> Rig:
    """Bank 0 holds the program of ``text`` and the position table of ``rows``, checked without errors."""
    program, table = loaded(text, rows, firmware)
    return Rig(config, firmware, programs={0: program}, positions={0: table}, **options)


def started(text: str, rows: str = "", axes: int = 2, **options: Any) -> Rig:
    """A running program; the first ``axes`` are spindles."""
    rig = programmed(text, rows, controller(*[MM] * axes), **options)
    rig.start()
    return rig


def example(name: str) -> Rig:
    """One of the example machines, from its files."""
    rows = EXAMPLES / f"{name}.csv"
    config = read_config(IniFile.parse((EXAMPLES / f"{name}.cfg").read_bytes(), name))
    text = (EXAMPLES / f"{name}.prg").read_text()
    return programmed(text, rows.read_text() if rows.exists() else "", config)


def encoder_rig(mode: int = 1, reaction: int = 1, /, **config: float) -> Rig:
    """A drive that is on, by default with ENCODER and ERRMODE0."""
    rig = Rig(controller(AxisConfig(pos_ctrl_mode=mode, err_ctrl_mode=reaction, **config)))  # type: ignore[arg-type]
    rig.enable(1)
    return rig


def couple(rig: Rig, coupling: Coupling, axis: int = 1) -> None:
    rig.scheduler.advance(rig.now)
    rig.device.couple_encoder(axis, coupling, rig.now)
    rig.scheduler.deadline()


def turn(rig: Rig, counts: int, axis: int = 1) -> None:
    rig.scheduler.advance(rig.now)
    rig.device.turn_encoder(axis, counts, rig.now)
    rig.scheduler.deadline()


def run(text: str, seconds: float = 1.0, **options: object) -> Rig:
    """A program that has been started and has had so much time."""
    rig = programmed(text, **options)  # type: ignore[arg-type]
    rig.start()
    rig.wait(seconds)
    return rig
