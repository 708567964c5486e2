"""Explanations of programs in files."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

from steptwin.errors import Misuse
from steptwin.explain.model import Explanation
from steptwin.explain.picture import picture
from steptwin.explain.plain import plain
from steptwin.explain.text import text
from steptwin.files.textfiles import read_text, write_bytes
from steptwin.files.writing import is_written_directly
from steptwin.languages import ability
from steptwin.languages.contract import GivenOptions, count

JSON_VERSION = 1


def explanations(path: Path, given: GivenOptions, option: Callable[[str], str] = str) -> list[Explanation]:
    """One for each controller that the program is for. Raises `Misuse` for what is no program, or has errors, and for an option
    that is not for its language, with the name that users know it by."""
    language, explain = ability(path, "explain", lambda one: one.explain)
    language.refuse_others(given, option)
    return explain(read_text(path).source, given)


def show(
    path: Path,
    given: GivenOptions,
    option: Callable[[str], str],
    output: Path | None,
    out: Callable[[str], object],
    *,
    as_json: bool = False,
) -> None:
    """Print the explanation, or write the picture of the control flow to ``output``. Raises `Misuse`."""
    if output is not None and output.suffix.lower() != ".svg" and not is_written_directly(output):
        raise Misuse(f"cannot write {output}: permitted is FILE.svg")
    found = explanations(path, given, option)
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
    return count(sum(len(one.blocks) for one in found), "block")
