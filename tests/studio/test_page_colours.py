"""Colours of the page, light and dark: what is written can be read on whatever it is written on."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

CSS = (Path(__file__).parents[2] / "studio-web/src/app.css").read_text(encoding="utf-8")
INKS = ("ink", "dim", "accent", "good", "warn", "danger", *(f"trace-{number}" for number in range(1, 9)))
GROUNDS = ("paper", "panel", "raised", "chosen")
"""Grounds of running text; the program has its line of now on `chosen`."""
LEAST = 4.5
"""WCAG 2.2, 1.4.3."""


def luminance(colour: str) -> float:
    """Relative luminance of a colour of sRGB, as WCAG defines it."""
    parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(first: str, second: str) -> float:
    darker, lighter = sorted((luminance(first), luminance(second)))
    return (lighter + 0.05) / (darker + 0.05)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_texts_can_be_read(theme: str) -> None:
    rules = re.findall(r":root(?:\[data-theme=\"dark\"\])? \{(.*?)\}", CSS, re.DOTALL)
    light, dark = (dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6});", rule)) for rule in rules[:2])
    colours = light if theme == "light" else light | dark
    pairs = {(ink, ground): contrast(colours[ink], colours[ground]) for ink in INKS for ground in GROUNDS}
    assert {pair: ratio for pair, ratio in pairs.items() if ratio < LEAST} == {}
