"""What the driver sends to controllers, frame by frame and in its time: golden/*.txt.

Rules and errors have their own tests; here whole sessions are compared, and what each byte that goes wrong leads to.
Regenerate with ``PYTHONPATH=tests/support python tests/drivers/mic488/test_transcripts.py`` and read the diff.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest
from heard_line import HeardWire
from host_rig import Fault, Wire, thread_line
from line_rig import at_every_address
from transcripts import Bench, Case, cases, names_of, regenerate

from steptwin import drivers
from steptwin.controller import SECOND
from steptwin.drivers import kind as kinds
from steptwin.drivers.mic488 import session
from steptwin.drivers.mic488.decoder import ModbusDecoder
from steptwin.drivers.mic488.kind import MIC488_DRIVER
from steptwin.mic488.registers import register_map
from steptwin.wire import pdu

GOLDENS = [Path(__file__).parent / "golden" / name for name in ("transcripts.txt", "random_sessions.txt", "kind.txt")]


class HeardControllers(HeardWire, Wire):
    def __init__(self, tcp: bool, firmware: str, units: tuple[int, ...]) -> None:
        super().__init__(tcp=tcp, firmware=firmware, units=units)
        self.listen(lambda sink: ModbusDecoder(sink, firmware, tcp=tcp), lambda line: f"{line.raw.hex()} {line.meaning}")


def bench(patch: pytest.MonkeyPatch, options: str) -> Bench:
    """Options are the words ``tcp``, ``observe``, ``logged``, ``bare`` (a driver without configuration) and ``heard`` (what a
    listener at the line says is shown, too), a firmware, and units (``unit=2``). At every address there is the line; ``terminal``
    begins a conversation there.
    """
    words = options.split()
    firmware_of_twin = next((word for word in words if word[0].isdigit()), "1.70")
    units = tuple(int(word[5:]) for word in words if word.startswith("unit=")) or (1,)
    wire = HeardControllers("tcp" in words, firmware_of_twin, units)
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
