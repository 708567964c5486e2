"""The world that an editor wants to debug, from the arguments of ``launch``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from steptwin.commands.chips import Chain, check_chain
from steptwin.commands.run_m1486 import describe_chips
from steptwin.commands.run_wbc import WbcRun, prepare
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.inputfiles import read_bytes
from steptwin.m1486.chip import OPEN_ADDRESS
from steptwin.m1486.lines import STEP_DIRECTION
from steptwin.m1486.variants import DEFAULT, variant
from steptwin.nearmiss import NearMiss

CHIP_SUFFIX = ".m1486"
#: Arguments of our own, and the type of each; editors add others.
ARGUMENTS: Mapping[str, type] = {
    "program": str, "positions": str, "config": str, "variant": str, "world": str, "stopOnEntry": bool, "stopAtEnd": bool,
    "noDebug": bool,
}  # fmt: skip
Print = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Launch:
    """The arguments of ``launch``."""

    program: Path | None
    positions: Path | None
    config: Path | None
    variant: str | None
    world: Path | None
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
    for name, kind in ARGUMENTS.items():
        value = arguments.get(name)
        if value is not None and not isinstance(value, kind):
            raise Misuse(f"launch: {name} = {value!r}: expected {'a text' if kind is str else 'true or false'}")
    paths = {name: Path(arguments[name]) if arguments.get(name) else None for name in ("program", "positions", "config", "world")}
    if paths["program"] is None and paths["world"] is None:
        near = NearMiss()
        hints = [f"{name!r}{hint}" for name in arguments if name not in ARGUMENTS and (hint := near.hint(name, ARGUMENTS))]
        raise Misuse(f"launch: give 'program' (.prg, .wbc, .m1486) or 'world' (.toml){': ' + ', '.join(hints) if hints else ''}")
    return Launch(
        **paths,
        variant=arguments.get("variant"),
        stop_on_entry=bool(arguments.get("stopOnEntry")),
        stop_at_end=bool(arguments.get("stopAtEnd")),
        no_debug=bool(arguments.get("noDebug")),
    )


def open_world(asked: Launch, show: Print) -> World:
    """``show`` gets what a person should know: files that were found, warnings. Raises `Misuse`, and `SourceErrors`."""
    if asked.world is not None:
        given = {"positions": asked.positions, "config": asked.config, "variant": asked.variant}
        refused = [name for name, value in given.items() if value is not None]
        if refused:
            raise Misuse(f"launch: {' and '.join(refused)} cannot be given with a world, which names its own")
        return World.load(asked.world, keep_trace=False, keep_inputs=False)
    program = asked.program
    if program is None:
        raise Misuse("launch: there is no program")
    if program.suffix.lower() == CHIP_SUFFIX:
        return _chip(asked, program)
    if asked.variant is not None:
        raise Misuse(f"launch: variant = {asked.variant!r}: only programs of an M1486 ({CHIP_SUFFIX}) have one")
    given = prepare(WbcRun(program=program, positions=asked.positions, config=asked.config), show)
    if given.companions.found:
        show(str(given.companions))
    files = {str(path): read_bytes(path) for path in given.paths}
    return _world(given.describe(str), files, program)


def _chip(asked: Launch, program: Path) -> World:
    if asked.positions is not None or asked.config is not None:
        raise Misuse("launch: positions and config are of a MIC488; a program of an M1486 has none")
    kind = DEFAULT if asked.variant is None else variant(asked.variant)
    chain = Chain(variant=kind, addresses=[OPEN_ADDRESS], interface=STEP_DIRECTION, wires=[])
    check_chain(chain, has_program=True)
    text = describe_chips(chain, program.stem, program, [], [])
    return _world(text, {str(program): read_bytes(program)}, program)


def _world(text: str, files: Mapping[str, bytes], program: Path) -> World:
    return World.from_toml(text, files, name=f"debug {program}", keep_trace=False, keep_inputs=False)
