"""Batches in the tables: each once, whatever is written again."""

from __future__ import annotations

from history_rig import BEGAN_US, head
from sqlalchemy import Engine, func, select

from steptwin.history.rows import EventRow, PlanRow, RowBatch, SampleRow
from steptwin.history.schema import EVENT, PLAN, POINT, RUN, SAMPLE, TEXT
from steptwin.history.writing import TableWriter


def batch(number: int, **rows: list[object]) -> RowBatch:
    found: dict[str, object] = {"samples": [SampleRow(0, number, BEGAN_US + number, float(number))], **rows}
    return RowBatch(run="one", number=number, time=number, at_us=BEGAN_US + number, **found)  # type: ignore[arg-type]


def values(engine: Engine) -> list[float | None]:
    with engine.connect() as connection:
        return list(connection.execute(select(SAMPLE.c.value).order_by(SAMPLE.c.id)).scalars())


def test_what_is_written_again_is_there_once(engine: Engine) -> None:
    with engine.begin() as connection:
        assert TableWriter().write(connection, head(), [batch(1), batch(2)]) == BEGAN_US + 1
    with engine.begin() as connection:
        assert TableWriter().write(connection, head(), [batch(1), batch(2), batch(3)]) == BEGAN_US + 3
    with engine.begin() as connection:
        assert TableWriter().write(connection, head(), [batch(3)]) is None
    assert values(engine) == [1.0, 2.0, 3.0]


def test_what_did_not_come_to_its_end_is_not_there(engine: Engine) -> None:
    writer = TableWriter()
    with engine.connect() as connection:
        writer.write(connection, head(), [batch(1, samples=[SampleRow(0, 1, 1, "text")])])
        connection.rollback()
    writer.forget()
    with engine.begin() as connection:
        writer.write(connection, head(), [batch(1, samples=[SampleRow(0, 1, 1, "text")])])
    with engine.connect() as connection:
        assert connection.execute(select(TEXT.c.text)).scalars().all() == ["text"]
        assert connection.execute(select(func.count()).select_from(POINT)).scalar_one() == 1


def test_tries_that_fail_take_no_numbers_of_runs(engine: Engine) -> None:
    for key in ("one", "two"):
        for _ in range(3):
            with engine.connect() as connection:
                TableWriter().write(connection, head(key), [batch(1)])
                connection.rollback()
        with engine.begin() as connection:
            TableWriter().write(connection, head(key), [batch(1)])
    with engine.connect() as connection:
        assert connection.execute(select(RUN.c.id).order_by(RUN.c.id)).scalars().all() == [1, 2]


def test_all_kinds_of_rows_and_the_row_of_the_run(engine: Engine) -> None:
    rows = RowBatch(
        run="one",
        number=1,
        time=7,
        at_us=BEGAN_US + 9,
        is_last=True,
        samples=[SampleRow(0, 1, 2, 1.25), SampleRow(1, 1, 2, "moving"), SampleRow(2, 1, 2, None)],
        plans=[PlanRow(0, 3, 4, "{}", -5, 80.0, 2**32), PlanRow(0, 4, 5, "{}", 0, 1.0, None)],
        events=[EventRow(5, 6, 7, "table", "status", None, "text", "{}")],
    )
    with engine.begin() as connection:
        TableWriter().write(connection, head(), [rows])
    with engine.connect() as connection:
        run = connection.execute(select(RUN)).one()
        assert (run.key, run.subject, run.virtual, run.began_us) == ("one", "cell", True, BEGAN_US)
        assert (run.last_ns, run.last_us, run.ended, run.batches) == (7, BEGAN_US + 9, True, 1)
        wanted = (
            select(POINT.c.name, SAMPLE.c.value, TEXT.c.text)
            .join_from(SAMPLE, POINT)
            .outerjoin(TEXT, TEXT.c.id == SAMPLE.c.text_id)
        )
        found = {tuple(row) for row in connection.execute(wanted)}
        assert found == {("table.p0", 1.25, None), ("table.p1", None, "moving"), ("table.p2", None, None)}
        plans = connection.execute(select(PLAN.c.t_ns, PLAN.c.at_us, PLAN.c.origin, PLAN.c.scale, PLAN.c.round_p)).all()
        assert [tuple(row) for row in plans] == [(3, 4, -5, 80.0, 2**32), (4, 5, 0, 1.0, None)]
        event = connection.execute(select(EVENT)).one()
        assert (event.t_ns, event.at_us, event.number, event.machine, event.kind) == (5, 6, 7, "table", "status")
        assert (event.cause, event.text, event.content) == (None, "text", "{}")
