"""The configuration file of a controller as a form: sections and settings with meaning, unit and range, whatever its kind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Protocol

from steptwin.datasheet import Datasheet, Limits
from steptwin.diagnostics import Diagnostic, SourceText


@dataclass(frozen=True, slots=True, kw_only=True)
class ConfigurationKey:
    """A key of the file."""

    name: str
    """The vendor's spelling: ``MotResol``."""
    meaning: str
    unit: str
    text: Annotated[str, "As it is written; empty where it is not in the file."]
    value: float
    """The value; the default where the key is missing or its value is wrong."""
    default: float
    limits: Limits
    is_whole: bool
    choices: Mapping[int, str]
    """Texts of the values, where there are few of them."""
    point: Annotated[str, "The point that has it at run time; empty without one."] = ""
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    name: str
    """``Axis0``."""
    title: str
    """Title of the section: ``M1``."""
    settings: tuple[ConfigurationKey, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """A configuration file as a form: its sections, keys and values."""

    source: SourceText
    sections: tuple[Section, ...]
    diagnostics: Sequence[Diagnostic]
    points: Mapping[str, float]
    """The values to write to points so that a running controller has those of the file; in its present units. Keys that are not
    in the file have none, and neither have those whose values cannot be converted into these units."""


class ConfigurationFormat(Protocol):
    """How the configuration file of a kind of controllers becomes a form. Both raise `Misuse`."""

    def form(self, text: str, name: str, sheet: Datasheet) -> Form: ...

    def with_values(self, text: str, name: str, changes: Mapping[str, str]) -> str:
        """A text with other values of its settings."""
        ...

    def known(self, values: Mapping[str, tuple[float | None, str]], sheet: Datasheet) -> Mapping[str, str]:
        """The settings that a running controller shows, as changes for `with_values`. ``values``: of points (None: unknown),
        with their units."""
        ...
