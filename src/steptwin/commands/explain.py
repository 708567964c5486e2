"""Explanations of programs in files."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from steptwin.commands.check import CHECKERS, refuse_others
from steptwin.errors import Misuse
from steptwin.explain import m1486, mic488
from steptwin.explain.model import Explanation
from steptwin.explain.picture import picture
from steptwin.explain.plain import plain
from steptwin.explain.text import text
from steptwin.files.programfiles import CompanionFiles, check_source
from steptwin.files.textfiles import read_text, write_bytes
from steptwin.m1486 import lines, variants
from steptwin.wbc.dialect import DEFAULT, dialect_for

PROGRAM = ".prg"
JSON_VERSION = 1


@dataclass(frozen=True)
class ExplainOptions:
    """The options of the command line; None: not given."""

    variant: str | None = None
    interface: str | None = None
    positions: Path | None = None
    config: Path | None = None
    firmware: str | None = None


def explanations(path: Path, options: ExplainOptions) -> list[Explanation]:
    """One for each chip that the program is for. Raises `Misuse` for what is no program, or has errors."""
    suffix = path.suffix.lower()
    if suffix == ".wbc":
        raise Misuse(f"{path} is a compiled image: steptwin decompile makes a program of it")
    if suffix in CHECKERS and suffix != PROGRAM:
        raise Misuse(f"cannot explain {path}: permitted are WBC programs ({PROGRAM}) and M1486 programs")
    source = read_text(path).source
    if suffix != PROGRAM:
        refuse_others("M1486 programs", options, "variant", "interface")
        variant = variants.DEFAULT if options.variant is None else variants.variant(options.variant)
        interface = lines.STEP_DIRECTION if options.interface is None else lines.interface(options.interface)
        return m1486.explain(source, variant, interface)
    refuse_others("WBC programs", options, "positions", "config", "firmware")
    dialect = DEFAULT if options.firmware is None else dialect_for(options.firmware)
    files = CompanionFiles.of(path, options.positions, options.config)
    read = check_source(source, files.positions, files.config, dialect)
    return [mic488.explain(source, read.checked, read.config, dialect)]


def show(
    path: Path, options: ExplainOptions, output: Path | None, out: Callable[[str], object], *, as_json: bool = False
) -> None:
    """Print the explanation, or write the picture of the control flow to ``output``. Raises `Misuse`."""
    if output is not None and output.suffix.lower() != ".svg":
        raise Misuse(f"cannot write {output}: permitted is FILE.svg")
    found = explanations(path, options)
    if output is not None:
        write_bytes(output, picture(found).encode())
    if as_json:
        data = {"version": JSON_VERSION, "file": str(path), "programs": [plain(one) for one in found]}
        out(json.dumps(data, ensure_ascii=False, indent=2))
    elif output is None:
        out("\n".join(text(one) for one in found).rstrip("\n"))
    else:
        out(f"{output}: {_blocks(found)}")


def _blocks(found: Sequence[Explanation]) -> str:
    count = sum(len(one.blocks) for one in found)
    return f"{count} block{'' if count == 1 else 's'}"
