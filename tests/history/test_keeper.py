"""Between recorder and spool: what has no room is lost, and its run is there all the same."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest
from gateway_rig import GatewayWorld
from history_rig import head

from steptwin.files.world import World
from steptwin.history.keeper import HistoryKeeper
from steptwin.history.options import read_history
from steptwin.history.rows import RowBatch, RunHead
from steptwin.history.spool import Spool

CELL = """
[[mic488]]
name = "table"
[history]
database = "sqlite:///h.db"
"""


def test_a_run_that_begins_on_a_full_disk_has_its_head_before_its_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spec = read_history(World.from_toml(CELL).spec.text)
    assert spec is not None
    keeper = HistoryKeeper(spec, GatewayWorld(CELL), tmp_path)
    spool = Spool(tmp_path / "s")
    batches = [RowBatch(run=head().key, number=number, time=number, at_us=number) for number in (1, 2)]

    def full(_: Spool, head: RunHead) -> None:
        raise OSError(errno.ENOSPC, "")

    with monkeypatch.context() as patch:
        patch.setattr(Spool, "begin", full)
        assert keeper._put(spool, [head(), batches[0]]) == [batches[0]]
    assert keeper._put(spool, [batches[1]]) == []
    taken = spool.take()
    assert taken is not None
    assert (taken.head, [one.number for one in taken.batches]) == (head(), [2])
    spool.done(taken)
    spool.close()
