"""Every kind of fault: command line, files, their schema and the reference page are read from this table. A new kind is a row
with its effect in the file of its layer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from steptwin.simulation.faults.effects import checked
from steptwin.simulation.faults.kinds_bytes import BYTES
from steptwin.simulation.faults.kinds_frames import FRAMES
from steptwin.simulation.faults.kinds_physics import PHYSICS
from steptwin.simulation.faults.table import WHEN, WHERE, FaultKind, Layer, Occasion, Parameter

KINDS = checked((*BYTES, *FRAMES, *PHYSICS))


def add_kinds(kinds: Sequence[FaultKind]) -> None:
    """Faults of an element that descriptions may have from now on. Raises as `checked`."""
    KINDS.update(checked((*KINDS.values(), *kinds)))


def remove_kinds(kinds: Sequence[FaultKind]) -> None:
    """Undo `add_kinds`."""
    for kind in kinds:
        del KINDS[kind.name]


def rows(*layers: Layer) -> Iterator[FaultKind]:
    """The kinds of these layers, of all without any."""
    return (kind for kind in KINDS.values() if not layers or kind.layer in layers)


def shared() -> list[tuple[Parameter, str]]:
    """Common parameters of kinds: each parameter, and the layers or occasions that have it."""
    found: dict[Parameter, list[str]] = {}
    layers = {kind.layer for kind in KINDS.values()}
    for layer, where in WHERE.items():
        for parameter in where if layer in layers else ():
            found.setdefault(parameter, []).append(layer.value)
    lasting = [kind.name for kind in KINDS.values() if kind.occasion is Occasion.ALWAYS]
    for occasion, when in WHEN.items():
        for parameter in when:
            found.setdefault(parameter, []).append(
                f"each {occasion.value}" if occasion is not Occasion.ALWAYS else ", ".join(lasting)
            )
    return [(parameter, ", ".join(of)) for parameter, of in found.items()]
