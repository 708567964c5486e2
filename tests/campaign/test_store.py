"""Results in a database, SQLite and PostgreSQL alike, and in memory."""

from __future__ import annotations

import multiprocessing
from array import array
from collections.abc import Callable, Iterator
from multiprocessing.queues import Queue
from multiprocessing.synchronize import Barrier
from pathlib import Path

import pytest
from postgres import postgres_server, programs
from sqlalchemy import update

from steptwin.campaign.case import Case, CaseResult, Verdict
from steptwin.campaign.parquet import write_cases
from steptwin.campaign.results import MemoryStore, ResultStore, StoredCase, gaps
from steptwin.campaign.store import CAMPAIGN, METADATA, CampaignStore
from steptwin.coverage.counts import Coverage
from steptwin.errors import DatabaseFailure, LineFailure, Misuse
from steptwin.history.database import engine_of, read_url


@pytest.fixture(scope="module")
def postgres(require_peer: Callable[[str], str]) -> Iterator[str]:
    where = programs()
    require_peer("postgresql: initdb" if where is None else str(where / "initdb"))
    assert where is not None
    with postgres_server(where) as server:
        yield server.url


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    return url_of(request, tmp_path)


def url_of(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'r.db'}" if request.param == "sqlite" else str(request.getfixturevalue("postgres"))


def opened(url: str, digest: str, *, is_own: bool = False) -> CampaignStore:
    return CampaignStore(read_url(url, Path()), digest, "n", 1, is_own=is_own)


def stored(number: int, *, holds: bool = True, **measures: float) -> StoredCase:
    case = Case(number, {"a": number / 8, "kind": "x"}, (), (), (1 << 63) - 1, 100)
    return StoredCase(case, CaseResult(number, (Verdict("p", holds, 0.5 if holds else -0.5, 7, ""),), "d", 100, measures))


@pytest.fixture(params=["sqlite", "postgresql", "memory"])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> ResultStore:
    """To be closed."""
    return MemoryStore() if request.param == "memory" else opened(url_of(request, tmp_path), request.function.__name__[-32:])


def test_results_come_back_in_the_order_of_their_numbers(store: ResultStore) -> None:
    given = [stored(n, holds=n != 2, m=n / 3) for n in range(5)]
    store.add(given[3:])
    store.add(given[:3])
    store.add([stored(1, holds=False)])  # what is there stays
    assert list(store.results()) == given
    assert list(store.results(before=2)) == given[:2]
    assert list(store.results(failed=True)) == [given[2]]
    assert list(store.results(failed=False)) == [*given[:2], *given[3:]]
    assert (store.numbers(), store.failed(), store.first_failure()) == (array("q", range(5)), 1, 2)
    store.close()


def test_campaigns_do_not_mix(url: str) -> None:
    one, other = opened(url, "one"), opened(url, "other")
    one.add([stored(1)])
    other.add([stored(2), stored(3)])
    assert (list(one.numbers()), list(other.numbers())) == ([1], [2, 3])
    one.close()
    again = opened(url, "one")
    assert list(again.numbers()) == [1]
    with pytest.raises(Misuse, match="results of another campaign"):
        opened(url, "third", is_own=True)
    again.close()
    other.close()


def test_coverage_is_kept_with_the_cases_that_it_counts(store: ResultStore) -> None:
    store.add([stored(0)])
    store.add([stored(1), stored(2)], Coverage())
    coverage, count = store.coverage()
    assert (coverage.to_json(), count) == ([], 2)
    store.close()


def _open_at_once(url: str, others: Barrier, found: Queue[int | str]) -> None:
    others.wait()
    try:
        store = opened(url, "at once")
        store.add([stored(0)])
        found.put(len(store.numbers()))
        store.close()
    except Exception as error:  # noqa: BLE001 - the other process tells it
        found.put(repr(error))


def test_processes_that_create_it_at_the_same_moment(url: str) -> None:
    if url.startswith("postgresql"):  # the other tests have created the tables
        engine = engine_of(read_url(url, Path()))
        METADATA.drop_all(engine)
        engine.dispose()
    context = multiprocessing.get_context("spawn")
    others, found = context.Barrier(3), context.Queue()
    processes = [context.Process(target=_open_at_once, args=(url, others, found)) for _ in range(3)]
    for one in processes:
        one.start()
    assert [found.get() for _ in processes] == [1] * 3
    for one in processes:
        one.join()


def test_other_files_and_versions_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "r.db"
    opened(f"sqlite:///{path}", "one").close()
    engine = engine_of(read_url(f"sqlite:///{path}", Path()))
    with engine.begin() as connection:
        connection.execute(update(CAMPAIGN).values(format=99))
    engine.dispose()
    with pytest.raises(Misuse, match="was written by another version of steptwin"):
        opened(f"sqlite:///{path}", "one")
    path.write_text("no database" * 100)
    with pytest.raises(LineFailure, match="file is not a database"):
        opened(f"sqlite:///{path}", "one")


def test_a_full_disk_and_a_damaged_file_are_told_with_what_to_do(tmp_path: Path) -> None:
    path = tmp_path / "r.db"
    store = opened(f"sqlite:///{path}", "one")
    with store._engine.begin() as connection:  # the only connection, which is used again
        connection.exec_driver_sql("PRAGMA max_page_count=1")
    big = StoredCase(Case(1, {"x": "y" * 100_000}, (), (), 0, 1), CaseResult(1, (), "", 0, {}))
    with pytest.raises(DatabaseFailure, match=r"r\.db: database or disk is full; make room and run it again: what was written"):
        store.add([big])
    store.close()
    pages = bytearray(path.read_bytes())
    pages[100:4096] = bytes(len(pages[100:4096]))
    path.write_bytes(pages)
    with pytest.raises(DatabaseFailure, match=r"r\.db: database disk image is malformed; the file is damaged: put a copy"):
        opened(f"sqlite:///{path}", "one")


def test_gaps_are_what_is_left() -> None:
    assert list(gaps([0, 1, 4], 7)) == [2, 3, 5, 6]
    assert list(gaps([], 2)) == [0, 1]
    assert list(gaps([0, 1], 2)) == []
    endless = gaps([1], None)
    assert [next(endless) for _ in range(3)] == [0, 2, 3]


def test_all_cases_as_parquet(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    given = [stored(0, m=1.5), stored(1, holds=False), stored(2, m=2.0)]
    with (tmp_path / "r.parquet").open("wb") as file:
        write_cases(lambda: given, file)
    rows = parquet.read_table(tmp_path / "r.parquet").to_pylist()
    assert [(row["number"], row["failed"], row["value a"], row["value kind"], row["measure m"]) for row in rows] == [
        (0, False, 0.0, "x", 1.5),
        (1, True, 0.125, "x", None),
        (2, False, 0.25, "x", 2.0),
    ]
    assert [row["robustness p"] for row in rows] == [0.5, -0.5, 0.5]
