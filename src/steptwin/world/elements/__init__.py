"""The elements that a description may have around its controllers, in the order in which they are built. A program with an
element of its own registers it before it reads a description: `register`."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.errors import Misuse
from steptwin.world.element import AnyElement
from steptwin.world.elements.axis import AXIS
from steptwin.world.elements.brake import BRAKE
from steptwin.world.elements.button import BUTTON
from steptwin.world.elements.carriage import CARRIAGE
from steptwin.world.elements.collision import COLLISION
from steptwin.world.elements.conveyor import CONVEYOR
from steptwin.world.elements.counter import COUNTER
from steptwin.world.elements.cylinder import CYLINDER
from steptwin.world.elements.follower import FOLLOWER
from steptwin.world.elements.gantry import GANTRY
from steptwin.world.elements.gate import GATE
from steptwin.world.elements.gripper import GRIPPER
from steptwin.world.elements.latch import LATCH
from steptwin.world.elements.load import LOAD
from steptwin.world.elements.relay import RELAY
from steptwin.world.elements.shaft import SHAFT
from steptwin.world.elements.source import SOURCE
from steptwin.world.elements.supply import SUPPLY
from steptwin.world.elements.timer import TIMER
from steptwin.world.elements.tool import TOOL
from steptwin.world.elements.transducer import TRANSDUCER
from steptwin.world.elements.vacuum import VACUUM
from steptwin.world.elements.wire import WIRE
from steptwin.world.faults.kinds import KINDS, add_kinds, remove_kinds
from steptwin.world.faults.table import FaultKind

ELEMENTS: dict[str, AnyElement] = {}
"""By the names of their tables."""


def register(element: AnyElement) -> None:
    """Let descriptions have an element from now on, with its faults, which it may share with others. `Misuse` for a name that is
    taken."""
    if element.name in ELEMENTS:
        raise Misuse(f"there is an element {element.name!r} already")
    add_kinds([kind for kind in element.faults if KINDS.get(kind.name) is not kind])
    ELEMENTS[element.name] = element


def forget(element: AnyElement) -> None:
    """Undo `register`."""
    del ELEMENTS[element.name]
    remaining = [kind for other in ELEMENTS.values() for kind in other.faults]
    remove_kinds([kind for kind in element.faults if kind not in remaining])


def fault_kinds() -> Mapping[str, FaultKind]:
    """Every kind of fault by name, those of elements too."""
    return KINDS


def failing(kind: FaultKind) -> tuple[str, ...]:
    """The elements that have a kind of fault."""
    return tuple(element.name for element in ELEMENTS.values() if kind in element.faults)


for _one in (
    AXIS,
    WIRE,
    BUTTON,
    SOURCE,
    GATE,
    LATCH,
    TIMER,
    COUNTER,
    RELAY,
    CYLINDER,
    CONVEYOR,
    VACUUM,
    GRIPPER,
    BRAKE,
    SHAFT,
    FOLLOWER,
    CARRIAGE,
    TOOL,
    GANTRY,
    TRANSDUCER,
    COLLISION,
    SUPPLY,
    LOAD,
):
    register(_one)
