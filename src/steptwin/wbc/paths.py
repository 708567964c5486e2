"""What MOVEPTP, lines, circles and arcs ask of a row of the position table. Checker and machine refuse for the same reasons."""

from __future__ import annotations

from steptwin.wbc.statements import CIRCLES, LINES

Parameters = tuple[float | None, ...]


def row_problem(keyword: str, values: Parameters) -> str | None:
    """Why a row cannot be the path of a statement; None when it can.

    MOVEPTP takes any row. A line needs p1 or p2 (the axis left alone stays), a circle its centre and radius, DOCIRC its angle
    too, DOARC all four. p3 of a line may be left out (WBC-11).
    """
    p1, p2, p3, p4 = values
    if keyword in LINES:
        return "the path velocity p3 must be greater than 0" if p3 is not None and p3 <= 0 else None
    if keyword not in CIRCLES:
        return None
    needed = {"p1": p1, "p2": p2, "p3": p3}
    if keyword != "MOVETOCIRC":
        needed["p4"] = p4
    missing = [name for name, value in needed.items() if value is None]
    if missing:
        return f"{', '.join(missing)} missing"
    if p3 is not None and p3 <= 0:
        return f"the radius p3 is {p3:g} and must be greater than 0"
    if keyword == "DOARC" and p4 not in (0, 1):
        return f"p4 is {p4:g} and must be 0 (external arc) or 1 (internal arc)"
    return None


def names_no_axis(keyword: str, values: Parameters) -> bool:
    """Whether a motion with this row would move nothing."""
    axes = values if keyword == "MOVEPTP" else values[:2] if keyword in LINES else ()
    return bool(axes) and all(value is None for value in axes)
