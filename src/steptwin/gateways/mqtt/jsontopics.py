"""Topics and payloads of the JSON face; docs/gateways/mqtt.md lists them.

``BASE/CONTROLLER`` and ``BASE/CONTROLLER/GROUP`` have the values of a controller by name. BASE is the ``topic`` of the gateway's
table and the name of the subject.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from itertools import compress, count
from math import isfinite
from operator import ne
from pathlib import PurePath
from typing import Any

from steptwin.errors import Misuse
from steptwin.gateways.points import CLOCK, CLOCK_POINTS, GatewayPoint, PointValue, points_of, values_of
from steptwin.gateways.sampling import Sample
from steptwin.subject.contract import Description

ONLINE, INSTANCE, DESCRIPTION, EVENTS, DO, ANSWER = "online", "instance", "description", "events", "do", "answer"
UNNAMED = ("world", "devices")
"""Names of worlds and device files that have been given none."""
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

    def names(self, controller: str) -> list[str]:
        names = [point.path[-1] for point in self.points]
        return names if self.name or controller == CLOCK else [*names, ANSWERS]


class GroupText:
    """The values of a group that were published last, as JSON: a change of one makes one of them anew."""

    __slots__ = ("_has_answers", "_names", "_read", "_texts", "_typed", "_values", "part", "part_of", "topic")

    def __init__(self, group: Group, controller: str) -> None:
        self.topic = group.topic
        self.part_of = group.points[0].part
        """The part of a state that has its values: the same object in two states between which nothing has changed."""
        self.part: object = None
        """That of what was published last; None where the controller did not answer."""
        names = group.names(controller)
        self._has_answers = len(names) > len(group.points)
        self._read = values_of(group.points)
        self._typed = [*(point.typed for point in group.points), bool]
        """Types of the values; the last one is that of `ANSWERS`."""
        self._names = [encode(name).decode() for name in names]
        self._values: tuple[PointValue, ...] = ()
        self._texts: list[str] = []

    def changed(self, part: object, moment: datetime) -> bytes | None:
        """The group with a `part` of a ``moment``, None where the controller does not answer: then all values are unknown. None
        where they are as before."""
        self.part = part
        values = (None,) * (len(self._typed) - 1) if part is None else self._read(part)
        if self._has_answers:
            values = (*values, part is not None)
        before = self._values
        if values == before:
            return None
        self._values = values
        if before:
            changed: Iterable[int] = compress(count(), map(ne, values, before))
        else:
            self._texts, changed = [""] * len(values), range(len(values))
        for number in changed:
            self._texts[number] = f"{self._names[number]}:{_text(self._typed[number](values[number]))}"
        at = moment.isoformat(timespec="milliseconds").replace("+00:00", "Z")
        return f'{{{",".join(self._texts)},"{AT}":"{at}"}}'.encode()


class ControllerText:
    """All groups of a controller, as they were published last."""

    def __init__(self, groups: Iterable[Group], controller: str) -> None:
        self._groups = [GroupText(group, controller) for group in groups]

    def changed(self, sample: Sample) -> Iterator[tuple[str, bytes]]:
        """Topics and payloads of the groups that are not as before."""
        state = sample.state
        for group in self._groups:
            part = None if state is None else group.part_of(state)
            if part is None or part is not group.part:
                payload = group.changed(part, sample.at)
                if payload is not None:
                    yield group.topic, payload


class Topics:
    """Those of a subject. Raises `Misuse` for a controller whose name is a topic already."""

    def __init__(self, beginning: str, file: str, description: Description, registers: Mapping[str, Iterable[str]]) -> None:
        name = PurePath(file).stem if description.name in UNNAMED and file else description.name
        self.name = "".join("_" if sign in "+#/" else sign for sign in name)
        self.base = f"{beginning}/{self.name}"
        self._description = description
        self.groups: dict[str, tuple[Group, ...]] = {}
        for part in description.controllers:
            if part.name in OWN:
                raise Misuse(f"[gateway.mqtt]: {self.base}/{part.name} is not a topic for a controller: rename the controller")
            points = points_of(part, description, registers.get(part.name, ()))
            self.groups[part.name] = tuple(_groups(f"{self.base}/{part.name}", points))
        if "time" in description.commands:
            self.groups[CLOCK] = (Group(f"{self.base}/{CLOCK}", "", CLOCK_POINTS),)

    def __call__(self, own: str) -> str:
        """``BASE/own``."""
        return f"{self.base}/{own}"

    def describe(self, commands: Iterable[str]) -> dict[str, object]:
        """Description of the values: units and meanings, once."""
        controllers = [
            {
                "name": part.name,
                "kind": part.datasheet.kind,
                "title": part.datasheet.title,
                "variant": part.datasheet.variant,
                "real": part.is_real,
                "topics": {group.topic: _described(group) for group in self.groups[part.name]},
            }
            for part in self._description.controllers
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


def _text(value: Any) -> str:
    """As JSON. Most are numbers, which go through the encoder at four times the cost."""
    return float.__repr__(value) if type(value) is float and isfinite(value) else _ENCODER.encode(value)


def encode(value: Any) -> bytes:
    return _text(value).encode()
