"""The results of a campaign in a database, each under the digest of the campaign and the number of its case."""

from __future__ import annotations

import json
from array import array
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    Connection,
    Float,
    ForeignKey,
    Integer,
    MetaData,
    String,
    Table,
    Text,
    func,
    insert,
    select,
    update,
)
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.engine import URL
from sqlalchemy.exc import DBAPIError

from steptwin.campaign.case import Case, CaseResult
from steptwin.campaign.results import StoredCase
from steptwin.coverage.counts import Coverage
from steptwin.errors import Misuse
from steptwin.history.database import POSTGRESQL, SQLITE, engine_of, failure, format_url

FORMAT = 1
"""Version of the tables; another one is refused."""
_CREATION = 0x73746570
"""The advisory lock of PostgreSQL for the creation of the tables."""
_STREAMED = 1000
"""Rows that are fetched at a time."""

METADATA = MetaData()
CAMPAIGN = Table(
    "campaign",
    METADATA,
    Column("id", Integer, primary_key=True),
    Column("digest", String(32), nullable=False, unique=True),
    Column("format", Integer, nullable=False),
    Column("name", Text, nullable=False),
    Column("seed", BigInteger, nullable=False),
    Column("covered", BigInteger, nullable=False),
    Column("coverage", Text),
    comment="A campaign by the digest of all that its results depend on. covered: so many of its cases are in coverage.",
)
CASE = Table(
    "campaign_case",
    METADATA,
    Column("campaign_id", ForeignKey(CAMPAIGN.c.id), primary_key=True),
    Column("number", BigInteger, primary_key=True, autoincrement=False),
    Column("failed", Boolean, nullable=False, index=True),
    Column("robustness", Float(53)),
    Column("given", Text, nullable=False),
    Column("result", Text, nullable=False),
    comment="One run. given: the case as JSON; result: what came of it.",
)


class CampaignStore:
    """See `steptwin.campaign.results.ResultStore`. ``is_own``: the database is for it alone. Raises `LineFailure` where there is
    no database, and `Misuse` for one of another campaign or version."""

    def __init__(self, url: URL, digest: str, name: str, seed: int, *, is_own: bool) -> None:
        self._url = url
        self._engine = engine_of(url)
        self._insert: Any = postgresql.insert if url.get_backend_name() == POSTGRESQL else sqlite.insert
        try:
            with self._begin() as connection:
                _lock(connection)
                METADATA.create_all(connection)
                self._id = self._find(connection, digest, name, seed, is_own=is_own)
        except BaseException:
            self._engine.dispose()
            raise

    def _find(self, connection: Connection, digest: str, name: str, seed: int, *, is_own: bool) -> int:
        rows = connection.execute(select(CAMPAIGN.c.id, CAMPAIGN.c.digest, CAMPAIGN.c.format)).all()
        if any(row.format != FORMAT for row in rows):
            raise Misuse(f"{format_url(self._url)} was written by another version of steptwin")
        if is_own and any(row.digest != digest for row in rows):
            raise Misuse(
                f"{format_url(self._url)} has the results of another campaign, or of this one before a change: give another --out"
            )
        found = next((row.id for row in rows if row.digest == digest), None)
        if found is None:
            made = connection.execute(insert(CAMPAIGN).values(digest=digest, format=FORMAT, name=name, seed=seed, covered=0))
            found = made.inserted_primary_key[0]  # type: ignore[index]
        return int(found)

    @contextmanager
    def _begin(self) -> Generator[Connection]:
        try:
            with self._engine.begin() as connection:
                yield connection
        except DBAPIError as error:
            raise failure(self._url, error) from None

    def close(self) -> None:
        self._engine.dispose()

    # ------------------------------------------------------------------ writing

    def add(self, found: Sequence[StoredCase], coverage: Coverage | None = None) -> None:
        rows = [
            {
                "campaign_id": self._id,
                "number": case.number,
                "failed": result.failed,
                "robustness": result.robustness,
                "given": _json(case.to_json()),
                "result": _json(result.to_json()),
            }
            for case, result in found
        ]
        with self._begin() as connection:
            if rows:
                connection.execute(self._insert(CASE).on_conflict_do_nothing(), rows)
            if coverage is not None:
                counted = CAMPAIGN.c.covered + len(rows)
                values = {"coverage": _json(coverage.to_json()), "covered": counted}
                connection.execute(update(CAMPAIGN).where(CAMPAIGN.c.id == self._id).values(values))

    # ------------------------------------------------------------------ reading

    def numbers(self) -> array[int]:
        with self._begin() as connection:
            wanted = select(CASE.c.number).where(CASE.c.campaign_id == self._id).order_by(CASE.c.number)
            return array("q", connection.execute(wanted, execution_options={"yield_per": _STREAMED}).scalars())

    def results(self, before: int | None = None, *, failed: bool | None = None) -> Iterator[StoredCase]:
        """In the order of their numbers; ``before``: only those with lower ones; ``failed``: only such as did, or did not."""
        wanted = select(CASE.c.given, CASE.c.result).where(CASE.c.campaign_id == self._id).order_by(CASE.c.number)
        if before is not None:
            wanted = wanted.where(CASE.c.number < before)
        if failed is not None:
            wanted = wanted.where(CASE.c.failed == failed)
        with self._begin() as connection:
            for given, result in connection.execute(wanted, execution_options={"yield_per": _STREAMED}):
                yield StoredCase(Case.from_json(json.loads(given)), CaseResult.from_json(json.loads(result)))

    def failed(self) -> int:
        wanted = select(func.count()).where(CASE.c.campaign_id == self._id, CASE.c.failed)
        with self._begin() as connection:
            return connection.execute(wanted).scalar_one()

    def first_failure(self) -> int | None:
        wanted = select(CASE.c.number).where(CASE.c.campaign_id == self._id, CASE.c.failed).order_by(CASE.c.number).limit(1)
        with self._begin() as connection:
            return connection.execute(wanted).scalar()

    def coverage(self) -> tuple[Coverage, int]:
        with self._begin() as connection:
            row = connection.execute(select(CAMPAIGN.c.coverage, CAMPAIGN.c.covered).where(CAMPAIGN.c.id == self._id)).one()
            return Coverage.from_json(json.loads(row.coverage or "[]")), int(row.covered)


def counted(path: Path) -> tuple[int, int]:
    """How many results a database beside a campaign has, and how many of them failed; it may be written meanwhile.

    Raises `LineFailure`.
    """
    url = URL.create(SQLITE, database=str(path))
    engine = engine_of(url)
    try:
        with engine.connect() as connection:
            failed = func.count().filter(CASE.c.failed)
            return tuple(connection.execute(select(func.count(), failed).select_from(CASE)).one())
    except DBAPIError as error:
        raise failure(url, error) from None
    finally:
        engine.dispose()


def _lock(connection: Connection) -> None:
    """Until the end of the transaction no other process creates the tables, or enters the campaign."""
    if connection.dialect.name == POSTGRESQL:
        connection.execute(select(func.pg_advisory_xact_lock(_CREATION)))
    else:
        connection.exec_driver_sql("BEGIN IMMEDIATE")


_json = json.JSONEncoder(ensure_ascii=False, separators=(",", ":")).encode
