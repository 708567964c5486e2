"""``[[shaft]]``: a shaft that an axis turns through a gear, with cams that actuate contacts in every revolution."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from math import floor
from typing import Any

from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.world.contacts import Zone
from steptwin.world.drawing import DIAL, Drawing, SensorZone
from steptwin.world.element import Element, NamedSpec, Reference, Row, Table
from steptwin.world.elements.axis import AXIS, BuiltAxis, find_axis, turns_of_axis
from steptwin.world.elements.contact import CONTACT_KEYS
from steptwin.world.elements.switch import lane_of, put_switch
from steptwin.world.reader import Key, TomlText, optional, read_table
from steptwin.world.sense import TableRows, check_sense
from steptwin.world.signals import SignalOf
from steptwin.world.site import Site, Terminal
from steptwin.world.spec import WorldSpec
from steptwin.world.tomlplaces import Path
from steptwin.world.values import INPUT_PIN, NameOf, name_value, number

TURN = 360


@dataclass(frozen=True, slots=True, kw_only=True)
class CamSpec:
    """On from ``begin`` to ``end`` degrees of the shaft; through 0 where the end is not above the beginning."""

    begin: float
    end: float
    target: Terminal
    contact: str
    join: str | None
    bounce: Nanos
    bounces: int
    path: Path = ()

    @property
    def zone(self) -> SensorZone:
        """Where it is on, as it is drawn."""
        return SensorZone(self.target, self.begin, self.end if self.end > self.begin else self.end + TURN)


CAM = TableRows(
    written="[[shaft.cam]]",
    keys=(
        Key("from", number(0.0, 360.0), "degrees, from which it is on", attribute="begin"),
        Key("until", number(0.0, 360.0), "degrees, to which it is on; below from: through 0", attribute="end"),
        Key("to", INPUT_PIN, "the input: MACHINE.PIN", attribute="target"),
        *CONTACT_KEYS,
    ),
    need={"bounces": "bounce"},
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ShaftSpec(NamedSpec):
    axis: str
    ratio: float
    offset: float
    cams: tuple[CamSpec, ...]


@dataclass(frozen=True, slots=True)
class GearedShaft:
    spec: ShaftSpec
    axis: BuiltAxis

    @property
    def pulses_per_turn(self) -> Fraction:
        """Of the axis; negative where the shaft turns backwards."""
        return self.axis.scale.pulses_per_unit / Fraction(str(self.spec.ratio))

    def place(self, degrees: float) -> Fraction:
        """The place of the axis at an angle of the first turn."""
        return (Fraction(str(degrees)) - Fraction(str(self.spec.offset))) / TURN * self.pulses_per_turn

    def angle(self, now: Nanos) -> float:
        """Degrees, more than 360 after more than a turn."""
        return float(self.axis.mechanism.place(now) / self.pulses_per_turn * TURN + Fraction(str(self.spec.offset)))

    def zone(self, cam: CamSpec) -> Zone:
        """Where the axis is while a cam is on."""
        end = cam.end if cam.end > cam.begin else cam.end + TURN
        low, high = sorted((self.place(cam.begin), self.place(end)))
        half = Fraction(1, 2)
        return Zone(floor(low + half), floor(high + half), 0, abs(self.pulses_per_turn))


def _read(text: TomlText, row: Row, table: Table) -> ShaftSpec:
    return ShaftSpec(**row, cams=tuple(_read_cams(text, row["path"], table)))


def _read_cams(text: TomlText, path: Path, table: Table) -> Iterator[CamSpec]:
    given = table.get("cam", [])
    for n, cam in enumerate(given if isinstance(given, list) else [given]):
        of_cam = (*path, "cam", n)
        values = read_table(text, of_cam, cam, CAM.keys)
        if {"begin", "end", "target"} <= set(values):
            check_sense(text, of_cam, CAM, cam)
            if values["begin"] == values["end"]:
                text.wrong((*of_cam, "until"), "D007", f"from and until are {values['end']:g} degrees: the cam has no width")
            yield CamSpec(**values, path=of_cam)


def _refers(spec: ShaftSpec, world: WorldSpec) -> Iterator[Reference]:
    drives = {axis.name: axis.drive[0] for axis in world.elements_of(AXIS)}
    machine = drives.get(spec.axis, spec.axis)
    yield Reference(machine, machine, (*spec.path, "axis"))
    for cam in spec.cams:
        yield Reference(machine, cam.target[0], (*cam.path, "to"))


def _build(spec: ShaftSpec, site: Site) -> GearedShaft:
    shaft = GearedShaft(spec, find_axis(spec.axis, site))
    for n, cam in enumerate(spec.cams, start=1):
        site.unless_wrong(cam.path, partial(_put_cam, shaft, cam, lane_of(spec.name, n), site))
    return shaft


def _put_cam(shaft: GearedShaft, cam: CamSpec, lane: str, site: Site) -> None:
    mechanism = shaft.axis.mechanism
    put_switch(shaft.axis.kernel, mechanism, mechanism.machine, shaft.zone(cam), cam, lane, site)


def _signals(shaft: GearedShaft) -> Mapping[str, SignalOf]:
    turning = partial(turns_of_axis, shaft.axis)
    return {"angle": SignalOf((shaft.axis.source,), shaft.angle, turning, shaft.axis.mechanism.version, "degree")}


def _ratio(value: Any) -> float:
    found = number()(value)
    if found == 0.0:
        raise Misuse(f"{value!r}: permitted are numbers other than 0")
    return found


SHAFT: Element[ShaftSpec, GearedShaft] = Element(
    name="shaft",
    spec=ShaftSpec,
    rows=TableRows(
        written="[[shaft]]",
        keys=(
            Key("name", name_value, "how conditions name it"),
            Key("axis", NameOf("axis"), "the axis that turns it"),
            Key("ratio", _ratio, "turns of the shaft per unit of the axis; negative: backwards"),
            optional(number(), "offset", "degrees of the shaft while the axis is at 0", 0.0),
        ),
    ),
    inner={"cam": CAM},
    inner_attributes={"cam": "cams"},
    read=_read,
    refers=_refers,
    build=_build,
    signals=_signals,
    drawing=lambda shaft: Drawing(DIAL, float(TURN), ("angle",), sensors=tuple(one.zone for one in shaft.spec.cams)),
    lanes=lambda spec: tuple(lane_of(spec.name, n) for n in range(1, len(spec.cams) + 1)),
)
