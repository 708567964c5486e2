"""What the driver sends to controllers, frame by frame and in its time: golden/*.txt.

Rules and errors have their own tests; here whole sessions are compared, and what each byte that goes wrong leads to.
Regenerate with ``PYTHONPATH=tests/support python tests/drivers/mic488/test_transcripts.py`` and read the diff.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest
from host_rig import Fault, Wire, thread_line
from line_rig import at_every_address
from transcripts import Bench, Case, cases, names_of, regenerate

from steptwin import drivers
from steptwin.drivers import kind as kinds
from steptwin.drivers.mic488 import session
from steptwin.drivers.mic488.decoder import ModbusDecoder
from steptwin.drivers.mic488.kind import MIC488_DRIVER
from steptwin.machine import MILLISECOND, SECOND
from steptwin.mic488.registers import register_map
from steptwin.wire import pdu
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection

GOLDENS = [Path(__file__).parent / "golden" / name for name in ("transcripts.txt", "random_sessions.txt", "kind.txt")]


class HeardWire(Wire):
    """A line at which somebody listens (`steptwin sniff`)."""

    def __init__(self, tcp: bool, firmware: str, units: tuple[int, ...]) -> None:
        super().__init__(tcp=tcp, firmware=firmware, units=units)
        self._begun = self.now
        self._decoder = ModbusDecoder(self._take, firmware, tcp=tcp)
        self._heard: list[str] = []

    def _take(self, line: FrameLine) -> None:
        arrow = ">" if line.direction is FrameDirection.IN else "<"
        self._heard.append(f"{(line.time - self._begun) / MILLISECOND:.9g} {arrow} {line.raw.hex()} {line.meaning}")

    def heard(self) -> list[str]:
        """What was heard since the last time."""
        self._expire()
        new = self._heard[:]
        self._heard.clear()
        return new

    def _expire(self) -> None:
        while (due := self._decoder.deadline()) is not None and due <= self.now:
            self._decoder.expire(due)

    def _receive(self, data: bytes) -> bytes:
        self._expire()
        self._decoder.feed(data, self.now, FrameDirection.IN)
        return super()._receive(data)

    def _step(self) -> list[bytes]:
        arrived = super()._step()
        for data in arrived:
            self._expire()
            self._decoder.feed(data, self.now, FrameDirection.OUT)
        return arrived


def bench(patch: pytest.MonkeyPatch, options: str) -> Bench:
    """Options are the words ``tcp``, ``observe``, ``logged``, ``bare`` (a driver without configuration) and ``heard`` (what a
    listener at the line says is shown, too), a firmware, and units (``unit=2``). At every address there is the line; ``terminal``
    begins a conversation there.
    """
    words = options.split()
    firmware_of_twin = next((word for word in words if word[0].isdigit()), "1.70")
    units = tuple(int(word[5:]) for word in words if word.startswith("unit=")) or (1,)
    wire = HeardWire("tcp" in words, firmware_of_twin, units)
    log: list[str] = []
    config = None if "bare" in words else wire.config
    firmware = None if "bare" in words else wire.twin.firmware.name
    line = thread_line(wire, log=log if "logged" in words else None)
    mic = drivers.Mic488(line, units[0], config=config, firmware=firmware, observe="observe" in words)
    events = wire.twin.events

    def happened() -> list[str]:
        new = [f"{event.code}: {event.text}" for event in events]
        events.clear()
        heard = wire.heard()
        return new + (heard if "heard" in words else [])

    def shown(data: bytes) -> str:
        return data[6:].hex() if wire.tcp else data[:-2].hex()

    at_every_address(patch, wire)
    patch.setattr(session, "time", SimpleNamespace(sleep=wire.sleep, monotonic=lambda: wire.now / SECOND))
    address = kinds.DeviceAddress("memory", "mic488", None if units == (1,) else units[0], 38400, 0.3, firmware)
    of_kind = {"kind": MIC488_DRIVER, "address": address, "WantedMoves": kinds.WantedMoves, "told": []}
    names = names_of(drivers, wire, log) | of_kind | {"drivers": drivers, "session": session, "terminal": MIC488_DRIVER.terminal}
    return Bench(
        wire=wire,
        names=names | {"mic": mic, "axis": mic.axis, "pdu": pdu, "register_map": register_map},
        fault=lambda kind, direction, index: Fault(direction, index, kind),  # type: ignore[arg-type]
        passed=lambda: dict(wire._passed),
        shown=shown,
        happened=happened,
    )


@pytest.mark.parametrize("case", cases(*GOLDENS), ids=lambda case: case.name)
def test_transcripts_are_the_reviewed_ones(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    assert case.transcript(partial(bench, monkeypatch)).splitlines() == case.expected.splitlines()


if __name__ == "__main__":
    with pytest.MonkeyPatch.context() as patch:
        regenerate(partial(bench, patch), *GOLDENS)
