"""Blueprints of descriptions that this process has loaded, for those that load the same one again and again: tests, campaigns."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from steptwin.errors import Misuse
from steptwin.simulation.describe.blueprint import Blueprint

MOST_KNOWN = 8
"""The blueprints that were loaded last."""


class DescriptionKey(NamedTuple):
    """Settings that a description depends on, besides the files that it names.

    ``path``: its name in messages; ``overrides``: as text; ``services``: the tables of services that are checked
    (`steptwin.simulation.describe.servicetables`).
    """

    path: str
    text: str
    seed: int | None
    overrides: str
    services: tuple[str, ...]


_KNOWN: dict[DescriptionKey, Blueprint] = {}


def known_blueprint(key: DescriptionKey, read: Callable[[str], bytes]) -> Blueprint | None:
    """One of the same description, if the files it names have the same contents still, which ``read`` gives."""
    found = _KNOWN.get(key)
    try:
        if found is None or any(read(name) != content for name, content in found.files.items()):
            return None
    except Misuse:  # a file is gone: who reads it all again says so, with its place
        return None
    return found


def keep_blueprint(key: DescriptionKey, blueprint: Blueprint) -> None:
    """For the next who loads it."""
    while len(_KNOWN) >= MOST_KNOWN:
        _KNOWN.pop(next(iter(_KNOWN), key), None)
    _KNOWN[key] = blueprint
