"""Everything the registers hold, kept and put back."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from host_rig import Wire, driver

from steptwin.drivers import Mic488, Mic488Snapshot, NotReady
from steptwin.drivers.mic488.snapshot import FORMAT
from steptwin.errors import Misuse
from steptwin.mic488.registermap import DataType


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


def test_what_the_controller_has_not_kept_is_told() -> None:
    """As where a program of it writes the same user register."""
    wire = Wire()
    mic = driver(wire)
    kept = mic.take_snapshot()
    mic.user.words.write_many(100, [1, 2])

    def write(frame: bytes) -> None:
        if frame[1] == 16:
            wire.before_each = lambda _: wire.twin.user.__setitem__(101, 9)

    wire.before_each = write
    with pytest.raises(NotReady, match=r"memory: not kept by the controller: USER_REGISTER\[101\]: 9 → 0$"):
        mic.restore_snapshot(kept)


def test_changes_are_in_the_order_of_the_snapshot_but_for_data_type() -> None:
    mic = driver(Wire())
    kept = mic.take_snapshot()
    for name, value in (("OUT2", 1), ("M2_ACC", 7.0), ("M1_ACC", 8.0), ("DATA_TYPE", 1)):
        mic.set(name, value)
    order = ("M2_ACC", "OUT2", "DATA_TYPE", "M1_ACC")
    values = {name: kept.values[name] for name in order}
    found = mic.restore_snapshot(replace(kept, values=values), outputs=True, dry_run=True)
    assert [change.item.name for change in found] == ["DATA_TYPE", "M2_ACC", "OUT2", "M1_ACC"]


@pytest.mark.parametrize("backwards", [False, True])
def test_values_are_put_back_with_the_data_type_they_were_read_with(backwards: bool) -> None:
    """Whatever the order of the names in the file."""
    wire = Wire()
    mic = driver(wire)
    mic.set("DATA_TYPE", DataType.DINT)
    data = json.loads(mic.take_snapshot().to_json())
    data["values"] = dict(sorted(data["values"].items(), reverse=backwards))
    mic.set("DATA_TYPE", DataType.REAL)
    mic.axis(2).set_ramp(acc=7.0)
    changes = mic.restore_snapshot(Mic488Snapshot.from_json(json.dumps(data)))
    assert str(changes[0]) == f"DATA_TYPE: {DataType.REAL} → {DataType.DINT}"
    assert "M2_ACC: ? → 5000" in map(str, changes)
    assert (wire.twin.data_type, wire.twin.axes[1].acc_p) == (DataType.DINT, 5000)


def test_neighbouring_user_registers_are_written_together() -> None:
    wire = Wire()
    mic = driver(wire)
    mic.user.words.write_many(100, [1, 2, 0, 4])
    kept = mic.take_snapshot()
    mic.user.words.write_many(100, [0, 0, 0, 0])
    wire.sent.clear()
    mic.restore_snapshot(kept)
    written = [rtu for _, rtu in wire.sent if rtu[1] == 16]
    assert [(int.from_bytes(rtu[2:4]), int.from_bytes(rtu[4:6])) for rtu in written] == [(100, 2), (103, 1)]
    assert mic.user.words.read_many(100, 4) == [1, 2, 0, 4]
    assert len(mic.restore_snapshot(replace(kept, user=(7,) * 2000), dry_run=True)) == 2000


def test_snapshots_are_text() -> None:
    mic = driver(Wire())
    changed(mic)
    kept = mic.take_snapshot()
    assert Mic488Snapshot.from_json(kept.to_json()) == kept
    assert kept.user[100:] == (1, 2, 3)
    for text in ("", "[]", "{}", "[" * 100_000):
        with pytest.raises(Misuse, match=r"^this is not a snapshot of a MIC488 \("):
            Mic488Snapshot.from_json(text)
    other = kept.to_json().replace(FORMAT, "something")
    with pytest.raises(Misuse, match=rf"^the format is 'something', expected '{FORMAT}'$"):
        Mic488Snapshot.from_json(other)
    with pytest.raises(Misuse, match=r"the snapshot is of firmware 1.70, this controller has 1.23"):
        driver(Wire(firmware="1.23")).restore_snapshot(kept)


@pytest.mark.parametrize(
    ("what", "value", "text"),
    [
        ("M1_ACC", "x", 'the snapshot has M1_ACC = "x": expected a number'),
        ("M1_ACC", None, "the snapshot has M1_ACC = null: expected a number"),
        ("user", ["7"], r'the snapshot has USER_REGISTER\[0\] = "7": expected a number'),
        ("user", [1.5], r"the snapshot has USER_REGISTER\[0\] = 1.5: expected a number"),
        ("M1_ACC", -5, "M1_ACC = -5 u/s²: permitted > 0"),
        ("M1_ACC", float("nan"), "M1_ACC = nan u/s²: permitted > 0"),
        ("M1_NONE", 5, "no register named 'M1_NONE'"),
        ("user", [0, 70000], r"USER_REGISTER\[1\] = 70000: permitted 0…65535"),
        ("user", [7] * 2001, "the snapshot has 2001 user registers, this controller 2000"),
        ("user", [7] * 3001, "the snapshot has 3001 user registers, this controller 2000"),
    ],
)
@pytest.mark.parametrize("dry_run", [True, False])
def test_a_value_that_is_not_taken_is_found_before_anything_is_written(
    what: str, value: object, text: str, dry_run: bool
) -> None:
    wire = Wire()
    mic = driver(wire)
    data = json.loads(mic.take_snapshot().to_json())
    data["values"]["M4_ACC"] = 7.0
    if what == "user":
        data["user_registers"] = value
    else:
        data["values"][what] = value
    wire.sent.clear()
    with pytest.raises(Misuse, match=text):
        mic.restore_snapshot(Mic488Snapshot.from_json(json.dumps(data)), dry_run=dry_run)
    assert {frame[1] for _, frame in wire.sent} <= {1, 2, 3}
