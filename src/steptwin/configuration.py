"""The configuration file of a controller as a form: sections and settings with meaning, unit and range, whatever its kind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from steptwin.datasheet import Limits
from steptwin.diagnostics import Diagnostic, SourceText


@dataclass(frozen=True, slots=True, kw_only=True)
class ConfigurationKey:
    """A key of the file."""

    name: str
    """As the vendor writes it: ``MotResol``."""
    meaning: str
    unit: str
    text: str
    """As it is written; empty where it is not in the file."""
    value: float
    """What it is; the default where it is not in the file, or wrong there."""
    default: float
    limits: Limits
    is_whole: bool
    choices: Mapping[int, str]
    """Texts of the values, where there are few of them."""
    point: str = ""
    """The point of the data sheet that has it at run time; empty without one."""
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    name: str
    """``Axis0``."""
    title: str
    """What it is about: ``M1``."""
    settings: tuple[ConfigurationKey, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """A file with what is in it."""

    source: SourceText
    sections: tuple[Section, ...]
    diagnostics: Sequence[Diagnostic]
    points: Mapping[str, float]
    """What would be written to points, so that a running controller has the values of the file; in its present units."""
