"""``[axis.encoder]``: what the controller of an axis reads of it, or of another axis that it follows."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

from steptwin.errors import Misuse
from steptwin.world.contacts import Switch, Zone
from steptwin.world.kind import EncoderInputs
from steptwin.world.mechanics import EncoderBuild, RotorMark
from steptwin.world.names import Unknown
from steptwin.world.reader import Table, TomlText, optional, read_table
from steptwin.world.scale import exact_fraction
from steptwin.world.sense import TableRows, check_sense
from steptwin.world.site import Site
from steptwin.world.tomlplaces import Path
from steptwin.world.values import flag, name_value, number, whole, word

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

    from steptwin.world.elements.axis import BuiltAxis


@dataclass(frozen=True, slots=True, kw_only=True)
class EncoderSpec:
    counts_per_rev: int | None
    counts_per_unit: float | None
    index: bool
    offset: float
    index_width: int
    mount: str
    follows: str | None
    slip: float
    path: Path = ()


ENCODER = TableRows(
    written="[axis.encoder]",
    keys=(
        optional(whole(-(10**9), 10**9), "counts_per_rev", "counts per motor revolution; negative: backwards"),
        optional(number(), "counts_per_unit", "counts per unit of the axis, for an encoder on the load"),
        optional(flag, "index", "whether channel C gives an index once per revolution", False),
        optional(number(), "offset", "position of an index, in the unit of the axis", 0.0),
        optional(whole(1, 10**6), "index_width", "width of the index in pulses", 4),
        optional(word("motor", "load"), "mount", "on the motor, or on the load behind the play", "motor"),
        optional(name_value, "follows", "another axis whose load turns it (electronic gear)"),
        optional(number(0.0, 1.0), "slip", "share of the motion that its coupling loses", 0.0),
    ),
    need={"offset": "index", "index_width": "index"},
    exclude=(("counts_per_rev", "counts_per_unit"),),
)


def read_encoder(text: TomlText, axis: Path, table: Table) -> EncoderSpec | None:
    """The encoder in the table of an axis, if there is one."""
    if "encoder" not in table:
        return None
    path = (*axis, "encoder")
    spec = EncoderSpec(**read_table(text, path, table["encoder"], ENCODER.keys), path=path)
    check_sense(text, path, ENCODER, table["encoder"])
    return spec


def fit_encoder(axis: BuiltAxis, spec: EncoderSpec | None, axes: Mapping[str, BuiltAxis], site: Site) -> None:
    """Put an encoder on an axis, or on the one that it follows. Without one, mechanics between pulses and load turn that of the
    controller."""
    mechanism = axis.mechanism
    name = axis.spec.drive[0]
    kind, machine = site.kind(name), site.machine(name)
    encoders = kind.encoders
    if encoders is None:
        if spec is not None:
            raise Misuse(f"encoder: {name} is {kind.title}, which reads none")
        return
    now = axis.kernel.now
    reader = encoders.reader(machine)
    if spec is None:
        if not mechanism.build.ideal:
            mechanism.fit(EncoderBuild(name, reader, mechanism.number), now)
        return
    turned = axis
    if spec.follows is not None:
        other = axes.get(spec.follows)
        if other is None:
            raise Unknown(spec.follows, f"encoder: follows = {spec.follows!r}: axes are {', '.join(axes)}")
        turned = other
    counts = _counts(spec, turned, encoders, machine, mechanism.number)
    on_load = spec.mount == "load" or spec.follows is not None
    numerator, denominator = (None, 1) if counts is None else (counts.numerator, counts.denominator)
    turned.mechanism.fit(EncoderBuild(name, reader, mechanism.number, on_load, numerator, denominator), now)
    if spec.index:
        low = axis.scale.nearest(spec.offset)
        target = (name, encoders.index_input(mechanism.number))
        circuit = site.circuit(axis.kernel, target, (*spec.path, "index"), None)
        zone = Zone(low, low + spec.index_width - 1, 0, axis.scale.pulses_per_rev)
        axis.kernel.add_part(Switch(circuit, RotorMark(turned.mechanism), zone, now), (turned.mechanism.machine,))


def _counts(spec: EncoderSpec, turned: BuiltAxis, encoders: EncoderInputs[Any], machine: Any, number: int) -> Fraction | None:
    """Counts per pulse of what turns it; None: as the controller is configured."""
    counts: Fraction | None = None
    if spec.counts_per_unit is not None:
        counts = exact_fraction(spec.counts_per_unit) / turned.scale.pulses_per_unit
    elif spec.counts_per_rev is not None:
        counts = Fraction(spec.counts_per_rev, turned.scale.pulses_per_rev)
    if spec.slip:
        if counts is None:
            counts = encoders.counts_per_pulse(machine, number)
        counts *= 1 - exact_fraction(spec.slip)
    return counts
