"""The table of what the vendors' programs do: the panels, words and commands it names exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from steptwin.cli import COMMANDS

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs/vendor-programs.md"
PANELS = ROOT / "studio-web/src/panels"
SHARED = set(re.findall(r'^  \w+: "([^"]+)"', (ROOT / "studio-web/src/text/en.ts").read_text("utf-8"), re.MULTILINE))
FUNCTIONS = 30
"""At least; those of three programs."""


def rows() -> list[tuple[str, str]]:
    """Function, and where it is here."""
    cells = [line.strip("|").split("|") for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("| ")]
    return [(row[0].strip(), row[1].strip()) for row in cells if row[0].strip() != "function"]


def panels() -> dict[str, str]:
    """English texts of panels, by their title."""
    found: dict[str, str] = {}
    for file in PANELS.glob("*/text.ts"):
        english = file.read_text(encoding="utf-8").split("\n  {", 2)[1]
        title = re.search(r'title: "([^"]+)"', english)
        assert title is not None, file
        found[title[1]] = english
    return found


def test_there_is_a_place_for_every_function() -> None:
    found = rows()
    assert len(found) >= FUNCTIONS
    assert [function for function, where in found if not where] == []
    assert len({function for function, _ in found}) == len(found)


@pytest.mark.parametrize(("function", "where"), rows())
def test_what_a_row_names_exists(function: str, where: str) -> None:
    there = panels()
    for part in where.split(";"):
        named = re.findall(r"\*\*([^*]+)\*\*", part)
        assert set(named) <= set(there), part
        for word in re.findall(r'"([^"]+)"', part):
            assert any(f'"{word}"' in there[panel] for panel in named) or word in SHARED, f"{word} is on none of {named}"
    commands = {name for group in COMMANDS.values() for name in group}
    assert set(re.findall(r"`steptwin (\S+?)`", where)) <= commands
    assert [target for target in re.findall(r"\]\(([^)#]+)", where) if not (ROOT / "docs" / target).exists()] == []
