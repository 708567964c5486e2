"""Tables whose rows need a behaviour elsewhere: a row without one, or one without a row, is refused at import."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import TypeVar

RowKey = TypeVar("RowKey")
Behaviour = TypeVar("Behaviour")


class IncompleteTable(Exception):
    """A row lacks its behaviour, or a behaviour its row; the text names both tables and the row."""


def complete(row: str, keys: Iterable[RowKey], behaviour: str, given: Mapping[RowKey, Behaviour]) -> Mapping[RowKey, Behaviour]:
    """``given``, read-only, when it has exactly ``keys``; else `IncompleteTable`.

    ``row`` and ``behaviour`` are the terms for one row and one behaviour in the message: ``statement SWAP lacks its step``.
    """
    known = list(keys)
    lacking = [key for key in known if key not in given]
    if lacking:
        raise IncompleteTable(f"{row} {', '.join(map(name, lacking))} lacks its {behaviour}")
    left_over = [key for key in given if key not in known]
    if left_over:
        raise IncompleteTable(f"{behaviour} of {', '.join(map(name, left_over))}: there is no such {row}")
    return MappingProxyType(dict(given))


def name(key: object) -> str:
    return key.__name__ if isinstance(key, type) else str(key)
