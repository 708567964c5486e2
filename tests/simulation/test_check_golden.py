"""What is told of wrong descriptions, with places, hints and repairs: golden/wrong.txt.

Regenerate with ``make golden ARGS=tests/simulation/test_check_golden.py`` and read the diff. A case is ``=== title``, the
description, ``---``, the findings (`golden_findings`). ``@ name`` begins a file that the description names.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from golden_findings import shown

from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse
from steptwin.simulation.world.check import diagnose

GOLDEN = Path(__file__).parent / "golden" / "wrong.txt"
CASE, RESULT = "=== ", "---\n"
FILE = re.compile(r"^@ (.+)\n", re.MULTILINE)


def found(text: str) -> str:
    description, *named = FILE.split(text)
    files = dict(zip(named[::2], named[1::2], strict=True))

    def read(name: str) -> bytes:
        if name not in files:
            raise Misuse(f"{name}: no such file")
        return files[name].encode()

    diagnosis = diagnose("w.toml", description, read)
    parts = [shown(SourceText("w.toml", description), diagnosis.findings)]
    parts += [f"{source.name}:\n{shown(source, of)}" for source, of in diagnosis.files if of]
    return "\n".join(parts)


def cases() -> list[tuple[str, str, str]]:
    """Title, description with files, findings."""
    read = []
    for part in GOLDEN.read_text(encoding="utf-8").split(CASE)[1:]:
        title, _, body = part.partition("\n")
        text, _, expected = body.partition(RESULT)
        read.append((title, text, expected.strip("\n")))
    return read


@pytest.mark.parametrize(("title", "text", "expected"), cases(), ids=[case[0] for case in cases()])
def test_what_is_told_of_a_wrong_description_is_the_reviewed(title: str, text: str, expected: str) -> None:
    assert found(text) == expected


if __name__ == "__main__":
    head = GOLDEN.read_text(encoding="utf-8").split(CASE)[0]
    GOLDEN.write_text(
        head + "\n".join(f"{CASE}{title}\n{text}{RESULT}{found(text)}\n" for title, text, _ in cases()), encoding="utf-8"
    )
