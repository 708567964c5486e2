"""The metrics of an edge node and its devices, and the topics of Sparkplug B."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite

from steptwin import __version__
from steptwin.datasheet import Limits
from steptwin.errors import Misuse
from steptwin.gateways.methods import METHODS, MethodRow, methods_of
from steptwin.gateways.mqtt.sparkplugcodec import SparkplugMetric, SparkplugProperty, SparkplugType, SparkplugValue
from steptwin.gateways.points import CLOCK_POINTS, GatewayPoint, PointType, points_of
from steptwin.subject.commands import Command
from steptwin.subject.contract import ControllerDescription, Description

BDSEQ, REBIRTH, RESULT, DROPPED = "bdSeq", "Node Control/Rebirth", "Commands/Result", "Store/Dropped"
TYPES: Mapping[PointType, SparkplugType] = {
    PointType.TRUTH: SparkplugType.BOOLEAN,
    PointType.WHOLE: SparkplugType.INT64,
    PointType.NUMBER: SparkplugType.DOUBLE,
    PointType.TEXT: SparkplugType.STRING,
}


@dataclass(frozen=True, slots=True)
class MetricRow:
    """A metric as the birth message describes it. ``alias`` is unique in the edge node."""

    name: str
    alias: int
    type: SparkplugType
    properties: Mapping[str, SparkplugProperty] = field(default_factory=dict)
    point: GatewayPoint | None = None
    """Whose value it has; None of one with a value of its own."""
    start: SparkplugValue = None
    """The value of one without a point."""
    command: Callable[[SparkplugValue], Command] | None = None
    """Command that a value sent to it means; raises `Misuse`. None where there is none."""

    def birth(self, value: SparkplugValue, at: int) -> SparkplugMetric:
        return SparkplugMetric(
            name=self.name, alias=self.alias, timestamp=at, type=self.type, value=value, properties=self.properties
        )

    def data(self, value: SparkplugValue, at: int, *, is_historical: bool) -> SparkplugMetric:
        """By its alias. The type is there, although it should not have to be (6.4.6): decoders such as sparkplug-payload read no
        value without it."""
        return SparkplugMetric(alias=self.alias, timestamp=at, type=self.type, value=value, is_historical=is_historical)


@dataclass(frozen=True, slots=True)
class Namespace:
    """Topics of an edge node."""

    group: str
    node: str
    host: str | None

    def __call__(self, kind: str, device: str | None = None) -> str:
        """``kind``: ``NBIRTH``, ``DDATA`` …"""
        return f"spBv1.0/{self.group}/{kind}/{self.node}" + ("" if device is None else f"/{device}")

    @property
    def state(self) -> str | None:
        """Where the primary host says whether it is online."""
        return None if self.host is None else f"spBv1.0/STATE/{self.host}"


def rows_of(description: Description, registers: Mapping[str, Iterable[str]]) -> dict[str | None, tuple[MetricRow, ...]]:
    """The metrics of the edge node, under None, and of each device."""
    found: dict[str | None, list[MetricRow]] = {None: []}
    numbers = iter(range(1, 1 << 62))
    for name, kind, start in (
        (REBIRTH, SparkplugType.BOOLEAN, False),
        (DROPPED, SparkplugType.INT64, 0),
        ("Properties/Software", SparkplugType.STRING, f"steptwin {__version__}"),
        ("Properties/Name", SparkplugType.STRING, description.name),
    ):
        found[None].append(MetricRow(name, next(numbers), kind, start=start))
    if "time" in description.commands:
        found[None] += [_of_point(point, next(numbers), f"Time/{point.name}") for point in CLOCK_POINTS]
    for part in description.controllers:
        points = points_of(part, description, registers.get(part.name, ()))
        rows = found[part.name] = [_of_point(point, next(numbers), "/".join(point.path)) for point in points]
        sheet = part.datasheet
        for name, text in (("Kind", sheet.kind), ("Title", sheet.title), ("Variant", sheet.variant)):
            rows.append(MetricRow(f"Properties/{name}", next(numbers), SparkplugType.STRING, start=text))
        rows += [_of_method(one, next(numbers)) for one in _methods(part)]
        rows.append(MetricRow(RESULT, next(numbers), SparkplugType.STRING, start=""))
    return {device: tuple(rows) for device, rows in found.items()}


def _of_point(point: GatewayPoint, alias: int, name: str) -> MetricRow:
    properties = {"Documentation": SparkplugProperty(SparkplugType.STRING, point.meaning)}
    properties["readOnly"] = SparkplugProperty(SparkplugType.BOOLEAN, point.write is None)
    if point.unit:
        properties["engUnit"] = SparkplugProperty(SparkplugType.STRING, point.unit)
    if point.limits is not None and point.limits.low is not None and point.limits.high is not None:
        properties["engLow"] = SparkplugProperty(SparkplugType.DOUBLE, float(point.limits.low))
        properties["engHigh"] = SparkplugProperty(SparkplugType.DOUBLE, float(point.limits.high))
    write = point.write

    def command(value: SparkplugValue) -> Command:
        if write is None:
            raise AssertionError
        return write(_number(value, point.type, point.limits))

    return MetricRow(name, alias, TYPES[point.type], properties, point, command=None if write is None else command)


@dataclass(frozen=True, slots=True)
class _BoundMethod:
    path: str
    row: MethodRow
    part: ControllerDescription
    axis: int | None


def _methods(part: ControllerDescription) -> Iterator[_BoundMethod]:
    """Those with one argument at most: a jog has a lease besides, which no metric carries."""
    places = [("", "Controller", None), ("program/", "Program", None)]
    places += [(f"{axis.name}/", "Axis", axis.number) for axis in part.datasheet.axes]
    for path, kind, axis in places:
        for row in methods_of(part, METHODS[kind], axis):
            if len(row.arguments) <= 1:
                yield _BoundMethod(f"{path}Commands/{row.name}", row, part, axis)


def _of_method(one: _BoundMethod, alias: int) -> MetricRow:
    row = one.row
    argument = row.arguments[0] if row.arguments else None
    unit, limits = "", None
    if argument is not None:
        taken = next(each for each in one.part.takes if (each.command, each.axis) == (row.command, one.axis))
        found = next(each for each in taken.arguments if each.name == argument.of)
        unit, limits = found.unit, found.limits
    kind = PointType.TRUTH if argument is None else argument.type
    properties = {"Documentation": SparkplugProperty(SparkplugType.STRING, row.meaning)}
    if unit:
        properties["engUnit"] = SparkplugProperty(SparkplugType.STRING, unit)

    def command(value: SparkplugValue) -> Command:
        number = _number(value, kind, limits)
        if argument is None:
            if not number:
                raise Misuse("false does nothing: write true")
            return row.make(one.part.name, one.axis)
        return row.make(one.part.name, one.axis, number)

    start = False if argument is None else None
    return MetricRow(one.path, alias, TYPES[kind], properties, start=start, command=command)


def _number(value: SparkplugValue, kind: PointType, limits: Limits | None) -> float:
    if kind is PointType.TRUTH:
        if value not in (0, 1) or isinstance(value, str | bytes):
            raise Misuse(f"{value!r}: expected true or false")
        return float(value or 0)
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        raise Misuse(f"{value!r}: expected a number")
    low = None if limits is None else limits.low
    high = None if limits is None else limits.high
    if (low is not None and value < low) or (high is not None and value > high):
        raise Misuse(f"{value!r}: permitted are numbers {_range(low, high)}")
    return float(value)


def _range(low: float | None, high: float | None) -> str:
    """At least one end is known."""
    if low is None:
        return f"up to {high}"
    return f"from {low}" if high is None else f"from {low} to {high}"
