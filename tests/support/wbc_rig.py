"""A MIC488 with a program, in virtual time: loaded and started as a master does it, watched from outside."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

from mic488_rig import Rig, controller

from steptwin.machine import SECOND
from steptwin.mic488.config import AxisConfig, ControllerConfig, read_config
from steptwin.mic488.inifile import IniFile
from steptwin.mic488.program import LoadedProgram, load
from steptwin.wbc.check import check
from steptwin.wbc.dialect import dialect_for
from steptwin.wbc.positions import PositionTable, parse_positions

EXAMPLES = Path(__file__).parents[2] / "examples" / "mic488"
STOPPED, RUNNING, PAUSED = 0, 1, 2
MM = AxisConfig(unit=3, gear=100.0, acc=200.0, dec=200.0, vel=50.0)
"""A spindle."""


def loaded(text: str, rows: str = "", firmware: str = "1.70") -> tuple[LoadedProgram, PositionTable]:
    """A program with its position table as banks take them."""
    table, wrong = parse_positions(rows)
    assert wrong == []
    return load(check(text, table, dialect=dialect_for(firmware))), table


class ProgramRig(Rig):
    """Bank 0 holds the program of ``text`` and the position table of ``rows``, checked without errors."""

    def __init__(
        self, text: str, rows: str = "", config: ControllerConfig | None = None, firmware: str = "1.70", **options: Any
    ) -> None:
        program, table = loaded(text, rows, firmware)
        super().__init__(config, firmware, programs={0: program}, positions={0: table}, **options)

    def load(self, text: str, rows: str = "", bank: int = 0) -> None:
        program, table = loaded(text, rows, self.device.firmware.name)
        self.device.load_program(bank, program)
        self.device.load_positions(bank, table)

    # -------------------------------------------------------------- PROGRAM_CTRL

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
            due = self.kernel.deadline()
            assert due is not None, f"nothing will happen, and {pin} is {self.pins()[pin]:g}"
            assert due <= end, f"{pin} is {self.pins()[pin]:g} after {within} s"
            self.wait_ns(due - self.now)
        return self.now / SECOND

    def changes(self, pin: str) -> list[tuple[float, float]]:
        """(seconds, level) of every change of an output pin so far."""
        return [(edge.time / SECOND, edge.value) for edge in self.edges if edge.pin == pin]


def started(text: str, rows: str = "", axes: int = 2, **options: Any) -> ProgramRig:
    """A running program; the first ``axes`` are spindles."""
    rig = ProgramRig(text, rows, controller(*[MM] * axes), **options)
    rig.start()
    return rig


def example(name: str) -> ProgramRig:
    """One of the example machines, from its files."""
    rows = EXAMPLES / f"{name}.csv"
    config = read_config(IniFile.parse((EXAMPLES / f"{name}.cfg").read_bytes(), name))
    text = (EXAMPLES / f"{name}.prg").read_text()
    return ProgramRig(text, rows.read_text() if rows.exists() else "", config)
