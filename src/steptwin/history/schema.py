"""The tables of a history. Moments: ``t_ns`` is the time of the subject, ``at_us`` microseconds of UTC since 1970."""

from __future__ import annotations

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    Float,
    ForeignKey,
    Index,
    Integer,
    MetaData,
    String,
    Table,
    Text,
    UniqueConstraint,
)

MOST_NAME = 200
NAMING = {
    "pk": "pk_%(table_name)s",
    "fk": "fk_%(table_name)s_%(column_0_name)s",
    "uq": "uq_%(table_name)s_%(column_0_name)s",
    "ix": "ix_%(table_name)s_%(column_0_name)s",
}
"""Every constraint has a name, so that migrations of SQLite can refer to it."""

METADATA = MetaData(naming_convention=NAMING)

RUN = Table(
    "run",
    METADATA,
    Column("id", Integer, primary_key=True),
    Column("key", String(40), nullable=False, unique=True),
    Column("subject", String(MOST_NAME), nullable=False),
    Column("virtual", Boolean, nullable=False),
    Column("began_ns", BigInteger, nullable=False),
    Column("began_us", BigInteger, nullable=False),
    Column("last_ns", BigInteger, nullable=False),
    Column("last_us", BigInteger, nullable=False),
    Column("ended", Boolean, nullable=False),
    Column("batches", BigInteger, nullable=False),
    comment="One recording, from a start of a process, or from the moment to which its time went back. last_*: up to when it is "
    "complete. batches: the number of the last batch in it.",
)

POINT = Table(
    "point",
    METADATA,
    Column("id", Integer, primary_key=True),
    Column("subject", String(MOST_NAME), nullable=False),
    Column("name", String(MOST_NAME), nullable=False),
    Column("unit", String(40), nullable=False),
    Column("type", String(20), nullable=False),
    UniqueConstraint("subject", "name", "unit", "type"),
    comment="A value with its unit, in which it is kept.",
)

TEXT = Table(
    "text", METADATA, Column("id", Integer, primary_key=True), Column("text", Text, nullable=False, unique=True),
    comment="Texts, each once.",
)  # fmt: skip

SAMPLE = Table(
    "sample",
    METADATA,
    Column("id", BigInteger().with_variant(Integer, "sqlite"), primary_key=True),
    Column("run_id", ForeignKey(RUN.c.id), nullable=False),
    Column("point_id", ForeignKey(POINT.c.id), nullable=False),
    Column("t_ns", BigInteger, nullable=False),
    Column("at_us", BigInteger, nullable=False),
    Column("value", Float(53)),
    Column("text_id", Integer),
    Index("ix_sample_point_at", "point_id", "at_us"),
    comment="A value that holds until the next one of the same point, or the end of the run. Neither value nor text: not known.",
)

PLAN = Table(
    "plan",
    METADATA,
    Column("id", BigInteger().with_variant(Integer, "sqlite"), primary_key=True),
    Column("run_id", ForeignKey(RUN.c.id), nullable=False),
    Column("point_id", ForeignKey(POINT.c.id), nullable=False),
    Column("t_ns", BigInteger, nullable=False),
    Column("at_us", BigInteger, nullable=False),
    Column("plan", Text, nullable=False),
    Column("origin", BigInteger, nullable=False),
    Column("scale", Float(53), nullable=False),
    Column("round_p", BigInteger),
    Index("ix_plan_point_at", "point_id", "at_us"),
    comment="A motion, from which positions follow (steptwin.motion.planjson): (pulses + origin) / scale, between -round_p/2 and "
    "round_p/2 pulses where there is a round_p. It holds as a sample does.",
)

EVENT = Table(
    "event",
    METADATA,
    Column("id", BigInteger().with_variant(Integer, "sqlite"), primary_key=True),
    Column("run_id", ForeignKey(RUN.c.id), nullable=False),
    Column("t_ns", BigInteger, nullable=False),
    Column("at_us", BigInteger, nullable=False),
    Column("number", BigInteger, nullable=False),
    Column("machine", String(MOST_NAME), nullable=False),
    Column("kind", String(20), nullable=False),
    Column("cause", BigInteger),
    Column("text", Text, nullable=False),
    Column("content", Text, nullable=False),
    Index("ix_event_at", "at_us"),
    comment="Something that happened; content: its payload as JSON (docs/control.md).",
)

SUMMARY = Table(
    "summary",
    METADATA,
    Column("point_id", ForeignKey(POINT.c.id), primary_key=True),
    Column("at_us", BigInteger, primary_key=True),
    Column("changes", Integer, nullable=False),
    Column("least", Float(53)),
    Column("mean", Float(53)),
    Column("most", Float(53)),
    comment="A minute of a number: changes in it, least and greatest value, mean over the time in which it was known.",
)

CHORE = Table(
    "chore",
    METADATA,
    Column("name", String(20), primary_key=True),
    Column("done_us", BigInteger, nullable=False),
    comment="Up to when work on what has been kept is done.",
)
