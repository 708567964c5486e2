"""Names in a description: those that mean something already, and errors of names that mean nothing."""

from __future__ import annotations

from steptwin.errors import Misuse


class Unknown(Misuse):
    """Nothing is called ``name``."""

    def __init__(self, name: str, text: str, meant: str | None = None) -> None:
        """``meant``: what was probably meant."""
        self.name = name
        self.meant = meant
        super().__init__(text)


class UnknownSignal(Misuse):
    """Error for an existing part without a signal ``name``; ``meant``: the one that was probably meant."""

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
