"""Characters that the driver types into chips, with their moments: golden/transcripts.txt.

Rules and errors have their own tests; here whole sessions are compared, and what each character that goes wrong leads to.
Regenerate with ``make golden ARGS=tests/drivers/m1486/test_transcripts.py`` and read the diff.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from chip_rig import ChipWire, Fault, chip_line
from transcripts import Bench, Case, cases, names_of, regenerate

from steptwin.drivers import m1486
from steptwin.drivers.m1486 import sync

GOLDEN = Path(__file__).parent / "golden/transcripts.txt"


def bench(options: str) -> Bench:
    """Options are the type of the chips and their addresses (none: one chip that is not addressed). ``chip`` is the first one,
    ``other`` the last.
    """
    kind, *addresses = options.split()
    numbers = tuple(int(address) for address in addresses)
    wire = ChipWire(kind, numbers or (15,))
    line = chip_line(wire)
    chips = [sync.M1486(line, number) for number in numbers or (None,)]
    seen = 0

    def happened() -> list[str]:
        nonlocal seen
        new, seen = wire.happened[seen:], len(wire.happened)
        return [f"{f'{address:X} ' if numbers else ''}{event.text}" for address, event in new if event.code != "upload"]

    own = {"chips": chips, "chip": chips[0], "other": chips[-1], "download_to": sync.download_to, "told": []}
    return Bench(
        wire=wire,
        names=names_of(m1486, wire) | own,
        fault=lambda kind, direction, index: Fault(direction, index, kind),  # type: ignore[arg-type]
        passed=lambda: {str(way): count for way, count in wire.passed.items()},
        shown=lambda data: data.decode().replace("\r", "←"),
        happened=happened,
    )


@pytest.mark.parametrize("case", cases(GOLDEN), ids=lambda case: case.name)
def test_transcripts_are_the_reviewed_ones(case: Case) -> None:
    assert case.transcript(bench).splitlines() == case.expected.splitlines()


if __name__ == "__main__":
    regenerate(bench, GOLDEN)
