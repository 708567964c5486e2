"""Values that follow from a description and its files alone, for all worlds that are built from it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from steptwin.simulation.toml.keypaths import Path

T = TypeVar("T")


class BuildMemo:
    """Values that the first world of a description has computed."""

    def __init__(self) -> None:
        self.is_checked = False
        """Whether a world was built without an error: then no other has one, and checks can be left out."""
        self._known: dict[Path, Any] = {}

    def once(self, path: Path, make: Callable[[], T]) -> T:
        """Result of ``make``, which is called in the first world only. ``path``: a place in the description, or one beyond it.

        The value must follow from the description and its files, and nothing may change it.
        """
        found = self._known.get(path)
        if found is None:
            found = self._known[path] = make()
        return cast("T", found)
