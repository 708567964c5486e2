"""Check of what carries what in a description: nothing carries itself, and only what has a place carries anything."""

from __future__ import annotations

from collections.abc import Iterable

from steptwin.simulation.components.elementspec import ElementSpecs, NamedSpec
from steptwin.simulation.toml.reader import TomlText


def check_mounts(text: TomlText, described: ElementSpecs, named: Iterable[NamedSpec]) -> None:
    """Report elements that are on what has no place, or on themselves. A name that does not exist is reported where what belongs
    together is found (`steptwin.simulation.describe.connected`)."""
    mounts = described.mounts
    kinds = {one.name: one.path[0] for one in named}
    for name, spec in mounts.items():
        if spec.on is None:
            continue
        path = (*spec.path, "on")
        if spec.on in kinds and spec.on not in mounts:
            text.wrong(path, "D007", f"on = {spec.on!r}: a [[{kinds[spec.on]}]] has no place in space, and carries nothing")
            continue
        way = [name]
        while (on := mounts[way[-1]].on if way[-1] in mounts else None) is not None and on not in way:
            way.append(on)
        if on == name:
            text.wrong(path, "D007", f"on = {spec.on!r}: {' is on '.join(map(repr, [*way, name]))}")
