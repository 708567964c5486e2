"""Reference tables as text, JSON or Markdown."""

from __future__ import annotations

import enum
import json
from collections.abc import Sequence
from dataclasses import dataclass

import typer

from steptwin.columns import aligned


class PageFormat(enum.StrEnum):
    TEXT = "text"
    JSON = "json"
    MD = "md"


@dataclass(frozen=True)
class PageSection:
    title: str
    columns: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]


def show(sections: Sequence[PageSection], form: PageFormat) -> None:
    """Print tables."""
    if form is PageFormat.JSON:
        data = {s.title: [dict(zip(s.columns, row, strict=True)) for row in s.rows] for s in sections}
        typer.echo(json.dumps(data, ensure_ascii=False, indent=2))
    else:
        typer.echo("\n".join(_markdown(s) if form is PageFormat.MD else _text(s) for s in sections), nl=False)


def _text(section: PageSection) -> str:
    return "\n".join((section.title, "", *aligned([section.columns, *section.rows]), ""))


def _markdown(section: PageSection) -> str:
    # Keys like * or \ are code on a page, where only | needs an escape; the first column names the row in every table.
    pipes = [[cell.replace("|", "\\|") for cell in row] for row in section.rows]
    rows = [(f"`{first}`", *(cell.replace("*", "\\*") for cell in others)) for first, *others in pipes]
    lines = [section.columns, ("---",) * len(section.columns), *rows]
    return f"## {section.title}\n\n" + "".join(f"| {' | '.join(line)} |\n" for line in lines)
