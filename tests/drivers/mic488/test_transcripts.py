"""Frames that the driver sends to controllers, with their moments: golden/transcripts.txt.

Rules and errors have their own tests; here whole sessions are compared, and what each byte that goes wrong leads to.
Regenerate with ``make golden ARGS=tests/drivers/mic488/test_transcripts.py`` and read the diff.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from host_rig import Fault, Wire, thread_line
from transcripts import Bench, Case, cases, names_of, regenerate

from steptwin import drivers
from steptwin.mic488.registers import register_map
from steptwin.wire import pdu

GOLDEN = Path(__file__).parent / "golden/transcripts.txt"


def bench(options: str) -> Bench:
    """Options are the words ``tcp``, ``observe`` and ``bare`` (a driver without configuration), and a firmware."""
    words = options.split()
    firmware_of_twin = next((word for word in words if word[0].isdigit()), "1.70")
    wire = Wire(tcp="tcp" in words, firmware=firmware_of_twin)
    config = None if "bare" in words else wire.config
    firmware = None if "bare" in words else wire.twin.firmware.name
    mic = drivers.Mic488(thread_line(wire), config=config, firmware=firmware, observe="observe" in words)
    events = wire.twin.events

    def happened() -> list[str]:
        new = [f"{event.code}: {event.text}" for event in events]
        events.clear()
        return new

    def shown(data: bytes) -> str:
        return data[6:].hex() if wire.tcp else data[:-2].hex()

    own = {"drivers": drivers, "mic": mic, "axis": mic.axis, "pdu": pdu, "register_map": register_map, "told": []}
    return Bench(
        wire=wire,
        names=names_of(drivers, wire) | own,
        fault=lambda kind, direction, index: Fault(direction, index, kind),  # type: ignore[arg-type]
        passed=lambda: dict(wire._passed),
        shown=shown,
        happened=happened,
    )


@pytest.mark.parametrize("case", cases(GOLDEN), ids=lambda case: case.name)
def test_transcripts_are_the_reviewed_ones(case: Case) -> None:
    assert case.transcript(bench).splitlines() == case.expected.splitlines()


if __name__ == "__main__":
    regenerate(bench, GOLDEN)
