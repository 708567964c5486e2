"""The twenty inputs: polarity at once, then the filter (configuration keys ``Filter`` and ``Level``).

Limits and homing see an input after polarity and before the filter (MIC-30); registers and programs see it filtered.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from steptwin.controller import MILLISECOND, Nanos
from steptwin.state import Stateful

FILTER_NS: tuple[Nanos, ...] = tuple(ms * MILLISECOND for ms in (10, 50, 100, 250, 500))


def index_input(axis: int) -> int:
    """Input number (from 0) of channel C of the encoder of ``axis`` (from 0)."""
    return 8 + 3 * axis


class InputSettings(Protocol):
    """The configuration of one input: ``filter`` 0–4, ``level`` 0 active high, 1 active low."""

    @property
    def filter(self) -> int: ...
    @property
    def level(self) -> int: ...


class Inputs(Stateful):
    """State of the inputs. Numbers count from 0.

    ``pins`` are the levels at the terminals, ``raw`` those after polarity, ``filtered`` those in registers.
    """

    FIXED = ("_settings",)
    __slots__ = (*FIXED, "_due", "_pending", "filtered", "pins", "raw")

    def __init__(self, settings: Sequence[InputSettings]) -> None:
        self._settings = settings
        self.pins = [False] * len(settings)
        self._pending: dict[int, Nanos]
        self._due: Nanos | None
        self.power_on()

    def power_on(self) -> None:
        """Terminals stay as they are, and registers show them at once."""
        self.raw = [pin != (s.level == 1) for pin, s in zip(self.pins, self._settings, strict=True)]
        self.filtered = self.raw.copy()
        self._pending = {}
        self._due = None

    def set_pin(self, number: int, high: bool, now: Nanos) -> bool:
        """A level on a terminal; True when it changed."""
        if self.pins[number] == high:
            return False
        self.pins[number] = high
        self.raw[number] = active = high != (self._settings[number].level == 1)
        if active == self.filtered[number]:
            self._pending.pop(number, None)
        else:
            self._pending[number] = now + self.filter_ns(number)
        self._due = min(self._pending.values(), default=None)
        return True

    def filter_ns(self, number: int) -> Nanos:
        """How long a level must last until registers show it."""
        return FILTER_NS[self._settings[number].filter]

    def deadline(self) -> Nanos | None:
        return self._due

    def settle(self, now: Nanos) -> list[int]:
        """Apply levels that have been stable for their filter time; returns the inputs whose filtered state changed, in order."""
        changed = sorted(n for n, due in self._pending.items() if due <= now)
        for number in changed:
            del self._pending[number]
            self.filtered[number] = self.raw[number]
        self._due = min(self._pending.values(), default=None)
        return changed
