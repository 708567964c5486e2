"""Options of commands that take files of several languages: a group for each that has options of its own
(`steptwin.languages.contract.FileLanguage.options`)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from steptwin.options import Option, OptionGroup


@dataclass(frozen=True, kw_only=True)
class WbcFileOptions(OptionGroup):
    heading = "Options of MIC488 programs"

    positions: Annotated[Path | None, Option("Position table. Default: the .csv of the same name.")] = None
    config: Annotated[Path | None, Option("Configuration. Default: the .cfg of the same name.")] = None
    firmware: Annotated[str | None, Option("1.23, 1.40 or 1.70. Default 1.70.", completion="firmwares")] = None


@dataclass(frozen=True, kw_only=True)
class M1486FileOptions(OptionGroup):
    heading = "Options of M1486 programs"

    variant: Annotated[
        str | None,
        Option("Type A, B, C, E1, E2, or A2x and so on. Default A.", completion="variants"),
    ] = None
    interface: Annotated[str | None, Option("Driver interface sd, dual or two. Default sd.")] = None


def given_of(*groups: OptionGroup) -> dict[str, Any]:
    """The options that were given, by name."""
    return {name: value for group in groups for name, value in group.given().items()}
