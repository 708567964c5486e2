"""A machine in space in a run: what it is made of, and where that was when; as JSON for the page and in lines of a trace."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from steptwin.controller import Nanos
from steptwin.datatypes import fitting
from steptwin.durations import LONGEST_NS
from steptwin.files.scene.cubics import Cubic
from steptwin.jsonvalues import read, to_json
from steptwin.subject.contract import Description, ElementDescription, MechanicsDescription
from steptwin.subject.scene import SceneDescription, WorkpieceState

_IN_A_LINE = 10_000
"""Numbers in a line of a trace."""


@dataclass(frozen=True, slots=True)
class Machine:
    """The part of a subject that is drawn."""

    name: str
    scene: SceneDescription
    elements: tuple[ElementDescription, ...]
    axes: tuple[MechanicsDescription, ...]


def machine_of(description: Description) -> Machine:
    return Machine(description.name, description.scene, description.elements, description.axes)


class Stint(NamedTuple):
    """Where a workpiece is from a moment on; None: it is not there."""

    begin: Nanos
    place: WorkpieceState | None


@dataclass(slots=True)
class RecordedScene:
    """Moments are those of the run."""

    machine: Machine
    motions: dict[str, list[Cubic]] = field(default_factory=dict)
    """By signals, in their units."""
    levels: dict[str, list[tuple[Nanos, float]]] = field(default_factory=dict)
    """By pins of controllers and terminals of elements."""
    workpieces: dict[str, list[Stint]] = field(default_factory=dict)

    def value(self, signal: str, now: Nanos) -> float | None:
        """The value of a motion; None before it was known."""
        spans = self.motions.get(signal, [])
        n = bisect_right(spans, now, key=lambda span: span.begin) - 1
        return spans[n].at(now) if n >= 0 else None

    def to_json(self) -> dict[str, object]:
        """For the page: numbers of spans and levels one after the other."""
        return {
            "machine": to_json(self.machine),
            "motions": {name: _flat(spans) for name, spans in self.motions.items()},
            "levels": {name: _flat(changes) for name, changes in self.levels.items()},
            "workpieces": [_stints(stints) for stints in self.workpieces.values()],
        }

    def lines(self) -> Iterator[dict[str, object]]:
        """Lines of a trace, of which the first has the machine."""
        yield {"scene": to_json(self.machine)}
        for kind, all_of_them in (("motion", self.motions), ("level", self.levels)):
            for name, rows in all_of_them.items():
                numbers = _flat(rows)
                for n in range(0, len(numbers), _IN_A_LINE):
                    yield {"scene": kind, "of": name, "numbers": numbers[n : n + _IN_A_LINE]}
        for name, stints in self.workpieces.items():
            yield {"scene": "workpiece", "of": name, "stints": _stints(stints)}

    def add_line(self, data: Mapping[str, Any]) -> None:
        """Add what a line after the first has. Raises `TypeError`, `ValueError` or `LookupError` for what is none."""
        kind, name = data["scene"], fitting("of", data["of"], str)
        if kind == "workpiece":
            found = self.workpieces.setdefault(name, [])
            found += (Stint(_moment(at), None if place is None else read(WorkpieceState, place)) for at, place in data["stints"])
            return
        numbers = [fitting("numbers", one, int | float) for one in data["numbers"]]
        if kind == "motion":
            rows = zip(*[iter(numbers)] * len(Cubic._fields), strict=True)
            self.motions.setdefault(name, []).extend(Cubic(_moment(begin), *map(float, more)) for begin, *more in rows)
        elif kind == "level":
            pairs = zip(*[iter(numbers)] * 2, strict=True)
            self.levels.setdefault(name, []).extend((_moment(at), float(level)) for at, level in pairs)
        else:
            raise ValueError("scene")


def read_scene(data: Any) -> RecordedScene:
    """The scene that a first line begins. Raises `TypeError`, `ValueError` or `LookupError` for what is none."""
    return RecordedScene(read(Machine, data))


def _moment(value: object) -> Nanos:
    moment = fitting("moment", value, int)
    if not 0 <= moment <= LONGEST_NS:
        raise ValueError("moment")
    return moment


def _stints(stints: list[Stint]) -> list[object]:
    return [[begin, None if place is None else to_json(place)] for begin, place in stints]


def _flat(rows: Any) -> list[int | float]:
    """Whole numbers without a point, others with 12 digits."""
    return [number if isinstance(number, int) else _short(number) for row in rows for number in row]


def _short(number: float) -> int | float:
    rounded = float(f"{number:.12g}")
    return int(rounded) if rounded.is_integer() and abs(rounded) < 1e15 else rounded
