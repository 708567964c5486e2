"""``[axis.encoder]``: what the controller of an axis reads of it, or of another axis that it follows."""

from __future__ import annotations

from steptwin.simulation.toml.table import TableSpec, key, table
from steptwin.simulation.toml.values import flag, name_value, number, whole, word


@table("[axis.encoder]")
class EncoderSpec(TableSpec):
    counts_per_rev: int | None = key(whole(-(10**9), 10**9), "counts per motor revolution; negative: backwards", default=None)
    counts_per_unit: float | None = key(
        number(), "counts per unit of the axis (mm of a conveyor), on the load", default=None, excludes=("counts_per_rev",)
    )
    index: bool = key(flag, "whether channel C gives an index once per revolution", default=False)
    offset: float = key(number(), "position of an index, in the unit of the axis", default=0.0, needs="index")
    index_width: int = key(whole(1, 10**6), "width of the index in pulses", default=4, needs="index")
    mount: str = key(
        word("motor", "load"), "on the motor, or on the load behind the play", default="motor", excludes=("follows",)
    )
    follows: str | None = key(name_value, "another axis, a conveyor or a DC motor that turns it", default=None)
    slip: float = key(number(0.0, 1.0), "share of the motion that its coupling loses", default=0.0)
