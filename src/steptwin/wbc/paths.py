"""Needs of MOVEPTP, lines, circles and arcs in a row of the position table. Checker and controller refuse alike."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from steptwin.messages import Message
from steptwin.tables import complete
from steptwin.wbc.statements import LINES, ROW_MOTIONS

PATH_VELOCITY = Message("wbc.path-velocity", "the path velocity p3 must be greater than 0")
MISSING = Message("wbc.missing", "{names} missing")
RADIUS = Message("wbc.radius", "the radius p3 is {radius:g} and must be greater than 0")
ARC_SIDE = Message("wbc.arc-side", "p4 is {side:g} and must be 0 (external arc) or 1 (internal arc)")

Parameters = tuple[float | None, ...]


def row_problem(keyword: str, values: Parameters) -> str | None:
    """The reason for which a row cannot be the path of a statement; None if it can.

    MOVEPTP takes any row. A line needs p1 or p2 (the axis left alone stays), a circle its centre and radius, DOCIRC its angle
    too, DOARC all four. p3 of a line may be left out (WBC-11).
    """
    return _PROBLEMS[keyword](values)


def _any_row(values: Parameters) -> str | None:
    return None


def _line(values: Parameters) -> str | None:
    velocity = values[2]
    return PATH_VELOCITY() if velocity is not None and velocity <= 0 else None


def _begin_of_circle(values: Parameters) -> str | None:
    return _lacking(values[:3]) or _radius(values)


def _circle(values: Parameters) -> str | None:
    return _lacking(values) or _radius(values)


def _arc(values: Parameters) -> str | None:
    side = values[3]
    wrong = side is not None and side not in (0, 1)
    return _circle(values) or (ARC_SIDE(side=side) if wrong else None)


def _lacking(values: Parameters) -> str | None:
    missing = [f"p{number}" for number, value in enumerate(values, 1) if value is None]
    return MISSING(names=", ".join(missing)) if missing else None


def _radius(values: Parameters) -> str | None:
    radius = values[2]
    return RADIUS(radius=radius) if radius is not None and radius <= 0 else None


_PROBLEMS: Mapping[str, Callable[[Parameters], str | None]] = complete(
    "statement with a row",
    ROW_MOTIONS,
    "check",
    {
        "MOVEPTP": _any_row,
        "MOVELIN": _line,
        "MOVELIN_REL": _line,
        "MOVETOCIRC": _begin_of_circle,
        "DOCIRC": _circle,
        "DOARC": _arc,
    },
)


def names_no_axis(keyword: str, values: Parameters) -> bool:
    """Whether a motion with this row would move nothing."""
    axes = values if keyword == "MOVEPTP" else values[:2] if keyword in LINES else ()
    return bool(axes) and all(value is None for value in axes)
