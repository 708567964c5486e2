"""``steptwin explain``: what a program does, as far as its text shows.

From Python: `steptwin.explain.mic488.explain`, `steptwin.explain.m1486.explain`.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from steptwin.cli.device import Json
from steptwin.cli.languageoptions import M1486FileOptions, WbcFileOptions, given_of
from steptwin.cli.optiongroups import grouped
from steptwin.cli.writtenfiles import written
from steptwin.errors import Misuse
from steptwin.options import option_of

if TYPE_CHECKING:
    from steptwin.explain.model import Explanation
    from steptwin.languages.contract import GivenOptions

JSON_VERSION = 1


@grouped
def command(
    file: Annotated[Path, typer.Argument(help="WBC program (.prg) or M1486 program.")],
    output: Annotated[
        Path | None, written("--output", "-o", help="A picture of the control flow: FILE.svg, instead of the text.")
    ] = None,
    json: Json = False,
    *,
    wbc: WbcFileOptions,
    chip: M1486FileOptions,
) -> None:
    """Explain a program without running it: control flow, durations, memory, inputs and outputs, where it can wait for ever.

    Also loops that it never leaves, interrupts that can be lost, and lines that are never reached.
    """
    _show(file, given_of(wbc, chip), option_of, output, typer.echo, as_json=json)


def explanations(path: Path, given: GivenOptions, option: Callable[[str], str] = str) -> list[Explanation]:
    """One for each controller that the program is for. Raises `Misuse` for what is no program, or has errors, and for an option
    that is not for its language, with the name that users know it by."""
    from steptwin.files.textfiles import read_text
    from steptwin.languages import language_for
    from steptwin.languages.contract import FileLanguage

    language = language_for(path, "explain", FileLanguage.explain)
    language.refuse_others(given, option)
    return language.explain(read_text(path).source, given)


def _show(
    path: Path,
    given: GivenOptions,
    option: Callable[[str], str],
    output: Path | None,
    out: Callable[[str], object],
    *,
    as_json: bool = False,
) -> None:
    """Print the explanation, or write the picture of the control flow to ``output``. Raises `Misuse`."""
    from steptwin.explain.jsondata import to_json
    from steptwin.explain.picture import picture
    from steptwin.explain.text import text
    from steptwin.files.textfiles import write_bytes
    from steptwin.files.writing import is_written_directly

    if output is not None and output.suffix.lower() != ".svg" and not is_written_directly(output):
        raise Misuse(f"cannot write {output}: permitted is FILE.svg")
    found = explanations(path, given, option)
    if output is not None:
        write_bytes(output, picture(found).encode())
    if as_json:
        data = {"version": JSON_VERSION, "file": str(path), "programs": [to_json(one) for one in found]}
        out(json.dumps(data, ensure_ascii=False, indent=2))
    elif output is None:
        out("\n".join(text(one) for one in found).rstrip("\n"))
    else:
        out(f"{output}: {_blocks(found)}")


def _blocks(found: Sequence[Explanation]) -> str:
    from steptwin.languages.contract import count

    return count(sum(len(one.blocks) for one in found), "block")
