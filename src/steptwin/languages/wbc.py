"""Files of the MIC488: programs, their compiled images, position tables, configurations."""

from __future__ import annotations

from pathlib import Path

from steptwin.diagnostics import Severity, SourceText
from steptwin.explain.model import Explanation
from steptwin.files.programfiles import CompanionFiles, check_source
from steptwin.inputfiles import read_bytes
from steptwin.languages.contract import (
    CheckReport,
    FileLanguage,
    GivenOptions,
    Migration,
    Print,
    ProgramWorld,
    count,
    fixed,
)
from steptwin.languages.program_run import ProgramRun
from steptwin.mic488.config import examine_config
from steptwin.mic488.inifile import IniFile
from steptwin.mic488.program_banks import setup_of
from steptwin.wbc import check as wbc_check
from steptwin.wbc import migration
from steptwin.wbc.decompile import IMAGE
from steptwin.wbc.dialect import DEFAULT, Dialect, dialect_for
from steptwin.wbc.positions import parse_positions


def _dialect(options: GivenOptions) -> Dialect:
    return dialect_for(options.get("firmware", DEFAULT.firmware))


def _files(program: str, options: GivenOptions) -> CompanionFiles:
    return CompanionFiles.of(Path(program), options.get("positions"), options.get("config"))


class _RunLanguage(FileLanguage):
    """Programs of the MIC488 that run, as text or compiled."""

    title = "WBC programs"
    options = frozenset({"positions", "config", "firmware", "travel", "statement_time"})

    def run(self, given: ProgramRun, options: GivenOptions, out: Print, warn: Print) -> bool:
        from steptwin.files.timedinputs import parse_duration
        from steptwin.languages.run_wbc import WbcRun, run
        from steptwin.languages.travels import parse_travel

        wanted = WbcRun.of(
            given,
            positions=options.get("positions"),
            config=options.get("config"),
            firmware=options.get("firmware", DEFAULT.firmware),
            statement_time=parse_duration(options.get("statement_time", "1ms"), "--statement-time"),
            travels=parse_travel(",".join(options.get("travel", []))),
        )
        return run(wanted, out, warn)

    def world(self, program: Path, options: GivenOptions, show: Print) -> ProgramWorld:
        from steptwin.languages.run_wbc import WbcRun, prepare

        given = prepare(WbcRun(program=program, positions=options.get("positions"), config=options.get("config")), show)
        if given.companions.found:
            show(str(given.companions))
        return ProgramWorld(given.describe(str), {str(path): read_bytes(path) for path in given.paths})


class WbcPrograms(_RunLanguage):
    name = "wbc"
    suffixes = (".prg",)

    def check(self, source: SourceText, options: GivenOptions) -> CheckReport:
        dialect = _dialect(options)
        files = _files(source.name, options)
        read = check_source(source, files.positions, files.config, dialect)
        lines = read.checked.lines
        shown = f"MIC488 firmware {dialect.firmware}, {count(lines, 'executable line')} of {dialect.max_steps}"
        data = {
            "firmware": dialect.firmware,
            "positions": None if files.positions is None else str(files.positions),
            "config": None if files.config is None else str(files.config),
            "executable_lines": lines,
            "limit_lines": dialect.max_steps,
        }
        return CheckReport(
            read.checked.diagnostics, data, [shown, *([str(files)] if files.found else [])], list(read.findings[1:])
        )

    def explain(self, source: SourceText, options: GivenOptions) -> list[Explanation]:
        from steptwin.explain.mic488 import explain

        dialect = _dialect(options)
        files = _files(source.name, options)
        read = check_source(source, files.positions, files.config, dialect)
        return [explain(source, read.checked, read.config, dialect)]

    def migrate(self, source: SourceText, to: str, old: str | None) -> Migration:
        new = dialect_for(to)
        before = DEFAULT if old is None else dialect_for(old)
        files = _files(source.name, {})
        read = check_source(source, files.positions, files.config, before)
        setup = None if read.config is None else setup_of(read.config)
        found = migration.findings(source.text, before, new, read.positions, setup)
        text = fixed(source.text, found)
        left = [d for d in wbc_check.check(text, read.positions, setup, new).diagnostics if d.severity is Severity.ERROR]
        return Migration(
            f"from firmware {before.firmware} to {new.firmware}", list(migration.differences(before, new)), found, text, left
        )

    def format(self, text: str) -> str:
        from steptwin.wbc.printer import format_text

        return format_text(text)


class WbcImages(_RunLanguage):
    name = "wbc-image"
    suffixes = (IMAGE,)
    not_text = "is a compiled image: steptwin decompile makes a program of it"


class PositionTables(FileLanguage):
    name = "positions"
    title = "position tables"
    suffixes = (".csv",)

    def check(self, source: SourceText, options: GivenOptions) -> CheckReport:
        table, found = parse_positions(source.text)
        return CheckReport(found, {"positions": len(table.rows)}, [count(len(table.rows), "position")])


class Configurations(FileLanguage):
    name = "config"
    title = "configurations"
    suffixes = (".cfg",)
    options = frozenset({"firmware"})

    def check(self, source: SourceText, options: GivenOptions) -> CheckReport:
        firmware = _dialect(options).firmware
        _, found = examine_config(IniFile.of_text(source.text), firmware)
        return CheckReport(found, {"firmware": firmware}, [f"MIC488 firmware {firmware}"])


WBC_PROGRAMS = WbcPrograms()
WBC_IMAGES = WbcImages()
POSITION_TABLES = PositionTables()
CONFIGURATIONS = Configurations()
