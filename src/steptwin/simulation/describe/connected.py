"""Which controllers, lines and elements with terminals of a description share a scheduler: those that anything connects."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from steptwin.messages import Message
from steptwin.simulation.components.conveyor import CONVEYOR, USE_A_NEST
from steptwin.simulation.components.elementspec import NamedSpec, Reference
from steptwin.simulation.components.mount import MountSpec
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.describe.spec import WorldSpec
from steptwin.simulation.toml.keypaths import Path
from steptwin.simulation.toml.values import NameOf

OR_INSTEAD = Message("simulation.or-instead-hint", "{hint}; {instead}")


def connected_names(spec: WorldSpec, controllers: Iterable[str]) -> list[list[str]]:
    """The names in each scheduler. Schedulers, and names in them, are in order: controllers, lines, elements.

    Names that do not exist are reported in the text of the description.
    """
    with_terminals = [element for element in ELEMENTS.values() if element.terminals is not None]
    terminal_blocks = [one.name for element in with_terminals for one in element.named(spec.elements[element.name])]
    connected = {name: name for name in [*controllers, *(line.name for line in spec.lines), *terminal_blocks]}

    def root(name: str) -> str:
        while connected[name] != name:
            connected[name] = connected[connected[name]]
            name = connected[name]
        return name

    placed = _placed(spec)

    def owner(name: str) -> str | None:
        """Name of the one that shares its scheduler with it; None for what stands on the floor."""
        seen: set[str] = set()
        found: str | None = name
        while found is not None and found not in connected and found in placed and found not in seen:
            seen.add(found)
            found = placed[found]
        return found

    for reference in _connections(spec):
        one, other = owner(reference.one), owner(reference.other)
        if other is None:
            continue
        if other not in connected:
            _report(spec, reference.path, other, connected)
        elif one in connected:
            connected[root(other)] = root(one)
    groups: dict[str, list[str]] = {}
    for name in connected:
        groups.setdefault(root(name), []).append(name)
    return list(groups.values())


def _report(spec: WorldSpec, path: Path, name: str, connected: Iterable[str]) -> None:
    """Report a name that nothing has, with those that may stand there: of one kind of element for some keys."""
    text, element = spec.text, _element_named_by(path)
    if text.may_be_broken(name):
        return
    if path[-1] == "on":
        what, there = "no element with a place in space", list(spec.elements.mounts)
        known = there
    elif element is None:
        what, there = "nothing", list(connected)
        elements = (one.name for element in ELEMENTS.values() for one in element.named(spec.elements[element.name]))
        known = [*there, *elements]
    else:
        what = f"no {element}"
        there = known = [one.name for one in ELEMENTS[element].named(spec.elements[element])]
    meant = text.meant(name, known)
    message = f"{what} is called {name!r}{text.near(name, known)}"
    hint = f"there are {', '.join(there) or 'none'}"
    if element == CONVEYOR.name and meant is None:
        hint = OR_INSTEAD(hint=hint, instead=USE_A_NEST())
    text.wrong(path, "D009", message, hint, text.replacement(path, name, meant))


def _element_named_by(path: Path) -> str | None:
    """The kind of element that the key at ``path`` names; None for a key that names others, or anything."""
    element = ELEMENTS.get(str(path[0]))
    read = next((key.read for key in element.rows.keys if key.name == path[-1]), None) if element is not None else None
    return read.element if isinstance(read, NameOf) else None


def _placed(spec: WorldSpec) -> Mapping[str, str | None]:
    """For each element without terminals of its own the first thing that it refers to, in whose scheduler it is; None for one
    that refers to nothing."""
    return {
        one.name: next((found.one for found in element.refers(one, spec.elements)), None)
        for element in ELEMENTS.values()
        if element.terminals is None
        for one in element.named(spec.elements[element.name])
    }


def _connections(spec: WorldSpec) -> Iterator[Reference]:
    for controller in spec.controllers:
        if controller.line is not None:
            yield Reference(controller.name, controller.line, (*controller.path, "line"))
    for element in ELEMENTS.values():
        for one in spec.elements[element.name]:
            yield from element.refers(one, spec.elements)
            if isinstance(one, MountSpec) and isinstance(one, NamedSpec) and one.on is not None:
                yield Reference(one.name, one.on, (*one.path, "on"))
