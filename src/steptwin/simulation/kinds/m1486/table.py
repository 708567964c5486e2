"""The table of an M1486 in a description: ``[[m1486]]``."""

from __future__ import annotations

from typing import Any

from steptwin.controller import Nanos
from steptwin.m1486.lines import INTERFACES
from steptwin.m1486.variants import VARIANTS
from steptwin.simulation.kinds.kind import ControllerSpec
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import permitting, text_value, time_value, whole, word

DEFAULT_VARIANT = "B"


@permitting(", ".join(v.name for v in VARIANTS))
def _variant(value: Any) -> str:
    names = {v.name.upper(): v.name for v in VARIANTS}
    wanted = value.upper().removeprefix("M1486") if isinstance(value, str) else value
    return word(*names.values())(names.get(wanted, value) if isinstance(wanted, str) else value)


@permitting("whole number from 0 to 15, or a hexadecimal digit as text")
def _address(value: Any) -> int:
    if isinstance(value, str) and len(value) == 1 and value in "0123456789ABCDEFabcdef":
        return int(value, 16)
    return whole(0, 15)(value)


@table("[[m1486]]")
class M1486Spec(ControllerSpec):
    variant: str = key(_variant, "which type", default=DEFAULT_VARIANT)
    address: int = key(_address, "0 to 15, or a hexadecimal digit as text", default=15)
    interface: str = key(word(*(i.name for i in INTERFACES)), "driver interface", default="sd")
    baud: int | None = key(whole(300, 1_000_000), "bit/s; default the highest", default=None)
    statement_time: Nanos | None = key(time_value, "what a command takes; default 1 ms", default=None)
    program: str | None = key(
        text_value, "file with a program it is switched on with; types with RAM lose it when they are switched off", default=None
    )
