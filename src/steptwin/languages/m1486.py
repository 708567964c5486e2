"""Programs of the M1486: `M1486_PROGRAMS`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from steptwin.diagnostics import Diagnostic, Severity, SourceText, Span
from steptwin.explain.model import Explanation
from steptwin.inputfiles import read_bytes
from steptwin.languages.contract import CheckReport, FileLanguage, GivenOptions, Migration, Print, ProgramWorld, fixed
from steptwin.languages.program_run import ProgramRun
from steptwin.m1486 import lines, migration, variants
from steptwin.m1486.check import ChipMemory, check
from steptwin.m1486.pins import OPEN_ADDRESS


def _variant(options: GivenOptions) -> variants.Variant:
    return variants.variant(options.get("variant", variants.DEFAULT.name))


def _interface(options: GivenOptions) -> lines.Interface:
    return lines.interface(options.get("interface", lines.STEP_DIRECTION.name))


def _memory_summary(chip: ChipMemory) -> str:
    name = "command memory" if chip.address is None else f"command memory of chip {chip.address:X}"
    files = ", ".join(f"{bits} of {chip.limit} bits in [ ]" for bits in chip.files)
    total = f"{chip.total} bits in total"
    return f"{name}: {files}, {total}" if files else f"{name}: {total}, nothing in [ ] ({chip.limit} bits)"


def _memory_lines(source: SourceText, chip: ChipMemory) -> list[str]:
    shown, total = ["  line  bits  total  command"], 0
    for taken in chip.commands:
        total += taken.bits
        line, _ = source.position(taken.command.span.start)
        indent = "  " if taken.in_file else ""
        shown.append(f"  {line:>4}  {taken.bits:>4}  {total:>5}  {indent}{taken.command}")
    return shown


def _memory_data(source: SourceText, chip: ChipMemory) -> dict[str, Any]:
    commands = []
    for taken in chip.commands:
        line, column = source.position(taken.command.span.start)
        commands.append(
            {"line": line, "column": column, "command": str(taken.command), "bits": taken.bits, "in_file": taken.in_file}
        )
    return {
        "address": None if chip.address is None else f"{chip.address:X}",
        "limit_bits": chip.limit,
        "total_bits": chip.total,
        "file_bits": list(chip.files),
        "commands": commands,
    }


def _moved(one: Diagnostic, found: Sequence[Diagnostic]) -> Diagnostic:
    """A diagnostic at its place in the text with the fixes."""
    fixes = [d.fix for d in found if d.fix is not None and d.fix.span.end <= one.span.start]
    by = sum(len(fix.text) - (fix.span.end - fix.span.start) for fix in fixes)
    return replace(one, span=Span(one.span.start + by, one.span.end + by))


class M1486Programs(FileLanguage):
    name = "m1486"
    title = "M1486 programs"
    suffixes = (".m1486",)
    is_usual = True
    options = frozenset({"variant", "interface", "memory", "wire"})

    def check(self, source: SourceText, options: GivenOptions) -> CheckReport:
        variant, interface = _variant(options), _interface(options)
        checked = check(source.text, variant, interface)
        shown = [f"{variant.title}, {interface.title} interface"]
        for chip in checked.memory:
            shown.append(_memory_summary(chip))
            if options.get("memory"):
                shown += _memory_lines(source, chip)
        data = {
            "variant": variant.name,
            "interface": interface.name,
            "memory": [_memory_data(source, chip) for chip in checked.memory],
        }
        return CheckReport(checked.diagnostics, data, shown)

    def explain(self, source: SourceText, options: GivenOptions) -> list[Explanation]:
        from steptwin.explain.m1486 import explain

        return explain(source, _variant(options), _interface(options))

    def migrate(self, source: SourceText, to: str, old: str | None) -> Migration:
        new = variants.variant(to)
        before = variants.DEFAULT if old is None else variants.variant(old)
        found = migration.findings(source.text, before, new)
        text = fixed(source.text, found)
        left = [d for d in check(text, new).diagnostics if d.severity is Severity.ERROR]
        left += [_moved(d, found) for d in found if d.code == migration.NOT_CONVERTED.code]
        return Migration(f"from {before.title} to {new.title}", list(migration.differences(before, new)), found, text, left)

    def run(self, given: ProgramRun, options: GivenOptions, out: Print, warn: Print) -> bool:
        from steptwin.languages.run_m1486 import M1486Run, run

        wanted = M1486Run.of(
            given, variant=_variant(options).name, interface=_interface(options).name, wires=tuple(options.get("wire", ()))
        )
        return run(wanted, out, warn)

    def world(self, program: Path, options: GivenOptions, show: Print) -> ProgramWorld:
        from steptwin.languages.chips import Chain, check_chain
        from steptwin.languages.run_m1486 import describe_chips

        chain = Chain(variant=_variant(options), addresses=[OPEN_ADDRESS], interface=_interface(options))
        check_chain(chain, has_program=True)
        return ProgramWorld(describe_chips(chain, program.stem, program, [], []), {str(program): read_bytes(program)})


M1486_PROGRAMS = M1486Programs()
