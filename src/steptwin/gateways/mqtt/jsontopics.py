"""Topics and payloads of the JSON face; docs/gateways.md lists them.

``BASE/CONTROLLER`` and ``BASE/CONTROLLER/GROUP`` have the values of a controller by name. BASE is the ``topic`` of the gateway's
table and the name of the subject.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

from steptwin.errors import Misuse
from steptwin.gateways.points import CLOCK, CLOCK_POINTS, GatewayPoint, PointValue, points_of
from steptwin.gateways.sampling import Sample
from steptwin.subject.contract import Description
from steptwin.world.gateways import UNNAMED

ONLINE, INSTANCE, DESCRIPTION, EVENTS, DO, ANSWER = "online", "instance", "description", "events", "do", "answer"
OWN = (ONLINE, INSTANCE, DESCRIPTION, EVENTS, DO, ANSWER, CLOCK)
"""Topics below BASE that are not controllers."""
ANSWERS, AT = "answers", "at"
"""Members beside the values: whether the controller answers, and when the values were so."""
GROUP_MEANINGS: Mapping[str, str] = {
    "": "the controller",
    "program": "its program",
    "pins": "levels of pins: true and false, volts",
    "details": "what only this kind of controller has",
    "registers": "points that the description of the gateway names",
}


@dataclass(frozen=True, slots=True)
class Group:
    """Values that are published together. ``name``: below the controller, empty for itself."""

    topic: str
    name: str
    points: tuple[GatewayPoint, ...]

    def part(self, sample: Sample) -> object:
        """What its values are taken from: the same object in two samples between which nothing has changed in it."""
        return None if sample.state is None else self.points[0].part(sample.state)

    def names(self, machine: str) -> list[str]:
        names = [point.path[-1] for point in self.points]
        return names if self.name or machine == CLOCK else [*names, ANSWERS]

    def values(self, sample: Sample) -> list[PointValue]:
        """In the order of `names`, not of their types yet; all unknown where the controller does not answer."""
        part = self.part(sample)
        found: list[PointValue] = [None if part is None else point.of(part) for point in self.points]
        if not self.name and sample.machine != CLOCK:
            found.append(sample.state is not None)
        return found


class GroupText:
    """The values of a group that were published last, as JSON: a change of one makes one of them anew."""

    def __init__(self, group: Group, machine: str) -> None:
        self._group = group
        self._part_of = group.points[0].part
        self._typed = [*(point.typed for point in group.points), bool]
        """What gives each value its type; the last one that of `ANSWERS`."""
        self._names = [encode(name).decode() for name in group.names(machine)]
        self._part: object = None
        self._values: list[PointValue] = []
        self._texts: list[str] = []

    def changed(self, sample: Sample) -> bytes | None:
        """The group with the moment of ``sample``; None where it is as before."""
        part = None if sample.state is None else self._part_of(sample.state)
        if part is not None and part is self._part:
            return None
        self._part = part
        values, before = self._group.values(sample), self._values
        if values == before:
            return None
        self._values = values
        if not before:
            self._texts = [""] * len(values)
        for number, new in enumerate(values):
            if not before or before[number] != new:
                self._texts[number] = f"{self._names[number]}:{_text(self._typed[number](new))}"
        at = sample.at.isoformat(timespec="milliseconds").replace("+00:00", "Z")
        return f'{{{",".join(self._texts)},"{AT}":"{at}"}}'.encode()


class Topics:
    """Those of a subject. Raises `Misuse` for a controller whose name is a topic already."""

    def __init__(self, beginning: str, file: str, description: Description, registers: Mapping[str, Iterable[str]]) -> None:
        name = PurePath(file).stem if description.name in UNNAMED and file else description.name
        self.name = "".join("_" if sign in "+#/" else sign for sign in name)
        self.base = f"{beginning}/{self.name}"
        self._description = description
        self.groups: dict[str, tuple[Group, ...]] = {}
        for part in description.machines:
            if part.name in OWN:
                raise Misuse(f"[gateway.mqtt]: {self.base}/{part.name} is no topic for a controller: call it otherwise")
            points = points_of(part, description, registers.get(part.name, ()))
            self.groups[part.name] = tuple(_groups(f"{self.base}/{part.name}", points))
        if "time" in description.commands:
            self.groups[CLOCK] = (Group(f"{self.base}/{CLOCK}", "", CLOCK_POINTS),)

    def __call__(self, own: str) -> str:
        """``BASE/own``."""
        return f"{self.base}/{own}"

    def describe(self, commands: Iterable[str]) -> dict[str, object]:
        """What there is: units and meanings, once."""
        controllers = [
            {
                "name": part.name,
                "kind": part.datasheet.kind,
                "title": part.datasheet.title,
                "variant": part.datasheet.variant,
                "real": part.is_real,
                "topics": {group.topic: _described(group) for group in self.groups[part.name]},
            }
            for part in self._description.machines
        ]
        return {
            "name": self.name,
            "controllers": controllers,
            "time": {group.topic: _described(group) for group in self.groups.get(CLOCK, ())},
            "commands": {"topic": self(DO), "answers": self(ANSWER), "names": list(commands)},
            "events": self(EVENTS),
            "online": self(ONLINE),
        }


def _groups(topic: str, points: Iterable[GatewayPoint]) -> Iterable[Group]:
    found: dict[str, list[GatewayPoint]] = {}
    for point in points:
        found.setdefault(point.group, []).append(point)
    for name, members in found.items():
        yield Group(f"{topic}/{name}" if name else topic, name, tuple(members))


def _described(group: Group) -> dict[str, object]:
    values: dict[str, dict[str, object]] = {}
    for point in group.points:
        one: dict[str, object] = {"type": point.type.value, "meaning": point.meaning}
        if point.unit:
            one["unit"] = point.unit
        if point.limits is not None:
            one |= {"low": point.limits.low, "high": point.limits.high}
        if point.write is not None:
            one["written"] = True
        values[point.path[-1]] = one
    return {"meaning": GROUP_MEANINGS.get(group.name, "an axis"), "values": values}


_ENCODER = json.JSONEncoder(ensure_ascii=False, separators=(",", ":"))


_text = _ENCODER.encode


def encode(value: Any) -> bytes:
    return _text(value).encode()
