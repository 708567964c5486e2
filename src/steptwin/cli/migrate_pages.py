"""Programs for another type of M1486, or another firmware of the MIC488."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from steptwin.diagnostics import SourceText, render, to_json
from steptwin.files.textfiles import read_text, write_bytes
from steptwin.languages import ability
from steptwin.languages.contract import count


def migrate(
    path: Path, to: str, old: str | None, output: Path | None, out: Callable[[str], object]
) -> tuple[bool, dict[str, Any]]:
    """Print what has to change, write the changed program to ``output``. Returns whether it fits then, and the report as data.
    Raises `Misuse` for what is no program."""
    _, adapt = ability(path, "migrate", lambda one: one.migrate)
    file = read_text(path)
    found = adapt(file.source, to, old)
    if output is not None:
        write_bytes(output, file.to_bytes(found.text))
    changes = sum(d.fix is not None for d in found.findings)
    changed = SourceText(str(output or path), found.text)
    out(f"{path}: {found.title}")
    for sentence in found.differences:
        out(f"  {sentence}")
    if found.findings:
        out(render(file.source, found.findings))
    out(f"{count(changes, 'change')}{'' if output is None else f', written to {output}'}; errors left: {len(found.left)}")
    if found.left:
        out(render(changed, found.left))
    return not found.left, {
        "version": 1,
        "file": str(path),
        "title": found.title,
        "differences": found.differences,
        "diagnostics": to_json(file.source, found.findings),
        "errors_left": to_json(changed, found.left),
        "text": found.text,
    }
