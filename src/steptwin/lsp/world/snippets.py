"""Snippets in descriptions of worlds: tables with the keys that they need, keys and steps with a place for the value."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

from steptwin.errors import Misuse
from steptwin.simulation.toml.reader import Key
from steptwin.simulation.toml.values import Word, flag

_TEXTS = ("x", "x.M1", "x.IN1", "x.OUT1", "x > 1", "1 s")
"""One of them is read by every key that takes text."""
_LEVELS = {"x.IN1": 1}


def table_snippet(written: str, keys: Sequence[Key]) -> str:
    """A table with the keys that it needs, each with a tab stop, and the last stop below them."""
    lines = [f"{key.name} = {value_snippet(key, number)}" for number, key in enumerate(keys, 1) if key.is_required]
    return "\n".join([written, *lines, "$0"])


@cache
def value_snippet(key: Key, stop: int) -> str:
    """A tab stop for the value of a key: between quotation marks if it takes text, with the words that it can be."""
    if isinstance(key.read, Word):
        return f'"${{{stop}|{",".join(key.read.words)}|}}"'
    if key.read is flag:
        return f"${{{stop}|true,false|}}"
    if any(_takes(key, text) for text in _TEXTS):
        return f'"${stop}"'
    return f'{{ "${stop}" = ${{{stop + 1}:1}} }}' if _takes(key, _LEVELS) else f"${stop}"


def _takes(key: Key, value: Any) -> bool:
    try:
        key.read(value)
    except (Misuse, TypeError, AttributeError):
        return False
    return True
