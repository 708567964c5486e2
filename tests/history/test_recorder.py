"""What is kept of a world: motions as plans, levels at their moments, values that are others, events."""

from __future__ import annotations

import json

import pytest
from history_rig import BEGAN_US, RecordedWorld

from steptwin.access.audit import Audit
from steptwin.access.roles import Role
from steptwin.controller import SECOND
from steptwin.gateways.clients import GatewayClient
from steptwin.motion.planjson import read_plan
from steptwin.simulation.script.steps import Note, Set, Turn, Write
from steptwin.subject import commands as command
from steptwin.subject.commands import Enable, Move

CELL = """
[world]
name = "cell"
[[mic488]]
name = "table"
[[button]]
name = "guard"
to = "table.IN1"
"""


def moving(made: RecordedWorld, to: float = 1000.0) -> None:
    made.subject.inner.do(Enable("table", 1, on=True))
    made.subject.inner.do(Move("table", 1, to=to))


def test_the_first_batch_has_everything() -> None:
    made = RecordedWorld(CELL)
    made.look()
    (first,) = made.batches
    names = [point.name for point in made.heads[0].points]
    kept = {names[row.point] for row in (*first.samples, *first.plans)}
    assert kept == set(names)
    assert "table.M1.velocity" not in names  # follows from the position
    assert "table.M1.moving" not in names
    assert "table.program.line" not in names
    assert made.rows("samples", "table.pins.IN1") == [(0.0, 0.0)]
    assert (made.heads[0].subject, made.heads[0].is_virtual, made.heads[0].began_us) == ("cell", True, BEGAN_US)
    assert first.number == 1


def test_nothing_is_kept_of_a_world_at_rest() -> None:
    made = RecordedWorld(CELL)
    made.run(30.0)
    assert len(made.batches) == 1


def test_a_run_at_rest_says_now_and_then_that_it_goes_on() -> None:
    made = RecordedWorld(CELL)
    made.run(200.0, every_s=10.0)
    assert [len(batch) > 0 for batch in made.batches] == [True, False, False, False]
    assert made.batches[-1].at_us >= BEGAN_US + 180 * 1_000_000
    assert [batch.number for batch in made.batches] == [1, 2, 3, 4]


def test_a_motion_of_an_hour_is_a_row() -> None:
    made = RecordedWorld(CELL)
    made.look()
    moving(made, to=3_600_000.0)
    made.run(3700.0, every_s=1.0)
    begin, plan = made.rows("plans", "table.M1.position")[-1]
    assert len(made.rows("plans", "table.M1.position")) == 2  # at rest, and the motion
    assert begin == pytest.approx(0.0)
    profile = read_plan(json.loads(str(plan)))
    assert profile.count(3700 * SECOND) == 3_600_000
    rows = sum(map(len, made.batches[1:]))
    assert rows <= 8  # besides it the status and the encoder when it began and ended


def test_levels_have_the_moment_of_their_edge() -> None:
    made = RecordedWorld(CELL)
    made.run(1.0)
    made.world.run(for_=0.0123)
    made.subject.inner.do(Set((("table", "IN2", 1.0),)))
    made.world.run(for_=0.5)
    made.look()
    (begin, off), (at, on) = made.rows("samples", "table.pins.IN2")
    assert (begin, off, on) == (0.0, 0.0, 1.0)
    assert at == pytest.approx(1.0123)
    (row,) = [row for row in made.batches[-1].samples if row.value == 1.0 and row.time == round(at * SECOND)]
    assert row.at_us == BEGAN_US + 1_012_300  # the wall clock of that moment, not of the look


def test_events_are_kept_with_their_content() -> None:
    made = RecordedWorld(CELL)
    made.subject.inner.do(Note("shift begins"))
    made.look()
    (event,) = made.batches[-1].events
    assert (event.kind, event.text, json.loads(event.content)) == ("note", "note: shift begins", {"note": "shift begins"})


LINE = (
    CELL.replace('"table"', '"table"\nline = "bus"')
    + """
[[mic488]]
name = "feeder"
line = "bus"
unit = 2
[[line]]
name = "bus"
"""
)


def test_writes_are_kept_with_their_source_and_lines_with_their_traffic() -> None:
    made = RecordedWorld(LINE)
    made.look()
    line, now = made.world.lines["bus"], made.world.now
    made.subject.inner.sources["bus", "tcp-1"] = "127.0.0.1:5000"
    port = line.connect("tcp-1", "tcp")
    for frame in ("000100000006020300000001", "000200000006020507d0ff00", "0003000000060206270f0001"):
        line.exchange("tcp-1", port, bytes.fromhex(frame), now)
    made.subject.inner.do(Write((("feeder", "M1_VMAX", 500.0),)))
    made.world.run(for_=1.0)
    made.look()
    writes = [event for batch in made.batches for event in batch.events if event.kind == "write"]
    assert [(event.machine, event.text) for event in writes] == [
        ("feeder", "127.0.0.1:5000: unit 2: write M1_EN = ON"),
        ("feeder", "127.0.0.1:5000: unit 2: write 9999 (unmapped) = 0001 (refused)"),
        ("feeder", "script: unit 2: write M1_VMAX = 500 imp/s"),
    ]
    assert json.loads(writes[0].content) == {
        "client": "tcp-1", "source": "127.0.0.1:5000", "words": "unit 2: write M1_EN = ON", "outcome": "done"
    }  # fmt: skip
    assert [value for _, value in made.rows("samples", "bus.requests")] == [0.0, 4.0]
    assert [value for _, value in made.rows("samples", "bus.errors")] == [0.0, 1.0]
    assert [value for _, value in made.rows("samples", "bus.unframed")] == [0.0]


def test_what_a_host_sends_to_chips_is_kept_but_not_what_it_asks() -> None:
    made = RecordedWorld('[[m1486]]\nname = "drum"\nline = "chips"\n[[line]]\nname = "chips"\nkind = "m1486"\n')
    line = made.world.lines["chips"]
    port = line.connect("pty", "raw")
    for number, text in enumerate((b"F 100\r", b"U 1\r", b"\r", b"Xq\r")):
        made.world.run(for_=0.1)
        line.exchange("pty", port, text, made.world.now)
        assert made.world.lines["chips"].traffic.requests == number + 1
    made.world.run(for_=1.0)
    made.look()
    writes = [event for batch in made.batches for event in batch.events if event.kind == "write"]
    assert [(event.machine, event.text.partition("  ")[0]) for event in writes] == [("chips", "pty: F100"), ("chips", "pty: Xq")]


def test_writes_are_not_observed_without_a_history() -> None:
    made = RecordedWorld(LINE)
    place = made.world.lines["bus"].connect("tcp-1", "tcp")
    assert place.framed is not None
    assert place.framed.on_write is not None
    made.end()
    assert place.framed.on_write is None


def test_commands_are_kept_with_who_gave_them() -> None:
    made = RecordedWorld(CELL)
    audit = Audit(lambda: "2026-03-01T12:00:00.000+00:00")
    audit.subscribers.append(made.recorder.log)
    client = GatewayClient("anna", Role.OPERATOR, "OPC UA, 127.0.0.1:5000")
    audit.add(client, made.world.now, "move", {"controller": "table", "axis": 1, "to": 5.0}, "done")
    made.look()
    (row,) = [event for event in made.batches[-1].events if event.kind == "command"]
    assert (row.machine, row.text) == ("table", "anna (OPC UA, 127.0.0.1:5000): move controller=table axis=1 to=5.0: done")
    assert json.loads(row.content)["role"] == "operator"


def test_time_that_goes_back_begins_a_run() -> None:
    made = RecordedWorld(CELL)
    made.run(1.0)
    subject = made.subject.inner
    subject.do(command.TakeSnapshot("one"))
    moving(made)
    made.run(1.0)
    subject.do(command.RestoreSnapshot("one"))
    made.look()
    assert len(made.heads) == 2
    assert made.heads[1].began_ns == SECOND
    before, after = made.batches[-2:]
    assert (before.run, before.is_last) == (made.heads[0].key, True)
    assert (after.run, after.number, after.is_last) == (made.heads[1].key, 1, False)
    kept = {made.heads[1].points[row.point].name for row in made.batches[-1].plans}
    assert kept == {f"table.M{axis}.position" for axis in (1, 2, 3, 4)}


def test_events_that_were_missed_are_counted_and_all_values_are_taken_again() -> None:
    made = RecordedWorld(CELL)
    made.look()
    subscription = made.recorder._subscription
    subscription.miss(7)
    made.world.run(for_=1.0)
    moving(made)
    subscription.take()
    subscription.miss(7)
    made.look()
    assert [event.kind for event in made.batches[-1].events] == ["gap"]
    assert made.batches[-1].events[0].text.startswith("7 events came too fast")
    assert len(made.rows("plans", "table.M1.position")) == 2


def test_a_gap_has_the_number_of_all_lost_rows_and_everything_is_kept_behind_it() -> None:
    made = RecordedWorld(CELL)
    lost = 0
    for level in (1, 0, 1, 0, 1):  # also what was kept at first is lost
        made.subject.inner.do(Set((("table", "IN2", float(level)),)))
        made.world.run(for_=0.1)
        found = made.look(has_room=False)
        made.recorder.lost(found)
        lost += sum(map(len, found))
    assert len(found) == 1 < lost
    made.recorder.lost(made.look())  # there was room, and then none: what is there again is not counted
    made.batches.clear()
    (first,) = made.look()
    assert [event.text for event in first.events] == [f"{lost} rows found no room and are missing before this moment"]
    assert {row.point for row in (*first.samples, *first.plans)} == set(range(len(made.heads[0].points)))
    assert made.rows("samples", "table.pins.IN2")[-1][1] == 1.0
    made.run(1.0)
    assert [len(batch.events) for batch in made.batches] == [1]


def test_rows_that_are_lost_at_the_last_look_are_told_at_the_end() -> None:
    made = RecordedWorld(CELL)
    lost = made.look()
    made.recorder.lost(lost)
    (event,) = made.recorder.end().events
    assert event.text == f"{sum(map(len, lost))} rows found no room and are missing before this moment"


def test_lost_rows_are_told_once_when_a_run_ends_because_time_has_gone_back_and_again_if_its_end_is_lost() -> None:
    made = RecordedWorld(CELL)
    made.subject.inner.do(command.TakeSnapshot("one"))
    lost = made.look()
    made.recorder.lost(lost)
    made.world.run(for_=0.1)
    made.subject.inner.do(command.RestoreSnapshot("one"))
    end, *others = made.look(has_room=False)
    count = sum(map(len, lost))
    told = "rows found no room and are missing before this moment"
    assert [event.text for event in end.events if told in event.text] == [f"{count} {told}"]
    made.recorder.lost([end])
    (first,) = made.look()
    events = [event.text for batch in (*others, first) for event in batch.events if told in event.text]
    assert events == [f"{count + len(end) - 1} {told}"]


def test_a_controller_that_does_not_answer_is_not_known() -> None:
    made = RecordedWorld(CELL)
    made.look()
    made.subject.silent.add("table")
    made.subject.inner.do(Turn("table", 1, 5))
    made.run(2.0)
    assert made.rows("samples", "table.status")[-1][1] is None


def test_changes_within_the_dead_band_are_left_out_but_not_where_they_end() -> None:
    made = RecordedWorld(CELL, {"table": ["USER_REGISTER[5]"]}, dead_band=5.0)
    name = "table.registers.USER_REGISTER[5]"
    for value in (10.0, 13.0, 15.0, 90.0, 91.0):
        made.subject.inner.do(Write((("table", "USER_REGISTER[5]", value),)))
        made.run(1.0, every_s=1.0)
    values = [value for _, value in made.rows("samples", name)]
    assert values == pytest.approx([0.0, 10.0, 15.0, 90.0])


def test_registers_are_kept_when_they_change() -> None:
    made = RecordedWorld(CELL, {"table": ["USER_REGISTER[5]"]})
    made.run(1.0)
    made.subject.inner.do(Write((("table", "USER_REGISTER[5]", 25.0),)))
    made.run(1.5)
    assert [value for _, value in made.rows("samples", "table.registers.USER_REGISTER[5]")] == [0.0, 25.0]


def test_the_end_is_the_last_batch() -> None:
    made = RecordedWorld(CELL)
    made.run(1.0)
    made.end()
    assert [batch.is_last for batch in made.batches] == [False, True]
    assert not made.subject.inner.subscribers
    assert made.batches[-1].time == SECOND
