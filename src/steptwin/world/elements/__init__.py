"""The elements that a description may have around its controllers, in the order in which they are built. A program with an
element of its own registers it before it reads a description: `register`."""

from __future__ import annotations

from steptwin.errors import Misuse
from steptwin.world.element import AnyElement
from steptwin.world.elements.axis import AXIS
from steptwin.world.elements.button import BUTTON
from steptwin.world.elements.source import SOURCE
from steptwin.world.elements.wire import WIRE
from steptwin.world.faults.kinds import add_kinds, remove_kinds

ELEMENTS: dict[str, AnyElement] = {}
"""By the names of their tables."""


def register(element: AnyElement) -> None:
    """Let descriptions have an element from now on, with its faults. `Misuse` for a name that is taken."""
    if element.name in ELEMENTS:
        raise Misuse(f"there is an element {element.name!r} already")
    add_kinds(element.faults)
    ELEMENTS[element.name] = element


def forget(element: AnyElement) -> None:
    """Undo `register`."""
    del ELEMENTS[element.name]
    remove_kinds(element.faults)


for _one in (AXIS, WIRE, BUTTON, SOURCE):
    register(_one)
