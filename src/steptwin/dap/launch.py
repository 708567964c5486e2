"""The world that an editor wants to debug, from the arguments of ``launch``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import steptwin.services  # noqa: F401  their tables are checked, too
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.languages import LANGUAGES, language_for
from steptwin.languages.contract import FileLanguage, GivenOptions, Print
from steptwin.nearmiss import NearMiss

OPTIONS: Mapping[str, type] = {"positions": Path, "config": Path, "variant": str}
"""Arguments that are options of the language of the program."""
ARGUMENTS: Mapping[str, type] = {
    "program": Path, "world": Path, "stopOnEntry": bool, "stopAtEnd": bool, "noDebug": bool, **OPTIONS,
}  # fmt: skip
"""Arguments of our own, and the type of each; editors add others."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Launch:
    """The arguments of ``launch``."""

    program: Path | None
    world: Path | None
    options: GivenOptions
    stop_on_entry: bool
    stop_at_end: bool
    """Stand at the end of the program, from where one can go back, instead of ending the session."""
    no_debug: bool

    @property
    def folder(self) -> Path:
        """Names of files in the world begin here."""
        return Path() if self.world is None else self.world.parent


def read_launch(arguments: Mapping[str, Any]) -> Launch:
    """Raises `Misuse` for what is missing, or of another type."""
    given: dict[str, Any] = {}
    for name, kind in ARGUMENTS.items():
        value = arguments.get(name)
        if value is not None and not isinstance(value, bool if kind is bool else str):
            raise Misuse(f"launch: {name} = {value!r}: expected {'true or false' if kind is bool else 'a text'}")
        if value:
            given[name] = kind(value)
    if "program" not in given and "world" not in given:
        near = NearMiss()
        hints = [f"{name!r}{hint}" for name in arguments if name not in ARGUMENTS and (hint := near.hint(name, ARGUMENTS))]
        suffixes = [suffix for one in LANGUAGES.values() if one.offers(FileLanguage.world) for suffix in one.suffixes]
        needed = f"launch: give 'program' ({', '.join(suffixes)}) or 'world' (.toml)"
        raise Misuse(f"{needed}{': ' + ', '.join(hints) if hints else ''}")
    return Launch(
        program=given.get("program"),
        world=given.get("world"),
        options={name: given[name] for name in OPTIONS if name in given},
        stop_on_entry="stopOnEntry" in given,
        stop_at_end="stopAtEnd" in given,
        no_debug="noDebug" in given,
    )


def open_world(asked: Launch, show: Print) -> World:
    """``show`` gets what a person should know: files that were found, warnings. Raises `Misuse`, and `SourceErrors`."""
    if asked.world is not None:
        if asked.options:
            raise Misuse(f"launch: {' and '.join(asked.options)} cannot be given with a world, which names its own")
        return World.load(asked.world, keep_trace=False, keep_inputs=False)
    program = asked.program
    if program is None:
        raise Misuse("launch: there is no program")
    language = language_for(program, "debug", FileLanguage.world)
    language.refuse_others(asked.options, lambda name: f"launch: {name}")
    text, files = language.world(program, asked.options, show)
    return World.from_toml(text, files, name=f"debug {program}", keep_trace=False, keep_inputs=False)
