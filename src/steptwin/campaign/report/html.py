"""Common parts of pages of reports: one file each, which needs nothing else."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

STYLE = """
:root { color-scheme: light dark; --good: light-dark(#1a7f37, #57ab5a); --bad: light-dark(#cf222e, #f47067);
  --doubt: light-dark(#9a6700, #c69026); --note: light-dark(#0969da, #539bf5); --line: light-dark(#d0d7de, #444c56);
  --weak: light-dark(#59636e, #9198a1); --page: light-dark(#fff, #1c2128); }
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 78rem; padding: 0 1rem; background: var(--page); }
table { border-collapse: collapse; margin: .5rem 0 1.5rem; } .wide { overflow-x: auto; }
th, td { text-align: left; padding: .2rem .7rem; border-bottom: 1px solid var(--line); vertical-align: top; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
code { font: 13px ui-monospace, monospace; } small, .weak { color: var(--weak); } h2 { margin-top: 2rem; }
figure { margin: 0 1.5rem 1.5rem 0; display: inline-block; } figcaption { color: var(--weak); font-size: 13px; }
svg text { fill: currentColor; font: 11px system-ui, sans-serif; }
.big { font-size: 2rem; font-weight: 600; }
"""


def page(title: str, body: str, style: str = "") -> str:
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<meta name="viewport" content="width=device-width">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}{style}</style>\n</head>\n<body>\n<h1>{escape(title)}</h1>\n"
        f"{body}</body>\n</html>\n"
    )


def table(head: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """``head`` is text, cells are HTML; ``numbers`` are the columns that have numbers."""

    def row(tag: str, cells: Sequence[str]) -> str:
        classes = (' class="n"' if at in numbers else "" for at in range(len(cells)))
        return "".join(f"<{tag}{of}>{cell}</{tag}>" for of, cell in zip(classes, cells, strict=True))

    shown = "".join(f"<tr>{row('td', cells)}</tr>\n" for cells in rows)
    return f'<div class="wide"><table>\n<tr>{row("th", [escape(one) for one in head])}</tr>\n{shown}</table></div>\n'


def link(to: str, text: str) -> str:
    return f'<a href="{escape(to, quote=True)}">{escape(text)}</a>'
