"""Everything the registers hold, kept and put back."""

from __future__ import annotations

import pytest
from host_rig import Wire, driver

from steptwin.errors import Misuse
from steptwin.host import Mic488, NotReady, Snapshot


def changed(mic: Mic488) -> None:
    mic.axis(2).set_ramp(acc=7.0)
    mic.axis(1).set_position(55.0)
    mic.set_output(4, True)
    mic.user.words.write_many(100, [1, 2, 3])


def test_putting_back_writes_what_differs_and_nothing_else() -> None:
    wire = Wire()
    mic = driver(wire)
    kept = mic.take_snapshot()
    changed(mic)
    wire.sent.clear()
    planned = [str(change) for change in mic.restore_snapshot(kept, dry_run=True)]
    assert planned == [
        "M2_ACC: 7 → 50",
        "USER_REGISTER[100]: 1 → 0",
        "USER_REGISTER[101]: 2 → 0",
        "USER_REGISTER[102]: 3 → 0",
    ]
    assert {frame[1] for _, frame in wire.sent} <= {1, 2, 3}
    assert [str(change) for change in mic.restore_snapshot(kept)] == planned
    assert mic.get("M2_ACC", "USER_REGISTER[101]", "M1_POS_ACT", "OUT4") == {
        "M2_ACC": 50.0,
        "USER_REGISTER[101]": 0,
        "M1_POS_ACT": 55.0,
        "OUT4": True,
    }
    assert {str(change) for change in mic.restore_snapshot(kept, counters=True, outputs=True)} == {
        "M1_POS_ACT: 55 → 0",
        "OUT4: ON → OFF",
    }
    assert mic.restore_snapshot(kept, counters=True, outputs=True) == []


def test_nothing_in_it_moves() -> None:
    wire = Wire()
    mic = driver(wire)
    mic.enable()
    kept = mic.take_snapshot()
    other = Wire()
    fresh = driver(other)
    fresh.restore_snapshot(kept, counters=True, outputs=True)
    other.rest()
    assert [axis.status for axis in other.twin.axes] == [0, 0, 0, 0]
    assert not [name for name in kept.values if name.endswith(("POS_ABS", "POS_REL", "HOME", "_EN", "STOP", "PROGRAM_CTRL"))]


def test_nothing_is_put_back_while_something_moves() -> None:
    wire = Wire()
    mic = driver(wire)
    mic.enable()
    kept = mic.take_snapshot()
    mic.axis(2).move_velocity(5.0)
    with pytest.raises(NotReady, match=r"nothing is restored while axes move: M2 \("):
        mic.restore_snapshot(kept)


def test_snapshots_are_text() -> None:
    mic = driver(Wire())
    changed(mic)
    kept = mic.take_snapshot()
    assert Snapshot.from_json(kept.to_json()) == kept
    assert kept.user[100:] == (1, 2, 3)
    for text in ("", "[]", "{}", '{"format": "something"}'):
        with pytest.raises(Misuse, match=r"no snapshot|the format is"):
            Snapshot.from_json(text)
    with pytest.raises(Misuse, match=r"the snapshot is of firmware 1.70, this controller has 1.23"):
        driver(Wire(firmware="1.23")).restore_snapshot(kept)
