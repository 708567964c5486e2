"""Breakpoints in the arguments of requests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from steptwin.dap.sources import Text
from steptwin.datatypes import format_short
from steptwin.debug.values import DataPoint, LabelPoint, LinePoint
from steptwin.errors import Misuse

_OF_LINES = {"condition": "condition", "hits": "hitCondition", "log": "logMessage"}
_OF_LABELS = {"condition": "condition", "hits": "hitCondition"}
_OF_VALUES = {"condition": "condition"}


def line_points(given: Mapping[str, Any], first_line: int, texts: Sequence[Text]) -> list[LinePoint]:
    """One in each of the texts. Raises `Misuse`, and `KeyError` and `TypeError` for a line that is missing or none."""
    more = _texts_in(given, _OF_LINES)
    line = given["line"] - first_line + 1
    return [LinePoint(controller=text.controller, text=text.text, line=line, **more) for text in texts]


def label_point(given: Mapping[str, Any]) -> LabelPoint:
    """Raises `Misuse`, and `KeyError` for a name that is missing."""
    return LabelPoint(label=_text(given, "name"), **_texts_in(given, _OF_LABELS))


def data_point(given: Mapping[str, Any]) -> DataPoint:
    """Raises `Misuse`, and `KeyError` for an id that is missing."""
    controller, _, name = _text(given, "dataId").partition("/")
    return DataPoint(controller=controller, name=name, **_texts_in(given, _OF_VALUES))


def _texts_in(given: Mapping[str, Any], names: Mapping[str, str]) -> dict[str, str]:
    """Those that are there, by our names."""
    return {ours: _text(given, theirs) for ours, theirs in names.items() if given.get(theirs)}


def _text(given: Mapping[str, Any], name: str) -> str:
    value = given[name]
    if not isinstance(value, str):
        raise Misuse(f"{name} = {format_short(value)}: expected a text")
    return value
