"""The interface of commands to the files of a language: one `FileLanguage` for each, in `steptwin.languages`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from steptwin.diagnostics import Diagnostic, SourceText
from steptwin.errors import Misuse
from steptwin.optionalmethods import OptionalMethods

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


class FileLanguage(OptionalMethods, ABC):
    """A language of files: one object of one class. A command refuses files whose language does not offer its method. All methods
    raise `Misuse`."""

    @property
    @abstractmethod
    def name(self) -> str:
        """In JSON: ``language``."""

    @property
    @abstractmethod
    def title(self) -> str:
        """Its files, for messages: ``WBC programs``."""

    @property
    @abstractmethod
    def suffixes(self) -> Sequence[str]:
        """In small letters."""

    is_usual: bool = False
    """Whether files with unknown suffixes are in this language, too, unless they are run."""
    options: frozenset[str] = frozenset()
    """Names of the options that apply to its files; others are refused."""
    not_text: str = ""
    """Advice on its files, which are no text, as the end of a message."""

    def check(self, source: SourceText, options: GivenOptions, /) -> CheckReport:
        raise NotImplementedError

    def explain(self, source: SourceText, options: GivenOptions, /) -> list[Explanation]:
        """An explanation for each controller that the program is for."""
        raise NotImplementedError

    def migrate(self, source: SourceText, to: str, old: str | None, /) -> Migration:
        """To a type or firmware, from another one or the usual one."""
        raise NotImplementedError

    def format(self, text: str, /) -> str:
        """The text in one style."""
        raise NotImplementedError

    def run(self, given: ProgramRun, options: GivenOptions, out: Print, warn: Print, /) -> bool:
        """Run a program to its end and print what it did; ``warn`` gets findings of the checker. Whether no error occurred."""
        raise NotImplementedError

    def world(self, program: Path, options: GivenOptions, show: Print, /) -> ProgramWorld:
        """The world for a debugger; ``show`` gets what a person should know."""
        raise NotImplementedError

    @property
    def description(self) -> str:
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
