"""Traces that are written while a world runs."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.files.export import axis_views, read_trace
from steptwin.files.export.tracefile import Ring, TraceFile, read_kept
from steptwin.files.world import World
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.script import steps as do

CONTROLLER = '[world]\nname = "cell"\n[[mic488]]\nname = "table"\n'


def world() -> World:
    made = World.from_toml(CONTROLLER)
    for number in range(3):
        made.at(f"{number + 1} s", do.Set((("table", "IN1", float(number % 2)), ("table", "AIN1", float(number)))))
        made.at(f"{number + 1} s", do.Note(f"step {number}"))
    return made


def written(path: Path, made: World, *, until_s: float = 5.0) -> TraceFile:
    file = TraceFile(made.trace, path, axis_views(made), made.spec.name, lambda _: None)
    made.trace.let_go()
    made.run(until=until_s)
    return file


def test_a_file_that_grows_has_the_trace_of_a_world_that_keeps_it(tmp_path: Path) -> None:
    kept, made = world(), world()
    kept.run(until=5.0)
    file = written(tmp_path / "t.jsonl", made)
    file.close(made.now)
    saved = read_trace(tmp_path / "t.jsonl")
    assert list(saved.trace) == list(kept.trace)
    assert (saved.title, saved.until, saved.digest) == ("cell", 5 * SECOND, kept.trace.digest())
    assert list(made.trace) == []  # nothing is held in memory


def test_a_file_of_a_process_that_was_killed_is_read_up_to_there(tmp_path: Path) -> None:
    made = world()
    path = tmp_path / "t.jsonl"
    written(path, made).close(made.now)
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:-2]) + lines[-2][:20])
    saved = read_trace(path)
    assert len(saved.trace) == len(lines) - 3
    assert saved.until == max(record.time for record in saved.trace)


def test_a_file_with_an_end_is_checked_against_its_digest(tmp_path: Path) -> None:
    made = world()
    path = tmp_path / "t.jsonl"
    written(path, made).close(made.now)
    path.write_text(path.read_text().replace("step 1", "step 7"))
    with pytest.raises(Misuse, match="digest"):
        read_trace(path)


def test_a_full_disk_is_told_once_and_the_world_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not os.access("/dev/full", os.W_OK):
        pytest.skip("there is no /dev/full")
    made, told = world(), []
    with monkeypatch.context() as full:
        full.setattr(Path, "open", lambda _, *given, **named: open("/dev/full", *given, **named))  # noqa: SIM115
        file = TraceFile(made.trace, tmp_path / "t.jsonl", axis_views(made), "cell", told.append)
    made.trace.let_go()
    for number in range(3000):
        made.trace.add(_record(number))
    made.run(until=5.0)
    assert told == [f"cannot write {tmp_path / 't.jsonl'}: no space left on device"]
    with pytest.raises(Misuse, match="no space left on device"):
        file.close(made.now)


def test_an_earlier_trace_stays_until_the_new_one_has_begun(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made, path = world(), tmp_path / "t.jsonl"
    path.write_text("the earlier one")

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(Misuse, match="no space left on device"):
        TraceFile(made.trace, path, axis_views(made), "cell", [].append)
    assert path.read_text() == "the earlier one"


def _record(number: int) -> TraceRecord:
    return TraceRecord(0, "world", "event", "note", f"{number} " + "x" * 50)


def test_a_ring_has_the_last_records() -> None:
    kept, made = world(), world()
    kept.run(until=5.0)
    ring = Ring(made.trace, 4)
    made.trace.let_go()
    made.run(until=5.0)
    assert list(ring.trace()) == list(kept.trace)[-4:]


@pytest.mark.parametrize(
    ("text", "kept"),
    [("off", None), ("ring 10", 10), ("t.jsonl", Path("t.jsonl")), ("ring.jsonl", Path("ring.jsonl")), ("out", Path("out"))],
)
def test_what_is_kept(text: str, kept: object) -> None:
    assert read_kept(text) == kept


@pytest.mark.parametrize("text", ["ring 0", "ring", "ring x", "ring 10000001"])
def test_a_ring_takes_a_number(text: str) -> None:
    with pytest.raises(Misuse, match="a ring takes a number of records from 1 to 10000000"):
        read_kept(text)
