"""The table of a MIC488 in a description: ``[[mic488]]`` with its tables ``M1`` to ``M4`` and ``IN1`` on."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any, TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.mic488.config import AXIS_KEYS, INPUT_KEYS, INPUTS, NO_INPUT, ConfigKey, ControllerConfig
from steptwin.mic488.registers import AXES, FIRMWARES
from steptwin.simulation.kinds.kind import ControllerSpec
from steptwin.simulation.toml.reader import Key
from steptwin.simulation.toml.table import key, numbered_tables_in, table
from steptwin.simulation.toml.values import (
    ValueReader,
    address_value,
    flag,
    permitting,
    text_value,
    time_value,
    whole,
    word,
)
from steptwin.wire.rtu import MAX_UNIT

BankFiles: TypeAlias = tuple[tuple[int, str], ...]
"""Numbers of banks and the files that are for them."""


@permitting(", ".join(FIRMWARES))
def _firmware(value: Any) -> str:
    """A number as well, and without the last zero."""
    text = str(value) if isinstance(value, float) else value
    short = [name for name in FIRMWARES if name.removesuffix("0") == text]
    return short[0] if short else word(*FIRMWARES)(text)


@permitting("file, list of files, or { BANK = file }")
def banks_value(value: Any) -> tuple[tuple[int, str], ...]:
    """Files by bank: a text is for bank 0, a list for 0, 1 …, a table names the banks."""
    if isinstance(value, str):
        return ((0, text_value(value)),)
    if isinstance(value, list):
        return tuple((bank, text_value(name)) for bank, name in enumerate(value))
    if not isinstance(value, Mapping):
        raise Misuse(f"{value!r}: expected a file, a list of files, or files by bank such as {{ 3 = 'file' }}")
    for bank in value:
        if not (bank.isascii() and bank.isdecimal() and len(bank) < 4) or (len(bank) > 1 and bank[0] == "0"):
            raise Misuse(f"{bank!r} is not a bank: expected a number from 0 on")
    return tuple(sorted((int(bank), text_value(name)) for bank, name in value.items()))


_SWITCHES = f"IN1 to IN{INPUTS} or 'none', or the number of the vendor's file, 0 for IN1 to {NO_INPUT} for none"


def _values(row: ConfigKey) -> str:
    """The permitted values."""
    if row.attribute in ("in_kl", "in_kr"):
        return _SWITCHES
    return ", ".join(f"{text} ({number})" for number, text in row.choices.items()) or row.values


def _configured(row: ConfigKey) -> Callable[[Any], Any]:
    words = {text.upper(): number for number, text in row.choices.items() if text}
    if row.attribute in ("in_kl", "in_kr"):
        words = {f"IN{number}": number - 1 for number in range(1, INPUTS + 1)} | {"NONE": NO_INPUT}

    def read(value: Any) -> Any:
        number = words.get(value.upper()) if isinstance(value, str) else value
        if isinstance(number, bool) or not isinstance(number, int | float) or not row.permits(number):
            raise Misuse(f"{value!r}: permitted: {_values(row)}")
        if row.whole and number != int(number):
            raise Misuse(f"{value!r}: permitted: {_values(row)}")
        return int(number) if row.whole else number

    return read


def _changed(rows: Iterable[ConfigKey]) -> Iterator[Key]:
    """Keys of ``[mic488.M1]`` and of ``[mic488.IN1]``: attributes of the configuration, choices by number or by word."""
    return (Key(row.attribute, ValueReader(_configured(row), _values(row)), row.meaning, None) for row in rows)


@table("[[mic488]]")
class Mic488Spec(ControllerSpec):
    unit: int | None = key(whole(1, MAX_UNIT), "slave address; default that of its configuration", default=None)
    firmware: str = key(_firmware, "its firmware", default="1.70")
    config: str | None = key(text_value, "the vendor tool's .cfg file", default=None)
    program: str | None = key(text_value, "file with a WBC program for bank 0", default=None)
    programs: BankFiles = key(
        banks_value,
        "WBC programs by bank: ['a.prg', 'b.prg'] for 0 and 1, or { 3 = 'd.prg' }",
        default=(),
        excludes=("program",),
    )
    positions: BankFiles = key(banks_value, "position tables by bank, as programs; 'a.csv' alone is for bank 0", default=())
    start: bool = key(flag, "whether the program starts at power-on", default=False)
    statement_time: Nanos | None = key(time_value, "what a statement of the program takes", default=None)
    lenient: bool = key(flag, "holes of the register map read 0", default=False)
    vision: str | None = key(
        address_value, "HOST:PORT for records of a vision system ('N1 X12.5 Y-3 A90' and a line end)", default=None
    )
    trigger_keeps: bool | None = key(
        flag, "whether a trigger keeps the values it uses; default that of its configuration, no", default=None
    )
    axes: Mapping[int, Mapping[str, Any]] = numbered_tables_in("M", AXES, _changed(AXIS_KEYS))
    """Changed attributes of `AxisConfig`, by axis from 1."""
    inputs: Mapping[int, Mapping[str, Any]] = numbered_tables_in("IN", INPUTS, _changed(INPUT_KEYS))

    @property
    def all_programs(self) -> BankFiles:
        """``programs``, and ``program`` in bank 0."""
        return self.programs if self.program is None else ((0, self.program), *self.programs)


def config_of(spec: Mic488Spec, base: ControllerConfig) -> ControllerConfig:
    """The configuration of a controller: its file's, and what the description changes."""
    axes = tuple(replace(axis, **spec.axes.get(n, {})) for n, axis in enumerate(base.axes, start=1))
    inputs = tuple(replace(one, **spec.inputs.get(n, {})) for n, one in enumerate(base.inputs, start=1))
    keeps = base.trigger_keeps if spec.trigger_keeps is None else int(spec.trigger_keeps)
    config = replace(base, axes=axes, inputs=inputs, trigger_keeps=keeps)
    return replace(config, program=replace(config.program, activate=1)) if spec.start else config
