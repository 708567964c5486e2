"""Actions of commands on the files of a language: one value for each, in `steptwin.languages`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from steptwin.diagnostics import Diagnostic, SourceText
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.explain.model import Explanation
    from steptwin.languages.program_run import ProgramRun

Print: TypeAlias = Callable[[str], None]
GivenOptions: TypeAlias = Mapping[str, Any]
"""Values of the options that were given, by name, as `steptwin.cli.languageoptions` types them."""


@dataclass(frozen=True)
class CheckReport:
    """The result of a checker: findings, further members of the JSON, further lines of the text.

    ``companions``: the other files that were read, with their findings.
    """

    diagnostics: list[Diagnostic]
    data: dict[str, Any] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)
    companions: list[tuple[SourceText, list[Diagnostic]]] = field(default_factory=list)


@dataclass(frozen=True)
class Migration:
    """``text`` is the program with the fixes; ``left`` the errors that it has for the new type."""

    title: str
    differences: list[str]
    findings: list[Diagnostic]
    text: str
    left: list[Diagnostic]


class ProgramWorld(NamedTuple):
    """A world in which a single program runs: its description, and the files that it names."""

    text: str
    files: Mapping[str, bytes]


@dataclass(frozen=True, slots=True, kw_only=True)
class FileLanguage:
    """A language of files. What is None, its files cannot; the command refuses them. All functions raise `Misuse`."""

    name: str
    """In JSON: ``language``."""
    title: str
    """Its files, for messages: ``WBC programs``."""
    suffixes: Sequence[str]
    """In small letters."""
    is_usual: bool = False
    """Whether files with unknown suffixes are in this language, too, unless they are run."""
    options: frozenset[str] = frozenset()
    """Names of the options that apply to its files; others are refused."""
    not_text: str = ""
    """Advice on its files, which are no text, as the end of a message."""
    check: Callable[[SourceText, GivenOptions], CheckReport] | None = None
    explain: Callable[[SourceText, GivenOptions], list[Explanation]] | None = None
    """An explanation for each controller that the program is for."""
    migrate: Callable[[SourceText, str, str | None], Migration] | None = None
    """To a type or firmware, from another one or the usual one."""
    format: Callable[[str], str] | None = None
    """The text in one style."""
    run: Callable[[ProgramRun, GivenOptions, Print, Print], bool] | None = None
    """Run a program to its end and print what it did; the second function gets findings of the checker. Whether no error
    occurred."""
    world: Callable[[Path, GivenOptions, Print], ProgramWorld] | None = None
    """The world for a debugger; the function shows what a person should know."""

    @property
    def shown(self) -> str:
        """``WBC programs (.prg)``."""
        return f"{self.title} ({', '.join(self.suffixes)})"

    def refuse_others(self, given: GivenOptions, option: Callable[[str], str]) -> None:
        """Raises `Misuse` for an option of another language, under the name that users know."""
        for name in given:
            if name not in self.options:
                raise Misuse(f"{option(name)} is not for {self.title}")


def count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def fixed(text: str, found: Sequence[Diagnostic]) -> str:
    """The text with all fixes; of two at one place the first."""
    parts: list[str] = []
    end = 0
    for fix in sorted((d.fix for d in found if d.fix is not None), key=lambda fix: fix.span):
        if fix.span.start >= end:
            parts += [text[end : fix.span.start], fix.text]
            end = fix.span.end
    return "".join((*parts, text[end:]))
