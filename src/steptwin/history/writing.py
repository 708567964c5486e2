"""Batches of rows into the tables: each once, whatever fails on the way."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import Connection, and_, func, insert, select, update
from sqlalchemy import text as sql

from steptwin.history.database import insert_all
from steptwin.history.rows import KeptValue, PointRow, RowBatch, RunHead
from steptwin.history.schema import EVENT, PLAN, POINT, RUN, SAMPLE, TEXT

SAMPLES = ("run_id", "point_id", "t_ns", "at_us", "value", "text_id")
PLANS = ("run_id", "point_id", "t_ns", "at_us", "plan", "origin", "scale", "round_p")
EVENTS = ("run_id", "t_ns", "at_us", "number", "machine", "kind", "cause", "text", "content")
MOST_TEXTS = 10_000
"""Whose numbers are remembered."""


class TableWriter:
    """Writes the batches of runs in order, on one connection after the other."""

    def __init__(self) -> None:
        self._points: dict[tuple[str, PointRow], int] = {}
        self._texts: dict[str, int] = {}

    def write(self, connection: Connection, head: RunHead, batches: Sequence[RowBatch]) -> int | None:
        """Those of a run that are not there yet, in the present transaction; the moment of their first row, UTC microseconds.

        The number of the last batch is in the row of the run, so that what was written before a connection failed is known.
        """
        run, written = self._run(connection, head)
        fresh = [batch for batch in batches if batch.number > written]
        if not fresh:
            return None
        ids = [self._point(connection, head, number) for number in sorted(_points_of(fresh))]
        point = dict(zip(sorted(_points_of(fresh)), ids, strict=True))
        text = self._text_ids(connection, {row.value for batch in fresh for row in batch.samples if isinstance(row.value, str)})
        insert_all(
            connection,
            SAMPLE,
            SAMPLES,
            (
                (run, point[row.point], row.time, row.at_us, _number(row.value), text.get(row.value))
                for batch in fresh
                for row in batch.samples
            ),
        )
        plans = ((run, point[row.point], *row[1:]) for batch in fresh for row in batch.plans)
        insert_all(connection, PLAN, PLANS, plans)
        insert_all(connection, EVENT, EVENTS, ((run, *row) for batch in fresh for row in batch.events))
        last = fresh[-1]
        connection.execute(
            update(RUN)
            .where(RUN.c.id == run)
            .values(last_ns=last.time, last_us=last.at_us, ended=last.is_last, batches=last.number)
        )
        return min((row.at_us for batch in fresh for row in batch.samples), default=None)

    def forget(self) -> None:
        """Forget what was learnt in a transaction that has not come to its end."""
        self._points.clear()
        self._texts.clear()

    def _run(self, connection: Connection, head: RunHead) -> tuple[int, int]:
        """Its id, and the number of its last batch."""
        found = connection.execute(select(RUN.c.id, RUN.c.batches).where(RUN.c.key == head.key)).one_or_none()
        if found is not None:
            return found.id, found.batches
        if connection.dialect.name == "postgresql":  # another process may begin a run, too
            connection.execute(sql("LOCK TABLE run IN SHARE ROW EXCLUSIVE MODE"))
        values = {
            # A sequence would count the tries that fail, too.
            "id": select(func.coalesce(func.max(RUN.c.id), 0) + 1).scalar_subquery(),
            "key": head.key,
            "subject": head.subject,
            "virtual": head.is_virtual,
            "began_ns": head.began_ns,
            "began_us": head.began_us,
            "last_ns": head.began_ns,
            "last_us": head.began_us,
            "ended": False,
            "batches": 0,
        }
        return connection.execute(insert(RUN).values(values).returning(RUN.c.id)).scalar_one(), 0

    def _point(self, connection: Connection, head: RunHead, number: int) -> int:
        point = head.points[number]
        known = self._points.get((head.subject, point))
        if known is not None:
            return known
        values = {"subject": head.subject, "name": point.name, "unit": point.unit, "type": point.type}
        is_it = and_(*(POINT.c[name] == value for name, value in values.items()))
        found = connection.execute(select(POINT.c.id).where(is_it)).scalar_one_or_none()
        if found is None:
            found = connection.execute(insert(POINT).values(values).returning(POINT.c.id)).scalar_one()
        self._points[head.subject, point] = found
        return found

    def _text_ids(self, connection: Connection, texts: set[str]) -> dict[KeptValue, int]:
        if len(self._texts) > MOST_TEXTS:
            self._texts.clear()
        for text in sorted(texts - self._texts.keys()):
            found = connection.execute(select(TEXT.c.id).where(TEXT.c.text == text)).scalar_one_or_none()
            if found is None:
                found = connection.execute(insert(TEXT).values(text=text).returning(TEXT.c.id)).scalar_one()
            self._texts[text] = found
        return {text: self._texts[text] for text in texts}


def _points_of(batches: Sequence[RowBatch]) -> set[int]:
    return {row.point for batch in batches for row in (*batch.samples, *batch.plans)}


def _number(value: KeptValue) -> float | None:
    return None if isinstance(value, str) else value
