"""Programs for another type of M1486, or another firmware of the MIC488."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from steptwin.commands.check import count
from steptwin.commands.explain import PROGRAM
from steptwin.diagnostics import Diagnostic, Severity, SourceText, Span, render, to_json
from steptwin.errors import Misuse
from steptwin.files.programfiles import CompanionFiles, check_source
from steptwin.files.textfiles import read_text, write_bytes
from steptwin.m1486 import check as m1486_check
from steptwin.m1486 import migration as m1486
from steptwin.m1486 import variants
from steptwin.mic488.program_banks import setup_of
from steptwin.wbc import check as wbc_check
from steptwin.wbc import migration as wbc
from steptwin.wbc.dialect import DEFAULT, dialect_for


@dataclass(frozen=True)
class Migration:
    """``text`` is the program with the fixes; ``left`` the errors that it has for the new type."""

    title: str
    differences: list[str]
    findings: list[Diagnostic]
    text: str
    left: list[Diagnostic]


def migrate(
    path: Path, to: str, old: str | None, output: Path | None, out: Callable[[str], object]
) -> tuple[bool, dict[str, Any]]:
    """Print what has to change, write the changed program to ``output``. Returns whether it fits then, and the report as data."""
    file = read_text(path)
    found = _wbc(file.source, to, old) if path.suffix.lower() == PROGRAM else _m1486(file.source, to, old)
    if output is not None:
        write_bytes(output, file.to_bytes(found.text))
    changes = sum(d.fix is not None for d in found.findings)
    changed = SourceText(str(output or path), found.text)
    out(f"{path}: {found.title}")
    for sentence in found.differences:
        out(f"  {sentence}")
    if found.findings:
        out(render(file.source, found.findings))
    out(f"{count(changes, 'change')}{'' if output is None else f', written to {output}'}; errors left: {len(found.left)}")
    if found.left:
        out(render(changed, found.left))
    return not found.left, {
        "version": 1,
        "file": str(path),
        "title": found.title,
        "differences": found.differences,
        "diagnostics": to_json(file.source, found.findings),
        "errors_left": to_json(changed, found.left),
        "text": found.text,
    }


def _m1486(source: SourceText, to: str, old: str | None) -> Migration:
    new = variants.variant(to)
    before = variants.DEFAULT if old is None else variants.variant(old)
    found = m1486.findings(source.text, before, new)
    text = fixed(source.text, found)
    left = [d for d in m1486_check.check(text, new).diagnostics if d.severity is Severity.ERROR]
    left += [_moved(d, found) for d in found if d.code == m1486.NOT_CONVERTED.code]
    return Migration(f"from {before.title} to {new.title}", list(m1486.differences(before, new)), found, text, left)


def _moved(one: Diagnostic, found: Sequence[Diagnostic]) -> Diagnostic:
    """A diagnostic at its place in the text with the fixes."""
    fixes = [d.fix for d in found if d.fix is not None and d.fix.span.end <= one.span.start]
    by = sum(len(fix.text) - (fix.span.end - fix.span.start) for fix in fixes)
    return replace(one, span=Span(one.span.start + by, one.span.end + by))


def _wbc(source: SourceText, to: str, old: str | None) -> Migration:
    new = dialect_for(to)
    before = DEFAULT if old is None else dialect_for(old)
    files = CompanionFiles.of(Path(source.name), None, None)
    read = check_source(source, files.positions, files.config, before)
    setup = None if read.config is None else setup_of(read.config)
    found = wbc.findings(source.text, before, new, read.positions, setup)
    text = fixed(source.text, found)
    left = [d for d in wbc_check.check(text, read.positions, setup, new).diagnostics if d.severity is Severity.ERROR]
    title = f"from firmware {before.firmware} to {new.firmware}"
    return Migration(title, list(wbc.differences(before, new)), found, text, left)


def fixed(text: str, found: Sequence[Diagnostic]) -> str:
    """The text with all fixes; of two at one place the first."""
    parts: list[str] = []
    end = 0
    for fix in sorted((d.fix for d in found if d.fix is not None), key=lambda fix: fix.span):
        if fix.span.start >= end:
            parts += [text[end : fix.span.start], fix.text]
            end = fix.span.end
    return "".join((*parts, text[end:]))


def refuse(path: Path) -> None:
    """Raises `Misuse` for what is no program."""
    if path.suffix.lower() in (".csv", ".cfg", ".toml", ".wbc"):
        raise Misuse(f"cannot migrate {path}: permitted are WBC programs ({PROGRAM}) and M1486 programs")
