"""The first tables."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None

_ID = sa.BigInteger().with_variant(sa.Integer, "sqlite")


def upgrade() -> None:
    op.create_table(
        "run",
        sa.Column("id", sa.Integer),
        sa.Column("key", sa.String(40), nullable=False),
        sa.Column("subject", sa.String(200), nullable=False),
        sa.Column("virtual", sa.Boolean, nullable=False),
        sa.Column("began_ns", sa.BigInteger, nullable=False),
        sa.Column("began_us", sa.BigInteger, nullable=False),
        sa.Column("last_ns", sa.BigInteger, nullable=False),
        sa.Column("last_us", sa.BigInteger, nullable=False),
        sa.Column("ended", sa.Boolean, nullable=False),
        sa.Column("batches", sa.BigInteger, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_run"),
        sa.UniqueConstraint("key", name="uq_run_key"),
        comment="One recording, from a start of a process, or from the moment to which its time went back. last_*: up"
        " to when it is complete. batches: the number of the last batch in it.",
    )
    op.create_table(
        "point",
        sa.Column("id", sa.Integer),
        sa.Column("subject", sa.String(200), nullable=False),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("unit", sa.String(40), nullable=False),
        sa.Column("type", sa.String(20), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_point"),
        sa.UniqueConstraint("subject", "name", "unit", "type", name="uq_point_subject"),
        comment="A value with its unit, in which it is kept.",
    )
    op.create_table(
        "text",
        sa.Column("id", sa.Integer),
        sa.Column("text", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_text"),
        sa.UniqueConstraint("text", name="uq_text_text"),
        comment="Texts, each once.",
    )
    for name, comment, *more in (
        (
            "sample",
            (
                "A value that holds until the next one of the same point, or the end of the run. Neither value nor "
                "text: not known."
            ),
            sa.Column("value", sa.Float(53)),
            sa.Column("text_id", sa.Integer),
        ),
        (
            "plan",
            (
                "A motion, from which positions follow (steptwin.motion.planjson): (pulses + origin) / scale, between "
                "-round_p/2 and round_p/2 pulses where there is a round_p. It holds as a sample does."
            ),
            sa.Column("plan", sa.Text, nullable=False),
            sa.Column("origin", sa.BigInteger, nullable=False),
            sa.Column("scale", sa.Float(53), nullable=False),
            sa.Column("round_p", sa.BigInteger),
        ),
    ):
        op.create_table(
            name,
            sa.Column("id", _ID, autoincrement=True),
            sa.Column("run_id", sa.Integer, nullable=False),
            sa.Column("point_id", sa.Integer, nullable=False),
            sa.Column("t_ns", sa.BigInteger, nullable=False),
            sa.Column("at_us", sa.BigInteger, nullable=False),
            *more,
            sa.PrimaryKeyConstraint("id", name=f"pk_{name}"),
            sa.ForeignKeyConstraint(["run_id"], ["run.id"], name=f"fk_{name}_run_id"),
            sa.ForeignKeyConstraint(["point_id"], ["point.id"], name=f"fk_{name}_point_id"),
            comment=comment,
        )
        op.create_index(f"ix_{name}_point_at", name, ["point_id", "at_us"])
    op.create_table(
        "event",
        sa.Column("id", _ID, autoincrement=True),
        sa.Column("run_id", sa.Integer, nullable=False),
        sa.Column("t_ns", sa.BigInteger, nullable=False),
        sa.Column("at_us", sa.BigInteger, nullable=False),
        sa.Column("number", sa.BigInteger, nullable=False),
        sa.Column("machine", sa.String(200), nullable=False),
        sa.Column("kind", sa.String(20), nullable=False),
        sa.Column("cause", sa.BigInteger),
        sa.Column("text", sa.Text, nullable=False),
        sa.Column("content", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_event"),
        sa.ForeignKeyConstraint(["run_id"], ["run.id"], name="fk_event_run_id"),
        comment="Something that happened; content: its payload as JSON (docs/control.md).",
    )
    op.create_index("ix_event_at", "event", ["at_us"])
    op.create_table(
        "summary",
        sa.Column("point_id", sa.Integer, nullable=False),
        sa.Column("at_us", sa.BigInteger, nullable=False),
        sa.Column("changes", sa.Integer, nullable=False),
        sa.Column("least", sa.Float(53)),
        sa.Column("mean", sa.Float(53)),
        sa.Column("most", sa.Float(53)),
        sa.PrimaryKeyConstraint("point_id", "at_us", name="pk_summary"),
        sa.ForeignKeyConstraint(["point_id"], ["point.id"], name="fk_summary_point_id"),
        comment="A minute of a number: changes in it, least and greatest value, mean over the time in which it was known.",
    )
    op.create_table(
        "chore",
        sa.Column("name", sa.String(20), nullable=False),
        sa.Column("done_us", sa.BigInteger, nullable=False),
        sa.PrimaryKeyConstraint("name", name="pk_chore"),
        comment="Up to when work on what has been kept is done.",
    )
