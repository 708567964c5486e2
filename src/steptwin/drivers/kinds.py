"""The kinds of devices for which there are drivers: `DRIVERS`. Each has a folder here; no other code asks which one it has."""

from __future__ import annotations

from steptwin.drivers.kind import AnyDriverKind, DriverKind
from steptwin.drivers.m1486.kind import M1486_DRIVER
from steptwin.drivers.mic488.kind import MIC488_DRIVER
from steptwin.errors import Misuse

DRIVERS: dict[str, AnyDriverKind] = {}
"""By the name of the kind; the first is that of an address that names none. `register` adds to it."""


def register(kind: AnyDriverKind) -> None:
    """From now on, addresses may have this kind. Raises `Misuse` if a registered kind has its name or one of its options."""
    for other in DRIVERS.values():
        taken = ({kind.name} & {other.name}) | (kind.selection.options & other.selection.options)
        if taken:
            raise Misuse(f"{other.title} has {', '.join(sorted(taken))} already")
    DRIVERS[kind.name] = kind


def others_there(kind: AnyDriverKind) -> str:
    """Other things to which an address may lead where a device of this kind does not answer, as the end of a message."""
    others = [other for other in DRIVERS.values() if other is not kind and other.offers(DriverKind.clear)]
    return "".join(f". If it is {other.title}, put ',kind={other.name}' behind the address" for other in others)


register(MIC488_DRIVER)
register(M1486_DRIVER)


def clear_line(kind: AnyDriverKind, place: str, baud: int) -> None:
    """End the bytes of a kind of device on a line, so that devices of other kinds read their next command correctly."""
    for other in DRIVERS.values():
        if other is not kind:
            other.clear(place, baud)
