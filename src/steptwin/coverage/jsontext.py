"""Coverage as JSON, for programs."""

from __future__ import annotations

import json
from typing import Any

from steptwin.coverage.counts import Coverage, Summary, TextCoverage
from steptwin.coverage.missing import missed_lines

JSON_VERSION = 1


def json_text(coverage: Coverage) -> str:
    data = {"version": JSON_VERSION, "summary": _summary(coverage.summary), "files": [_file(text) for text in coverage]}
    return json.dumps(data, ensure_ascii=False, indent=2) + "\n"


def _summary(summary: Summary) -> dict[str, Any]:
    return {**summary._asdict(), "percent": round(summary.percent, 2)}


def _file(text: TextCoverage) -> dict[str, Any]:
    return {
        "path": text.path,
        "summary": _summary(text.summary),
        "missing_lines": missed_lines(text),
        "statements": [{**_place(text, start), "count": text.hits[start]} for start in sorted(text.statements)],
        "branches": [
            {**_place(text, way.origin), "to_line": text.line_of(way.target), "count": text.taken[way]} for way in text.ways
        ],
    }


def _place(text: TextCoverage, start: int) -> dict[str, int]:
    line, column = text.source.position(start)
    return {"line": line, "column": column}
