"""What waits for the database: in order, each once, also after the process has ended anywhere."""

from __future__ import annotations

import errno
from collections import namedtuple
from pathlib import Path

import pytest
from history_rig import head
from hypothesis import given
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.history import spool as module
from steptwin.history.rows import EventRow, PlanRow, RowBatch, SampleRow, read_batch, read_head
from steptwin.history.spool import Spool


def batch(number: int, run: str = "one", text: str = "") -> RowBatch:
    samples = [SampleRow(0, number, number, text or 1.5), SampleRow(1, number, number, None)]
    return RowBatch(run=run, number=number, time=number, at_us=number, samples=samples)


def take_all(spool: Spool) -> list[tuple[str, int]]:
    found: list[tuple[str, int]] = []
    while taken := spool.take():
        assert taken.head is not None
        found += [(taken.head.key, one.number) for one in taken.batches]
        spool.done(taken)
    return found


numbers = st.integers(-(2**63), 2**63 - 1)
values = st.none() | st.text() | st.floats(allow_nan=False, allow_infinity=False)


@given(
    st.lists(st.builds(SampleRow, st.integers(0, 9), numbers, numbers, values)),
    st.lists(st.builds(PlanRow, st.integers(0, 9), numbers, numbers, st.text(), numbers, st.floats(0.1, 9), st.none() | numbers)),
    st.lists(st.builds(EventRow, numbers, numbers, numbers, st.text(), st.text(), st.none() | numbers, st.text(), st.text())),
    st.booleans(),
)
def test_rows_as_a_line_and_back(samples: list[SampleRow], plans: list[PlanRow], events: list[EventRow], is_last: bool) -> None:
    made = RowBatch(run="r", number=3, time=4, at_us=5, is_last=is_last, samples=samples, plans=plans, events=events)
    assert made.line().count(b"\n") == 1
    assert read_batch(made.line()) == made
    assert len(made) == len(samples) + len(plans) + len(events)


def test_a_line_that_a_full_disk_takes_in_part_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spool = Spool(tmp_path / "s")
    spool.begin(head())
    assert spool.append(batch(1))
    file = spool._file
    assert file is not None

    class Full:
        """Takes half of what is written, then nothing."""

        taken = False

        def write(self, data: memoryview) -> int:
            if self.taken:
                raise OSError(errno.ENOSPC, "")
            self.taken = True
            return file.write(data[: len(data) // 2])

        truncate, close = file.truncate, file.close

    monkeypatch.setattr(spool, "_file", Full())
    with pytest.raises(OSError, match=str(errno.ENOSPC)):
        spool.append(batch(2))
    assert spool.append(batch(3))
    assert take_all(spool) == [("one", 1), ("one", 3)]
    spool.close()
    assert not (tmp_path / "s" / module.REFUSED).exists()


def test_a_head_as_a_line_and_back() -> None:
    assert read_head(head().line()) == head()


def test_batches_come_in_their_order(tmp_path: Path) -> None:
    spool = Spool(tmp_path / "s")
    spool.begin(head())
    for number in range(1, 6):
        assert spool.append(batch(number))
    assert take_all(spool) == [("one", number) for number in range(1, 6)]
    assert spool.take() is None
    assert not spool.more.is_set()
    spool.append(batch(6))
    assert spool.more.is_set()
    assert take_all(spool) == [("one", 6)]
    spool.close()
    assert not (tmp_path / "s").exists()  # nothing waits


def test_what_was_not_confirmed_is_there_after_the_process_has_ended(tmp_path: Path) -> None:
    spool = Spool(tmp_path)
    spool.begin(head())
    spool.append(batch(1))
    taken = spool.take()
    assert taken is not None
    spool.done(taken)
    spool.append(batch(2))
    spool.begin(head("two"))
    spool.append(batch(1, "two"))
    spool.take()  # not confirmed
    spool.close()
    again = Spool(tmp_path)
    again.begin(head("three"))
    again.append(batch(1, "three"))
    # what was confirmed in a segment that is still there comes again; its number tells the writer
    assert take_all(again) == [("one", 1), ("one", 2), ("two", 1), ("three", 1)]
    again.close()


@given(cut=st.integers(1, 40))
def test_a_line_that_was_not_ended_is_left_out(cut: int, tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("spool")
    spool = Spool(folder)
    spool.begin(head())
    spool.append(batch(1))
    spool.append(batch(2))
    spool.close()
    (segment,) = folder.glob("*.rows")
    segment.write_bytes(segment.read_bytes()[:-cut])
    again = Spool(folder)
    assert take_all(again) == [("one", 1)]
    again.close()


def test_segments_follow_each_other_and_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SEGMENT_BYTES", 200)
    monkeypatch.setattr(module, "TAKE_BYTES", 100)
    spool = Spool(tmp_path)
    spool.begin(head())
    for number in range(1, 31):
        spool.append(batch(number))
    assert len(list(tmp_path.glob("*.rows"))) > 5
    assert take_all(spool) == [("one", number) for number in range(1, 31)]
    assert len(list(tmp_path.glob("*.rows"))) == 1
    assert spool.waiting == 0
    spool.close()


def test_a_full_spool_takes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spool = Spool(tmp_path)
    spool.begin(head())
    monkeypatch.setattr(module, "MOST_BYTES", 150)
    kept = [number for number in range(1, 10) if spool.append(batch(number))]
    assert kept == list(range(1, len(kept) + 1))
    assert len(kept) < 9
    assert take_all(spool) == [("one", number) for number in kept]
    assert spool.append(batch(20))
    usage = namedtuple("usage", "total used free")(100, 99, 1)
    monkeypatch.setattr(module.shutil, "disk_usage", lambda _: usage)
    assert not spool.append(batch(21))
    spool.close()


def test_a_folder_belongs_to_one_process(tmp_path: Path) -> None:
    spool = Spool(tmp_path)
    with pytest.raises(Misuse, match="is in use by another process: give this one a 'spool' of its own"):
        Spool(tmp_path)
    spool.close()
    Spool(tmp_path).close()


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(Misuse, match=r"cannot keep what the database has not taken yet in .*file"):
        Spool(tmp_path / "file")


def test_rows_without_their_head_and_damaged_lines_are_set_apart(tmp_path: Path) -> None:
    spool = Spool(tmp_path)
    spool.begin(head())
    spool.append(batch(1))
    spool.close()
    (segment,) = tmp_path.glob("*.rows")
    good = segment.read_bytes()
    segment.write_bytes(b"\0\0\0\n" + good)
    again = Spool(tmp_path)
    assert take_all(again) == [("one", 1)]
    assert (tmp_path / "refused").read_bytes() == b"\0\0\0\n"
    again.close()
    (tmp_path / "00000009-lost.rows").write_bytes(good)
    third = Spool(tmp_path)
    taken = third.take()
    assert taken is not None
    assert (taken.head, taken.batches, taken.lines) == (None, [], [good])
    third.close()
