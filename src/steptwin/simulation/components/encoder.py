"""``[axis.encoder]``: what the controller of an axis reads of it, or of another axis that it follows."""

from __future__ import annotations

from dataclasses import dataclass

from steptwin.simulation.toml.reader import Table, TomlText, optional, read_table
from steptwin.simulation.toml.sense import TableRows, check_sense
from steptwin.simulation.toml.tomlplaces import Path
from steptwin.simulation.toml.values import flag, name_value, number, whole, word


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
