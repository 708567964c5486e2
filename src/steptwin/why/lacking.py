"""Things that decide an answer and were before what is noted: so they are looked for, and it is asked again."""

from __future__ import annotations

from typing import NamedTuple

from steptwin.controller import Nanos


class Found(NamedTuple):
    """``since``: the last change, None if there was none since ``known_from``."""

    since: Nanos | None
    known_from: Nanos


NEVER = Found(None, 0)
HAPPENED, EXECUTED = "happened: ", "executed: "
"""Before what is no signal and no condition."""


class Lacking:
    """Notes what lacks while a question is answered, and knows what was found of it."""

    def __init__(self) -> None:
        self.begins: set[Nanos] = set()
        """Beginnings of the logs before which something else decides."""
        self.moments: set[Nanos] = set()
        """Those about which nothing is noted."""
        self.changes: dict[str, Nanos] = {}
        """Signals and conditions, with the moment before which their last change is not known."""
        self._found: dict[str, list[tuple[Nanos, Found]]] = {}

    def begin(self) -> None:
        """The question is asked, the first time or again."""
        self.begins.clear()
        self.moments.clear()
        self.changes.clear()

    def everything(self, begin: Nanos) -> set[Nanos]:
        """Moments before which something lacks. ``begin``: of what is noted."""
        return self.begins | set(self.changes.values()) | ({begin} if self.moments else set())

    def lack(self, begin: Nanos) -> None:
        """Something before the beginning of a log decides."""
        self.begins.add(begin)

    def change(self, asked: str, moment: Nanos) -> Found:
        """The last change of a signal or condition before a moment; none since then, if that is not known."""
        for until, found in self._found.get(asked, ()):
            if moment <= until and (found.since is None or found.since <= moment):
                return found
        self.changes[asked] = max(moment, self.changes.get(asked, 0))
        return Found(None, moment)

    def learn(self, asked: str, moment: Nanos, found: Found) -> None:
        """The last change before a moment was found."""
        self._found.setdefault(asked, []).append((moment, found))

    def forget(self) -> None:
        """The past is another one."""
        self._found.clear()
