"""Which files belong together: the program, table and configuration of one name, and what worlds name."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from steptwin.errors import Misuse
from steptwin.lsp.files import relative
from steptwin.m1486.lines import STEP_DIRECTION, Interface, interface
from steptwin.m1486.variants import Variant, variant
from steptwin.wbc.dialect import DEFAULT as DEFAULT_DIALECT
from steptwin.wbc.dialect import Dialect, dialect_for
from steptwin.world.kinds.m1486.table import DEFAULT_VARIANT
from steptwin.world.kinds.mic488.table import banks_value


@dataclass(frozen=True, slots=True)
class ControllerFiles:
    """A MIC488 of a world: addresses of its files, by bank where there are banks."""

    world: str
    name: str
    firmware: str
    config: str | None
    programs: Mapping[int, str]
    positions: Mapping[int, str]

    @property
    def files(self) -> Iterator[str]:
        yield from self.programs.values()
        yield from self.positions.values()
        if self.config is not None:
            yield self.config

    def table_of(self, program: str) -> str | None:
        """The table of a program: that of its bank, or the only one there is."""
        bank = next((bank for bank, uri in self.programs.items() if uri == program), None)
        if bank in self.positions:
            return self.positions[bank]
        return next(iter(self.positions.values())) if len(self.positions) == 1 else None

    @property
    def dialect(self) -> Dialect:
        try:
            return dialect_for(self.firmware)
        except Misuse:
            return DEFAULT_DIALECT


@dataclass(frozen=True, slots=True)
class Chip:
    """An M1486 of a world."""

    world: str
    name: str
    variant: Variant
    interface: Interface
    program: str


def machines_of(world: str, text: str) -> tuple[list[ControllerFiles], list[Chip]]:
    """The controllers of a world and their files. Raises `Misuse` for a text that is not TOML; leaves out what is wrong."""
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise Misuse(str(error)) from None
    controllers = [_controller(world, table) for table in _tables(data, "mic488")]
    chips = [_chip(world, table) for table in _tables(data, "m1486") if _text(table, "program") is not None]
    return controllers, chips


def _tables(data: Mapping[str, Any], kind: str) -> list[Mapping[str, Any]]:
    tables = data.get(kind)
    return [table for table in tables if isinstance(table, dict)] if isinstance(tables, list) else []


def _text(table: Mapping[str, Any], key: str) -> str | None:
    value = table.get(key)
    return value if isinstance(value, str) and value.strip() else None


def _controller(world: str, table: Mapping[str, Any]) -> ControllerFiles:
    programs = _banks(world, table, "programs")
    single = _text(table, "program")
    if single is not None:
        programs = {0: relative(world, single)} | programs
    config = _text(table, "config")
    return ControllerFiles(
        world,
        _text(table, "name") or "",
        str(table.get("firmware", DEFAULT_DIALECT.firmware)),
        None if config is None else relative(world, config),
        programs,
        _banks(world, table, "positions"),
    )


def _banks(world: str, table: Mapping[str, Any], key: str) -> dict[int, str]:
    try:
        return {bank: relative(world, name) for bank, name in banks_value(table[key])} if key in table else {}
    except Misuse:
        return {}


def _chip(world: str, table: Mapping[str, Any]) -> Chip:
    try:
        kind = variant(str(table.get("variant", DEFAULT_VARIANT)))
    except Misuse:
        kind = variant(DEFAULT_VARIANT)
    try:
        drive = interface(str(table.get("interface", STEP_DIRECTION.name)))
    except Misuse:
        drive = STEP_DIRECTION
    return Chip(world, _text(table, "name") or "", kind, drive, relative(world, _text(table, "program") or ""))
