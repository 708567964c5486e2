"""``steptwin registers``: the register table of a controller, for people and for programs.

From Python: `steptwin.mic488.registers.register_map`.
"""

from __future__ import annotations

import csv
import enum
import io
import json
import sys
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Annotated, Any

import typer

from steptwin.cli import completion
from steptwin.columns import aligned
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.mic488.registermap import MapRow, Register, RegisterMap

_COLUMNS = ("address", "name", "type", "read", "write", "unit", "permitted", "meaning")


class Layout(enum.StrEnum):
    TABLE = "table"
    CSV = "csv"
    JSON = "json"
    MD = "md"
    TAGS = "tags"


def command(
    device: Annotated[str, typer.Argument(metavar="mic488", help="Controller.")],
    firmware: Annotated[
        str, typer.Option(help="Firmware generation: 1.23, 1.40 or 1.70.", autocompletion=completion.firmwares)
    ] = "1.70",
    form: Annotated[Layout, typer.Option("--format", help="How to print it; tags: a list for panels and SCADA.")] = Layout.TABLE,
) -> None:
    """Show the coils, inputs and holding registers of a controller."""
    from steptwin.mic488.registers import register_map

    if device == "m1486":
        raise Misuse("an M1486 has no registers; 'steptwin commands m1486' shows its commands")
    if device != "mic488":
        raise Misuse(f"no controller {device!r} with registers; there is mic488")
    chosen = register_map(firmware)
    if form is Layout.CSV:
        typer.echo(as_csv(chosen), nl=False)
    elif form is Layout.JSON:
        typer.echo(json.dumps(as_data(chosen), ensure_ascii=False, indent=2))
    elif form is Layout.TAGS:
        typer.echo(as_tags(chosen), nl=False)
    elif form is Layout.MD:
        typer.echo(as_markdown(chosen), nl=False)
    elif sys.stdout.isatty():
        _show(chosen)
    else:
        typer.echo(as_text(chosen), nl=False)


# ---------------------------------------------------------------------- for programs


def as_data(register_map: RegisterMap) -> list[dict[str, Any]]:
    """One record for each register; a range under one name (USER_REGISTER) is one record with its ``count``."""
    return [
        {
            "firmware": register_map.firmware.name,
            "space": register.space.value,
            "address": register.address,
            "count": register.cells,
            "name": register.name,
            "aliases": list(register.aliases),
            "key": register.key,
            "index": register.index,
            "axis": register.axis,
            "type": register.type.value,
            "read_functions": list(register.reads),
            "write_functions": list(register.accepts),
            "manual_write_functions": list(register.writes),
            "quantity": register.kind.value,
            "unit": register.unit(),
            "effect": register.effect.value,
            "minimum": register.permitted.low,
            "minimum_excluded": register.permitted.above,
            "maximum": register.permitted.high,
            "values": {str(value): text for value, text in register.values.items()},
            "meaning": register.meaning,
            "manual": register_map.firmware.manual,
            "section": register.section,
        }
        for register in register_map
    ]


def as_csv(register_map: RegisterMap) -> str:
    """The records of `as_data`, lists separated by blanks and values as ``0=REAL 1=DINT``."""
    records = as_data(register_map)
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(records[0]), lineterminator="\n")
    writer.writeheader()
    for record in records:
        flat = {name: " ".join(map(str, value)) if isinstance(value, list) else value for name, value in record.items()}
        writer.writerow(flat | {"values": "; ".join(f"{value}={meaning}" for value, meaning in record["values"].items())})
    return text.getvalue()


_TAG_COLUMNS = ("tag", "data_type", "access", "area", "address_0", "address_1", "reference", "registers", "word_order", "unit")
_LIMITS = ("minimum", "maximum", "comment")
_AREAS = {"coil": ("0x coil", 0), "input": ("1x discrete input", 1), "holding register": ("4x holding register", 4)}


def as_tags(register_map: RegisterMap) -> str:
    """CSV to import into panels and SCADA systems: one tag for each register, its address counted in all three ways.

    ``reference`` has six digits: the area, then the address counted from 1. Registers of type REAL/DINT are REAL.
    """
    from steptwin.mic488.registermap import Type

    types = {Type.BIT: "BOOL", Type.DINT: "DINT", Type.REAL: "REAL", Type.VALUE: "REAL"}
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=[*_TAG_COLUMNS, *_LIMITS], lineterminator="\n")
    writer.writeheader()
    for register in register_map:
        area, digit = _AREAS[register.space.value]
        writer.writerow(
            {
                "tag": register.name,
                "data_type": types.get(register.type, "WORD"),
                "access": ("R" if register.reads else "") + ("W" if register.accepts else ""),
                "area": area,
                "address_0": register.address,
                "address_1": register.address + 1,
                "reference": f"{digit}{register.address + 1:05d}",
                "registers": register.span,
                "word_order": "low word first" if register.type.size == 2 else "",
                "unit": register.unit(),
                "minimum": "" if register.permitted.low is None else register.permitted.low,
                "maximum": "" if register.permitted.high is None else register.permitted.high,
                "comment": _meaning(register.meaning, register.values),
            }
        )
    return text.getvalue()


# ---------------------------------------------------------------------- for people


def _functions(codes: Iterable[int]) -> str:
    from steptwin.wire.pdu import function_number

    return ", ".join(map(function_number, codes))


def _permitted(register: Register) -> str:
    from steptwin.mic488.registermap import QuantityKind

    if not register.accepts:
        return ""
    return {QuantityKind.SWITCH: "ON, OFF", QuantityKind.MASK: "bit 0 M1 … bit 3 M4"}.get(register.kind, str(register.permitted))


def _meaning(sentence: str, values: Mapping[int, str]) -> str:
    listed = ", ".join(f"{value} {text}" for value, text in values.items())
    return f"{sentence.removesuffix('.')}: {listed}." if listed else sentence


def _line(register: Register) -> tuple[str, ...]:
    address = str(register.address) if register.cells == 1 else f"{register.address}…{register.last}"
    return (
        address,
        register.name,
        register.type.value,
        _functions(register.reads),
        _functions(register.accepts),
        register.unit(),
        _permitted(register),
        _meaning(register.meaning, register.values),
    )


def as_text(register_map: RegisterMap) -> str:
    """Aligned columns, one register a line."""
    return "\n".join((*aligned([_COLUMNS, *(_line(register) for register in register_map)]), ""))


def _show(register_map: RegisterMap) -> None:
    from rich.console import Console
    from rich.table import Table

    from steptwin.mic488.registermap import Space

    console = Console(highlight=False)
    for space in Space:
        table = Table(title=f"MIC488 firmware {register_map.firmware.name}: {space.value}s", title_justify="left")
        for column in _COLUMNS:
            table.add_column(column, justify="right" if column == "address" else "left", no_wrap=column in ("address", "name"))
        for register in register_map:
            if register.space is space:
                table.add_row(*_line(register))
        console.print(table)


def as_markdown(register_map: RegisterMap) -> str:
    """Tables for a page, the copies of a register for axes and channels in one line, ``x`` standing for their number."""
    from steptwin.mic488.registermap import Space

    parts = []
    for space in Space:
        lines = [_family(register_map, row) for row in register_map.rows if row.space is space]
        table = [_COLUMNS, ["---"] * len(_COLUMNS), *lines]
        parts.append(f"### {space.value.capitalize()}s\n\n" + "".join(f"| {' | '.join(line)} |\n" for line in table))
    return "\n".join(parts)


def _family(register_map: RegisterMap, row: MapRow) -> tuple[str, ...]:
    members = [register for register in register_map if register.key == row.key]
    first, last = members[0], members[-1]
    cells = _line(first)
    if len(members) == 1:
        addresses = cells[0]
    elif row.step == first.span == 1:
        addresses = f"{first.address}…{last.address}"
    else:
        addresses = ", ".join(str(member.address) for member in members)
    name = f"`{row.name.format(n='x')}`"
    aliases = "".join(f" (also `{alias.format(n='x')}`)" for alias in row.aliases)
    return (addresses, name + aliases, *cells[2:-1], _meaning(row.meaning.format(n="x"), row.values))
