"""``[[axis.switch]]``: a contact that is on where its axis stands in its zone."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Protocol

from steptwin.machine import Nanos
from steptwin.simulation.components.contact import CONTACT_KEYS
from steptwin.simulation.components.site import Site
from steptwin.simulation.logic.contacts import MovingPart, Switch, Zone
from steptwin.simulation.mechanics.drawing import SensorZone
from steptwin.simulation.scheduler.kernel import Kernel
from steptwin.simulation.toml.reader import Key, Table, TomlText, optional, read_table
from steptwin.simulation.toml.sense import TableRows, check_sense
from steptwin.simulation.toml.tomlplaces import Path
from steptwin.simulation.toml.values import INPUT_PIN, Terminal, number


@dataclass(frozen=True, slots=True, kw_only=True)
class SwitchSpec:
    """On at and below ``below``, at and above ``above``, or around ``position`` over ``width``, again after each ``period``.

    Units of the axis.
    """

    target: Terminal
    below: float | None
    above: float | None
    position: float | None
    width: float
    period: float | None
    hysteresis: float
    contact: str
    join: str | None
    bounce: Nanos
    bounces: int
    path: Path = ()

    @property
    def zone(self) -> SensorZone:
        """Where it is on, as it is drawn."""
        if self.position is None:
            return SensorZone(self.target, self.above, self.below)
        half = self.width / 2
        return SensorZone(self.target, self.position - half, self.position + half, self.period)


SWITCH = TableRows(
    written="[[axis.switch]]",
    keys=(
        Key("to", INPUT_PIN, "the input: MACHINE.PIN", attribute="target"),
        optional(number(), "below", "on at and below this position, in the unit of what moves"),
        optional(number(), "above", "on at and above this position, likewise"),
        optional(number(), "position", "on around this position, likewise"),
        optional(number(0.0), "width", "how wide the zone around position is, likewise", 0.0),
        optional(number(0.0, above=True), "period", "the zone comes again after each, likewise; default a turn of a rotary axis"),
        optional(number(0.0), "hysteresis", "how much further it stays on, likewise", 0.0),
        *CONTACT_KEYS,
    ),
    need={"width": "position", "period": "position", "bounces": "bounce"},
)


def read_switches(text: TomlText, axis: Path, table: Table, key: str = "switch") -> Iterator[SwitchSpec]:
    """The switches in the table of an axis that have all they need."""
    given = table.get(key, [])
    for n, switch in enumerate(given if isinstance(given, list) else [given]):
        path = (*axis, key, n)
        values = read_table(text, path, switch, SWITCH.keys)
        if "target" in values:
            check_sense(text, path, SWITCH, switch)
            if sum(key in switch for key in ("below", "above", "position")) != 1:
                text.wrong(path, "D007", "a switch needs one of below, above and position")
            yield SwitchSpec(**values, path=path)


def lane_of(axis: str, number: int) -> str:
    """Under which a switch of an axis is recorded; they count from 1."""
    return f"{axis}.switch{number}"


class ContactSpec(Protocol):
    """What all contacts have in their tables."""

    @property
    def target(self) -> Terminal: ...
    @property
    def contact(self) -> str: ...
    @property
    def join(self) -> str | None: ...
    @property
    def bounce(self) -> Nanos: ...
    @property
    def bounces(self) -> int: ...
    @property
    def path(self) -> Path: ...


def put_switch(
    kernel: Kernel, carriage: MovingPart, moved_by: str | tuple[str, ...], zone: Zone, spec: ContactSpec, lane: str, site: Site
) -> None:
    """Put a switch where a carriage, which the machines or elements ``moved_by`` move, runs over it."""
    circuit = site.circuit(kernel, spec.target, (*spec.path, "to"), spec.join)
    part = Switch(
        circuit,
        carriage,
        zone,
        kernel.now,
        normally_closed=spec.contact == "NC",
        bounce_ns=spec.bounce,
        bounces=spec.bounces,
        chance=site.bounce_of(circuit),
        lane=lane,
    )
    kernel.add_part(part, (moved_by,) if isinstance(moved_by, str) else moved_by, drives=circuit.target.machine)


def zone_of(spec: SwitchSpec, places: Callable[[float], int], period: Fraction | int | None = None) -> Zone:
    """Where a switch is on. ``places`` gives places of its carriage for units, ``period`` those from zone to zone."""
    if spec.position is not None:
        half = 0.5 * spec.width
        return Zone(places(spec.position - half), places(spec.position + half), places(spec.hysteresis), period)
    low, high = (None if end is None else places(end) for end in (spec.above, spec.below))
    return Zone(low, high, places(spec.hysteresis))
