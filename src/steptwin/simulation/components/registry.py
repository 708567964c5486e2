"""The elements that a description may have around its controllers, in the order in which they are built. A program with an
element of its own registers it before it reads a description: `register`."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.errors import Misuse
from steptwin.simulation.components.axis import AXIS
from steptwin.simulation.components.beam import BEAM
from steptwin.simulation.components.body import BODY
from steptwin.simulation.components.brake import BRAKE
from steptwin.simulation.components.button import BUTTON
from steptwin.simulation.components.carriage import CARRIAGE
from steptwin.simulation.components.collision import COLLISION
from steptwin.simulation.components.conveyor import CONVEYOR
from steptwin.simulation.components.counter import COUNTER
from steptwin.simulation.components.cylinder import CYLINDER
from steptwin.simulation.components.dcmotor import DCMOTOR
from steptwin.simulation.components.element import AnyElement
from steptwin.simulation.components.follower import FOLLOWER
from steptwin.simulation.components.gantry import GANTRY
from steptwin.simulation.components.gate import GATE
from steptwin.simulation.components.gripper import GRIPPER
from steptwin.simulation.components.integrator import INTEGRATOR
from steptwin.simulation.components.latch import LATCH
from steptwin.simulation.components.load import LOAD
from steptwin.simulation.components.nest import NEST
from steptwin.simulation.components.relay import RELAY
from steptwin.simulation.components.shaft import SHAFT
from steptwin.simulation.components.source import SOURCE
from steptwin.simulation.components.supply import SUPPLY
from steptwin.simulation.components.timer import TIMER
from steptwin.simulation.components.tool import TOOL
from steptwin.simulation.components.transducer import TRANSDUCER
from steptwin.simulation.components.vacuum import VACUUM
from steptwin.simulation.components.wire import WIRE
from steptwin.simulation.faults.kinds import KINDS, add_kinds, remove_kinds
from steptwin.simulation.faults.table import FaultKind

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
    DCMOTOR,
    INTEGRATOR,
    BRAKE,
    SHAFT,
    FOLLOWER,
    CARRIAGE,
    TOOL,
    GANTRY,
    TRANSDUCER,
    NEST,
    VACUUM,
    GRIPPER,
    BODY,
    BEAM,
    COLLISION,
    SUPPLY,
    LOAD,
):
    register(_one)
