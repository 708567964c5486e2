"""``steptwin commands``: the command language of a controller, for people and for programs.

From Python: `steptwin.m1486.commands.TABLE`, `steptwin.wbc.statements.STATEMENTS` and their neighbours.
"""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, Annotated

import typer

from steptwin.cli import completion
from steptwin.cli.pages import PageFormat, PageSection, show
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.m1486.commands import CommandSpec
    from steptwin.m1486.variants import Variant


class CommandsOf(enum.StrEnum):
    M1486 = "m1486"
    MIC488 = "mic488"


def command(
    device: Annotated[CommandsOf, typer.Argument(help="Controller.")],
    variant: Annotated[
        str | None,
        typer.Option(help="Type of M1486: A, B, C, E1, E2, or A2x and so on. Default: all.", autocompletion=completion.variants),
    ] = None,
    firmware: Annotated[
        str | None, typer.Option(help="Firmware of the MIC488. Default 1.70.", autocompletion=completion.firmwares)
    ] = None,
    form: Annotated[PageFormat, typer.Option("--format", help="How to print it.")] = PageFormat.TEXT,
) -> None:
    """Show the statements or commands of a controller, their arguments and effects, and all findings of the checker."""
    if device is CommandsOf.MIC488:
        if variant is not None:
            raise Misuse("--variant is for the M1486 only")
        sections = _wbc(firmware)
    else:
        if firmware is not None:
            raise Misuse("--firmware is for the MIC488 only")
        sections = _m1486(variant)
    show(sections, form)


def _wbc(firmware: str | None) -> list[PageSection]:
    from steptwin.cli.commands_wbc import sections_of as sections_of_wbc
    from steptwin.wbc.dialect import DEFAULT, dialect_for

    return sections_of_wbc(DEFAULT if firmware is None else dialect_for(firmware))


def _m1486(variant: str | None) -> list[PageSection]:
    from steptwin.m1486 import variants

    if variant is None:
        return sections_of(tuple(v for v in variants.VARIANTS if v.clock == 1))
    return sections_of((variants.variant(variant),))


def sections_of(variants: tuple[Variant, ...]) -> list[PageSection]:
    """The tables of the language, each with its columns, for these variants."""
    return [
        _commands(variants),
        _functions(),
        _flags(),
        _registers(),
        _uploads(),
        _microsteps(),
        _lines(),
        _variants(variants),
        _findings(),
    ]


def _commands(variants: tuple[Variant, ...]) -> PageSection:
    from steptwin.m1486.commands import TABLE, When, memory_bits, takes_variable

    rows = [
        (
            spec.key,
            spec.name,
            _numbers(spec, variants),
            "yes" if takes_variable(spec.key) else "",
            str(0 if spec.when is When.RECEIVED else memory_bits(spec.key)),  # M-45
            spec.when.value,
            spec.effect,
            spec.section,
        )
        for spec in TABLE
    ]
    return PageSection("Commands", ("command", "name", "number", "variable", "bits", "acts", "effect", "section"), rows)


def _numbers(spec: CommandSpec, variants: tuple[Variant, ...]) -> str:
    from steptwin.m1486.commands import ArgType, range_text

    if spec.kind is ArgType.NONE:
        return ""
    texts: dict[str, list[str]] = {}
    for variant in variants:
        texts.setdefault(range_text(spec, variant, named=spec.kind is not ArgType.NUMBER), []).append(variant.name)
    if len(texts) == 1:
        return next(iter(texts))
    return "; ".join(f"{text} on {', '.join(names)}" for text, names in texts.items())


def _functions() -> PageSection:
    from steptwin.m1486.functions import TABLE

    rows = [(str(f.number), f.name or "reserved", "ON" if f.default else "OFF", f.on, f.off) for f in TABLE]
    return PageSection("Auxiliary functions", ("number", "name", "default", "ON", "OFF"), rows)


def _flags() -> PageSection:
    from steptwin.m1486.functions import CARRY, USER_FLAGS

    rows = [
        (f"{USER_FLAGS[0]} to {USER_FLAGS[-1]}", "user flags", "T and C"),
        (str(CARRY), "carry", "+ and - only"),
    ]
    return PageSection("Flags", ("number", "name", "set and cleared by"), rows)


def _registers() -> PageSection:
    from steptwin.m1486.registers import REGISTERS

    rows = [(str(r.number), r.name, str(r.bits), "yes" if r.is_operand else "no") for r in REGISTERS]
    return PageSection("Registers", ("number", "name", "bits", "operand while function 58 is ON"), rows)


def _uploads() -> PageSection:
    from steptwin.m1486.registers import UPLOAD_RANGE, UPLOADS

    rows = [(str(number), UPLOADS.get(number, "reserved")) for number in UPLOAD_RANGE]
    return PageSection("Bytes to upload", ("number", "content"), rows)


def _microsteps() -> PageSection:
    from steptwin.m1486.microsteps import HIGHEST_SPEED, PAIRS, UNIT, low_range_limit, microstep_size

    rows = [
        (
            str(m),
            str(microstep_size(m)),
            f"{low_range_limit(m):g}",
            ", ".join(f"Q{q} up to {HIGHEST_SPEED[q]}" for q in qualifications),
        )
        for m, qualifications in PAIRS.items()
    ]
    columns = ("M", f"microstep in {UNIT}", "division in force up to, step/s", "above, step/s")
    return PageSection("Microsteps", columns, rows)


def _lines() -> PageSection:
    from steptwin.m1486.lines import INTERFACES, LINES, SEEK_ENDS_LOW, SHARED_PINS

    rows = []
    for line in LINES:
        taken = [i.title for i in INTERFACES if line in i.occupied]
        end = "low" if line in SEEK_ENDS_LOW else "high"
        rows.append((f"B{line}", SHARED_PINS.get(line, ""), ", ".join(taken), end))
    return PageSection("I/O lines", ("line", "shares its pin with", "taken by", "seek ends when"), rows)


def _variants(variants: tuple[Variant, ...]) -> PageSection:
    rows = [
        (
            v.title,
            f"1 to {v.labels}",
            str(v.input_bits),
            str(v.memory_bits),
            v.store.value,
            f"{v.addresses[0]:X} to {v.addresses[-1]:X}",
            f"last {v.shared_bits} bits of the command memory" if v.shared_bits else "a memory of their own",
        )
        for v in variants
    ]
    columns = ("type", "labels", "input buffer, bits", "command memory, bits", "kept in", "addresses", "registers 1 to 8 in")
    return PageSection("Types", columns, rows)


def _findings() -> PageSection:
    from steptwin.m1486.findings import TABLE

    rows = [(f.code, f.severity.value, f.title, f.meaning) for f in TABLE]
    return PageSection("What the checker finds", ("code", "severity", "finding", "why"), rows)
