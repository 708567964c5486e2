"""Check of what carries what in a description: nothing carries itself, and only what has a place carries anything."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from steptwin.simulation.components.elementspec import ElementSpecs
from steptwin.simulation.components.mount import MountSpec, places
from steptwin.simulation.components.workpieces import WORKPIECES
from steptwin.simulation.toml.keypaths import Path
from steptwin.simulation.toml.reader import TomlText


class Named(Protocol):
    """A controller, a line or an element."""

    @property
    def name(self) -> str: ...
    @property
    def path(self) -> Path: ...


def check_mounts(text: TomlText, described: ElementSpecs, named: Iterable[Named]) -> None:
    """Report elements that are on what has no place, or on themselves, and what is called as all workpieces are. A name that does
    not exist is reported where what belongs together is found (`steptwin.simulation.describe.connected`)."""
    mounts = described.mounts
    placed = places(mounts)
    paths = {one.name: one.path for one in named}
    if WORKPIECES in paths and placed:
        message = f"in space {WORKPIECES!r} are all workpieces: choose another name"
        text.wrong((*paths[WORKPIECES], "name"), "D006", message)
    kinds = {name: path[0] for name, path in paths.items()}
    for name, spec in mounts.items():
        _check_keys(text, name, spec, is_placed=name in placed)
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


def _check_keys(text: TomlText, name: str, spec: MountSpec, *, is_placed: bool) -> None:
    """Report keys that mean nothing with a place in space, or without one."""
    there = next((one for one in ("on", "at", "along") if text.is_given((*spec.path, one))), None)
    for key in spec.rows.keys:
        path = (*spec.path, key.name)
        if key.in_space is None or not text.is_given(path):
            continue
        if key.in_space and not is_placed:
            text.means_nothing(path, f"{key.name} means nothing without a place in space: {name!r} has neither on nor at")
        elif not key.in_space and there is not None:
            text.wrong(path, "D007", f"{key.name} and {there} exclude each other: in space {name!r} takes what is there")
