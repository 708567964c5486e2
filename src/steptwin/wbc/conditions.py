"""Conditions with a constant outcome."""

from __future__ import annotations

from steptwin.tables import complete
from steptwin.wbc.real import COMPARISONS, real
from steptwin.wbc.registers import Domain
from steptwin.wbc.steps import Literal, RegisterOperand, StepCondition, ValueSource

_MIRRORED = complete("comparison", COMPARISONS, "mirror image", {"=": "=", "<": ">", ">": "<", "<=": ">=", ">=": "<="})


def outcome(condition: StepCondition) -> bool | None:
    """The constant outcome of a condition, from its numbers or the range of its register; None if it varies."""
    left, sign, right = condition.left, condition.sign, condition.right
    if isinstance(left, Literal):
        if isinstance(right, Literal):
            return COMPARISONS[sign](real(left.value), real(right.value))
        left, sign, right = right, _MIRRORED[sign], left
    domain = _domain(left)
    if domain is None or not isinstance(right, Literal):
        return None
    value = real(right.value)
    if sign == "=":
        return None if domain.has(value) and not (domain.whole and value != int(value)) else False
    at_low, at_high = COMPARISONS[sign](domain.low, value), COMPARISONS[sign](domain.high, value)
    return at_low if at_low == at_high else None


def _domain(source: ValueSource) -> Domain | None:
    return source.row.reads if isinstance(source, RegisterOperand) else None
