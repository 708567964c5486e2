"""The register table and what its rows do are one set."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from mic488_rig import WORDS, Rig, word_pdu

from steptwin.mic488.behaviour import BEHAVIOUR, AxisBehaviour, Bit, DeviceBehaviour, RegisterBehaviour, checked
from steptwin.mic488.registermap import MapRow, Space, Type
from steptwin.mic488.registers import ROWS
from steptwin.tables import IncompleteTable

_OF_KEY = {row.key: row for row in ROWS}


def _row(of: str, **changes: Any) -> MapRow:
    return replace(_OF_KEY[of], name="NEW{n}", **changes)


def _read(*_: object) -> Any: ...


def _write(*_: object) -> None: ...


@pytest.mark.parametrize(
    ("row", "behaviour", "message"),
    [
        (_row("ACC"), None, "register NEW lacks its behaviour"),
        (None, DeviceBehaviour(_read), "behaviour of NEW: there is no such register"),
        (_row("EN"), AxisBehaviour(write=_write), "register NEW needs the behaviour Bit, not AxisBehaviour"),
        (_row("ACC"), DeviceBehaviour(_read, _write), "register NEW needs the behaviour AxisBehaviour, not DeviceBehaviour"),
        (
            _row("DATA_TYPE"),
            AxisBehaviour(_read, write=_write),
            "register NEW needs the behaviour DeviceBehaviour, not AxisBehaviour",
        ),
        (_row("IN"), Bit(), "register NEW (BIT, reads (2,), writes ()) lacks its read"),
        (_row("OUT"), Bit(_read), "register NEW (BIT, reads (1,), writes (5,)) lacks its write"),
        (_row("DATA_TYPE"), DeviceBehaviour(_read), "register NEW (WORD, reads (3,), writes (6,)) lacks its write"),
        (_row("DATA_TYPE"), DeviceBehaviour(write=_write), "register NEW (WORD, reads (3,), writes (6,)) lacks its read"),
        (_row("STATUS"), AxisBehaviour(), "register NEW (WORD, reads (3,), writes ()) lacks its read"),
        (_row("ACC"), AxisBehaviour(_read, write=_write), "register NEW (REAL/DINT, reads (3,), writes (16,)) lacks its read_p"),
        (_row("ACC"), AxisBehaviour(_read, _read), "register NEW (REAL/DINT, reads (3,), writes (16,)) lacks its write"),
        (
            _row("STATUS"),
            AxisBehaviour(_read, write=_write),
            "register NEW (WORD, reads (3,), writes ()) has a write that its row does not permit",
        ),
        (
            _row("HOME"),
            AxisBehaviour(_read, write=_write),
            "register NEW (REAL/DINT, reads (), writes (16,)) has a read that its row does not permit",
        ),
        (
            _row("ENC_IMP"),
            AxisBehaviour(_read, _read, _write),
            "register NEW (DINT, reads (3,), writes (16,)) has a read_p that its row does not permit",
        ),
    ],
)
def test_a_register_without_what_it_does_is_refused(
    row: MapRow | None, behaviour: RegisterBehaviour | None, message: str
) -> None:
    rows = ROWS if row is None else (*ROWS, row)
    with pytest.raises(IncompleteTable) as caught:
        checked(rows, BEHAVIOUR if behaviour is None else {**BEHAVIOUR, "NEW": behaviour})
    assert str(caught.value) == message


def test_memory_needs_no_behaviour() -> None:
    assert checked([row for row in ROWS if row.type is Type.MEMORY], {}) == {}


ONLY_KEPT = {"DATA_TYPE", "PROG_BANK_SEL", "POS_BANK_SEL", "AXIS_CTR_MODE", "JOG_SPEED", "ACC", "DEC", "VMAX"}


@pytest.mark.parametrize("key", [row.key for row in ROWS if row.space is Space.HOLDING and row.writes and row.control])
def test_deadlines_are_found_anew_for_what_may_change_them_and_for_nothing_else(key: str) -> None:
    rig = Rig()
    changes: list[str] = []
    rig.device.changed = lambda: changes.append(key)
    if key in WORDS:
        rig.word(key, 1)
    elif key == "JOG_SPEED":
        rig.ask(word_pdu(rig.base + 17, 1))
    else:
        rig.set(key, 1)
    assert bool(changes) == (key not in ONLY_KEPT)
