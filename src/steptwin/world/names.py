"""Names in a description: what conditions, scripts and commands address by the same kind of name must differ."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.world.element import NamedSpec
    from steptwin.world.spec import WorldSpec


class Unknown(Misuse):
    """Nothing is called ``name``."""

    def __init__(self, name: str, text: str, meant: str | None = None) -> None:
        """``meant``: what was probably meant."""
        self.name = name
        self.meant = meant
        super().__init__(text)


class UnknownSignal(Misuse):
    """What is there has no signal ``name``; ``meant``: the one that was probably meant."""

    def __init__(self, name: str, text: str, meant: str | None) -> None:
        self.name = name
        self.meant = meant
        super().__init__(text)


class WrongTerminal(Misuse):
    """``name`` is no terminal of the kind that is needed; ``meant``: the one that was probably meant."""

    def __init__(self, name: str, text: str, meant: str | None) -> None:
        self.name = name
        self.meant = meant
        super().__init__(text)


RESERVED = {
    "time": "a signal",
    "idle": "a signal",
    "world": "what events of the whole world are recorded under",
    "and": "a word of conditions",
    "or": "a word of conditions",
    "not": "a word of conditions",
}
"""Names that mean something already."""


def check_names(spec: WorldSpec, elements: Iterable[NamedSpec]) -> None:
    """Report names of lines, machines and elements that hide each other. The command line ignores case."""
    text = spec.text
    taken: dict[str, str] = {}
    for one in (*spec.lines, *spec.controllers, *elements):
        path = (*one.path, "name")
        kind = one.path[0]
        key = one.name.lower()
        owner = f"[[{kind}]] {one.name!r}"
        if key in RESERVED:
            text.wrong(path, "D006", f"{one.name!r} is {RESERVED[key]}: choose another name")
        elif key in taken and taken[key] != owner:  # this one is reported already
            text.wrong(path, "D006", f"{one.name!r} is taken by {taken[key]}", "upper and lower case are the same here")
        taken.setdefault(key, owner)
