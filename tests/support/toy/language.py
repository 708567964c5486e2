"""A language of files that only the tests know: each line is a target, in pulses."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager

from steptwin.diagnostics import Diagnostic, Severity, SourceText, Span
from steptwin.files.textfiles import read_text
from steptwin.languages import LANGUAGES, register
from steptwin.languages.contract import CheckReport, FileLanguage, GivenOptions, Print, count
from steptwin.languages.program_run import ProgramRun


class Targets(FileLanguage):
    name = "targets"
    title = "lists of targets"
    suffixes = (".targets",)

    def check(self, source: SourceText, options: GivenOptions) -> CheckReport:
        found = [
            Diagnostic("T1", Severity.ERROR, Span(place, place + len(word)), f"{word!r} is not a number")
            for word in source.text.split()
            if not word.isdecimal() and (place := source.text.index(word)) >= 0
        ]
        return CheckReport(found, {"targets": len(source.text.split())}, [count(len(source.text.split()), "target")])

    def run(self, given: ProgramRun, options: GivenOptions, out: Print, warn: Print) -> bool:
        targets = read_text(given.program).source.text.split()
        out(f"moves to {', '.join(targets)}")
        return bool(targets)


TARGETS = Targets()


@contextmanager
def registered_language() -> Generator[None]:
    """Commands take its files meanwhile."""
    register(TARGETS)
    try:
        yield
    finally:
        del LANGUAGES[TARGETS.name]
