"""What the driver types into chips, character by character and in its time: golden/*.txt.

Rules and errors have their own tests; here whole sessions are compared, and what each character that goes wrong leads to.
Regenerate with ``PYTHONPATH=tests/support python tests/drivers/m1486/test_transcripts.py`` and read the diff.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import pytest
from chip_rig import BAUD, ChipWire, Fault, chip_line
from heard_line import HeardWire
from line_rig import MemoryEndpoint, at_every_address
from transcripts import Bench, Case, cases, names_of, regenerate
from virtual_terminal import Turns

from steptwin.drivers import kind as kinds
from steptwin.drivers import m1486
from steptwin.drivers.m1486 import identify, sync
from steptwin.drivers.m1486.decoder import M1486Decoder
from steptwin.drivers.m1486.kind import M1486_DRIVER
from steptwin.drivers.threads import ThreadLine
from steptwin.wire.frameline import FrameLine

GOLDENS = [Path(__file__).parent / "golden" / name for name in ("transcripts.txt", "random_sessions.txt", "kind.txt")]


class HeardChips(HeardWire, ChipWire):
    def __init__(self, kind: str, addresses: tuple[int, ...]) -> None:
        super().__init__(kind, addresses)
        self.listen(lambda sink: M1486Decoder(sink, kind), _shown)


def _shown(line: FrameLine) -> str:
    return " ".join(filter(None, (line.raw.decode("latin-1").replace("\r", "←"), line.link, line.meaning)))


def bench(patch: pytest.MonkeyPatch, options: str) -> Bench:
    """Options are the type of the chips and their addresses (none: one chip that is not addressed), ``logged``, and ``heard``
    (what a listener at the line says is shown, too). ``chip`` is the first one, ``other`` the last. At every address there is the
    line; ``terminal`` begins a conversation there, whose thread works while it is waited for, or ``turns.sleep(1.0)``.
    """
    words = options.split()
    is_heard = "heard" in words
    kind, *addresses = (word for word in words if word not in ("logged", "heard"))
    log: list[str] = []
    shown: list[str] = []
    numbers = tuple(int(address) for address in addresses)
    wire = (HeardChips if is_heard else ChipWire)(kind, numbers or (15,))
    line = chip_line(wire, log.append if "logged" in words else None)
    chips = [sync.M1486(line, number) for number in numbers or (None,)]
    seen = 0

    def happened() -> list[str]:
        nonlocal seen
        new, seen = wire.happened[seen:], len(wire.happened)
        told = [f"{f'{address:X} ' if numbers else ''}{event.text}" for address, event in new if event.code != "upload"]
        told += (f"shown: {text}" for text in shown)
        shown.clear()
        return told + (wire.heard() if isinstance(wire, HeardChips) else [])

    at_every_address(patch, wire)
    turns = Turns(wire)
    turns.install(patch)
    endpoint: Any = MemoryEndpoint(wire)
    searching = identify.searching(endpoint, BAUD)
    search: ThreadLine[identify.SearchRequest, bytes] = ThreadLine(endpoint, searching, clock=wire.clock, sleeping=wire.sleep)
    address = kinds.DeviceAddress("memory", "m1486", numbers[0] if numbers else None, BAUD, 1.0)

    def talking(variant: str | None = None, number: int | None = address.number) -> Any:
        where = kinds.DeviceAddress("memory", "m1486", number, BAUD, 1.0, variant)
        return M1486_DRIVER.terminal(where, shown.append, log.append if "logged" in words else None)

    own = {"chips": chips, "chip": chips[0], "other": chips[-1], "download_to": sync.download_to, "told": []}
    of_kind = {"kind": M1486_DRIVER, "address": address, "WantedMoves": kinds.WantedMoves, "Path": Path}
    of_search = {name: getattr(identify, name) for name in ("scan_chips", "select_all", "end_line")} | {"search": search}
    names = names_of(m1486, wire, log) | own | of_kind | of_search | {"terminal": talking, "turns": turns}
    return Bench(
        wire=wire,
        names=names,
        fault=lambda kind, direction, index: Fault(direction, index, kind),  # type: ignore[arg-type]
        passed=lambda: {str(way): count for way, count in wire.passed.items()},
        shown=lambda data: data.decode().replace("\r", "←"),
        happened=happened,
    )


@pytest.mark.parametrize("case", cases(*GOLDENS), ids=lambda case: case.name)
def test_transcripts_are_the_reviewed_ones(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    assert case.transcript(partial(bench, monkeypatch)).splitlines() == case.expected.splitlines()


if __name__ == "__main__":
    with pytest.MonkeyPatch.context() as patch:
        regenerate(partial(bench, patch), *GOLDENS)
