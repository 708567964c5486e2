"""Coverage as one HTML file with the sources, which needs nothing else."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

from steptwin.coverage.counts import Coverage, Summary, TextCoverage
from steptwin.coverage.missing import missed_ways
from steptwin.coverage.table import percent_text
from steptwin.diagnostics import split_lines

_STYLE = """
:root { color-scheme: light dark; --run: light-dark(#1a7f37, #57ab5a); --miss: light-dark(#cf222e, #e5534b);
  --part: light-dark(#9a6700, #c69026); --line: light-dark(#d0d7de, #444c56); --weak: light-dark(#59636e, #9198a1); }
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 72rem; padding: 0 1rem; }
table { border-collapse: collapse; } th, td { text-align: right; padding: .2rem .8rem; border-bottom: 1px solid var(--line); }
th:first-child, td:first-child { text-align: left; padding-left: 0; }
ol { font: 13px/1.55 ui-monospace, monospace; list-style: none; padding: 0; overflow-x: auto; }
li { display: flex; border-left: 4px solid transparent; white-space: pre; tab-size: 4; }
li > span { flex: none; width: 4rem; text-align: right; color: var(--weak); padding-right: 1rem; }
.run { border-color: var(--run); } .miss { border-color: var(--miss); } .part { border-color: var(--part); }
.miss, .part { background: color-mix(in srgb, var(--miss) 10%, transparent); }
.part { background: color-mix(in srgb, var(--part) 12%, transparent); }
em { color: var(--part); font-style: normal; padding-left: 2rem; }
p b { border-left: 4px solid; padding: 0 1rem 0 .4rem; font-weight: normal; background: none; }
"""


def page(coverage: Coverage) -> str:
    texts = list(coverage)
    rows = [_row(f'<a href="#text{at}">{escape(text.path)}</a>', text.summary) for at, text in enumerate(texts)]
    rows.append(_row("all", coverage.summary))
    names = ("file", "statements", "missed", "branches", "missed", "percent")
    head = "".join(f'<th scope="col">{name}</th>' for name in names)
    sections = "".join(f'<h2 id="text{at}">{escape(text.path)}</h2>\n{_source(text)}' for at, text in enumerate(texts))
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width">\n<title>Coverage of programs</title>\n'
        f"<style>{_STYLE}</style>\n</head>\n<body>\n<h1>Coverage of programs</h1>\n"
        f"<table>\n<tr>{head}</tr>\n{''.join(rows)}</table>\n"
        '<p><b class="run">executed</b><b class="part">partly executed</b><b class="miss">not executed</b></p>\n'
        f"{sections}</body>\n</html>\n"
    )


def _row(name: str, summary: Summary) -> str:
    cells = "".join(f"<td>{value}</td>" for value in (*summary, f"{percent_text(summary)} %"))
    return f"<tr><td>{name}</td>{cells}</tr>\n"


def _source(text: TextCoverage) -> str:
    return f"<ol>\n{''.join(_lines(text))}</ol>\n"


def _lines(text: TextCoverage) -> Iterator[str]:
    notes: dict[int, list[str]] = {}
    for way in missed_ways(text):
        target = text.line_of(way.target)
        to = "the end" if target is None else f"line {target}"
        notes.setdefault(text.statements[way.origin].line, []).append(f"never to {to}")
    starts = text.lines
    for line, (shown, _) in enumerate(split_lines(text.source.text), start=1):
        count = text.hits[starts[line]] if line in starts else None
        state = "" if count is None else "miss" if count == 0 else "part" if line in notes else "run"
        note = f"<em>{', '.join(notes[line])}</em>" if line in notes else ""
        shown_count = "" if count is None else count
        yield f'<li class="{state}"><span>{line}</span><span>{shown_count}</span><code>{escape(shown)}</code>{note}</li>\n'
