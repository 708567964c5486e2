"""What gateways get of a history."""

from __future__ import annotations

import asyncio
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from history_rig import BEGAN_US, RecordedWorld

from steptwin.errors import Misuse
from steptwin.gateways.contract import HistoryValue
from steptwin.history.database import read_url
from steptwin.history.storedvalues import StoredValues
from steptwin.subject.commands import Enable, Move

BEGAN = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=BEGAN_US)


@pytest.fixture(scope="module")
def history(tmp_path_factory: pytest.TempPathFactory) -> StoredValues:
    """A motion of 3 s, 1000 pulses/s at most, 1 s after the begin, of 10 s."""
    made = RecordedWorld('[world]\nname = "cell"\n[[mic488]]\nname = "table"\n')
    made.subject.inner.do(Enable("table", 1, on=True))
    made.run(1.0)
    made.subject.inner.do(Move("table", 1, to=2000.0))
    made.run(9.0)
    made.end()
    url = f"sqlite:///{tmp_path_factory.mktemp('h') / 'h.db'}"
    made.written(url)
    return StoredValues(read_url(url, Path()))


def values(
    history: StoredValues, point: str, begin: datetime | None = None, end: datetime | None = None, most: int | None = None
) -> list[HistoryValue]:
    return asyncio.run(history.values(point, begin, end, most))


def test_positions_while_an_axis_moves(history: StoredValues) -> None:
    found = values(history, "table.M1.position")
    at = [(one.at - BEGAN) / timedelta(seconds=1) for one in found]
    assert at == pytest.approx([0.0, 1.0, *(place / 10 for place in range(10, 41)), 10.0])
    assert found[12].value == pytest.approx(500, abs=1)  # after the ramp of a second
    assert found[-1].value == 2000.0
    speeds = values(history, "table.M1.velocity", BEGAN + timedelta(seconds=2.5), BEGAN + timedelta(seconds=2.7))
    assert [one.value for one in speeds] == [1000.0] * 3


def test_only_the_first_ones(history: StoredValues) -> None:
    whole = values(history, "table.M1.position")
    for most in (1, 2, 5, len(whole), len(whole) + 1):
        assert values(history, "table.M1.position", most=most) == whole[:most]
    assert [one.value for one in values(history, "table.M1.status", most=1)] == ["off"]


def test_what_is_not_known_is_none(history: StoredValues) -> None:
    assert [one.value for one in values(history, "table.program.state")][:1] == ["stopped"]
    with pytest.raises(Misuse, match="has been kept"):
        values(history, "table.nothing")
