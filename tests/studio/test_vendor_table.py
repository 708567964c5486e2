"""The table of the vendors' programs names panels, buttons and commands that exist (docs/vendor-programs.md)."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from steptwin.cli import GROUPS

ROOT = Path(__file__).parents[2]
TABLE = (ROOT / "docs/vendor-programs.md").read_text("utf-8")
PANELS = ROOT / "studio-web/src/panels"
SHARED = set(re.findall(r'^  \w+: "([^"]+)"', (ROOT / "studio-web/src/text/en.ts").read_text("utf-8"), re.MULTILINE))
COMMANDS = {name for group in GROUPS.values() for name in group}
NAMED = re.compile(r"\*\*(?P<panel>[^*]+)\*\*(?P<rest>[^*`;|]*)")


TEXT = re.compile(r'^    (\w+):\s+"((?:[^"\\]|\\.)*)"', re.MULTILINE)


def texts_of(folder: Path) -> dict[str, str]:
    """What stands on a panel in English."""
    english, _, _polish = (folder / "text.ts").read_text("utf-8").partition("\n  {\n")[2].partition("\n  {\n")
    return dict(TEXT.findall(english))


PANEL_TEXTS = {texts["title"]: set(texts.values()) for texts in map(texts_of, filter(Path.is_dir, PANELS.iterdir()))}


@pytest.mark.parametrize("row", re.findall(r"^\| (?!function|---)(.+) \|$", TABLE, re.MULTILINE))
def test_what_a_row_names_is_there(row: str) -> None:
    function, _, place = row.partition(" | ")
    assert place, function
    for found in NAMED.finditer(place):
        named = set(re.findall(r'"([^"]+)"', found["rest"]))
        assert named <= PANEL_TEXTS[found["panel"]] | SHARED, (function, found["panel"])
    for command in re.findall(r"`steptwin (\w+)", place):
        assert command in COMMANDS, command
