"""The table of an M1486 in a description: ``[[m1486]]``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from steptwin.m1486.lines import INTERFACES
from steptwin.m1486.variants import VARIANTS
from steptwin.machine import Nanos
from steptwin.simulation.kinds.kind import ControllerSpec
from steptwin.simulation.toml.reader import Key, Row, TomlText, optional
from steptwin.simulation.toml.values import name_value, permitting, text_value, time_value, whole, word

DEFAULT_VARIANT = "B"


@dataclass(frozen=True, slots=True, kw_only=True)
class M1486Spec(ControllerSpec):
    variant: str
    address: int
    interface: str
    baud: int | None
    statement_time: Nanos | None
    program: str | None


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


KEYS = (
    Key("name", name_value, "how the rest of the file names it"),
    optional(name_value, "line", "the line it is on"),
    optional(_variant, "variant", "which type", DEFAULT_VARIANT),
    optional(_address, "address", "0 to 15, or a hexadecimal digit as text", 15),
    optional(word(*(i.name for i in INTERFACES)), "interface", "driver interface", "sd"),
    optional(whole(300, 1_000_000), "baud", "bit/s; default the highest"),
    optional(time_value, "statement_time", "what a command takes; default 1 ms"),
    optional(text_value, "program", "a program it is switched on with; types with RAM lose it when they are switched off"),
)


def read(toml: TomlText, row: Row, table: Mapping[str, Any]) -> M1486Spec:
    return M1486Spec(**row)


def files(spec: M1486Spec) -> Iterator[tuple[str, str]]:
    """Names of files, and the keys that name them."""
    if spec.program is not None:
        yield spec.program, "program"
