"""The reports of coverage. That of lcov is read by a parser written from the section FILES of geninfo(1)."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass, field
from html.parser import HTMLParser

from steptwin.coverage.counts import END, Coverage, TextCoverage, Way
from steptwin.coverage.jsontext import json_text
from steptwin.coverage.lcov import lcov
from steptwin.coverage.page import page
from steptwin.coverage.table import table
from steptwin.diagnostics import SourceText
from steptwin.simulation.kinds.programs import Statement

TEXT = "a\n; <comment>\nb\nc & d\n\ne\n"
STARTS = {1: 0, 3: 14, 4: 16, 6: 23}
"""Where the statements of `TEXT` begin, by line."""


def text(path: str = "p.prg", hits: tuple[int, ...] = (5, 5, 0, 0), to_3: int = 5) -> TextCoverage:
    """Line 1 goes to line 3 or to the end, line 4 to line 6 or to the end."""
    starts = list(STARTS.values())
    statements = {start: Statement(start, start + 1, line) for line, start in STARTS.items()}
    after: dict[int, tuple[int, ...]] = {0: (14, END), 14: (16,), 16: (23, END), 23: (END,)}
    counts = Counter({start: count for start, count in zip(starts, hits, strict=True) if count})
    return TextCoverage(path, SourceText(path, TEXT), statements, after, counts, Counter({Way(0, 14): to_3}))


@dataclass
class Section:
    """A section of a tracefile."""

    lines: dict[int, int] = field(default_factory=dict)
    branches: dict[tuple[int, int, int], int | None] = field(default_factory=dict)
    totals: dict[str, int] = field(default_factory=dict)


def read_tracefile(content: str) -> dict[str, Section]:
    """By source file. Any record that geninfo(1) does not have, or has in another form, is an error here."""
    found: dict[str, Section] = {}
    section: Section | None = None
    for line in content.splitlines():
        key, _, value = line.partition(":")
        if key == "SF":
            assert section is None
            section = found[value] = Section()
        elif key == "end_of_record":
            assert section is not None
            check_totals(section)
            section = None
        elif key != "TN":
            assert section is not None
            read_record(section, key, value)
    assert section is None
    return found


def read_record(section: Section, key: str, value: str) -> None:
    if key == "DA":
        line, count = value.split(",")
        section.lines[int(line)] = int(count)
    elif key == "BRDA":
        line, block, branch, taken = value.split(",")
        section.branches[int(line), int(block), int(branch)] = None if taken == "-" else int(taken)
    else:
        assert key in {"BRF", "BRH", "LF", "LH"}
        section.totals[key] = int(value)


def check_totals(section: Section) -> None:
    assert section.totals == {
        "BRF": len(section.branches),
        "BRH": sum(bool(taken) for taken in section.branches.values()),
        "LF": len(section.lines),
        "LH": sum(count > 0 for count in section.lines.values()),
    }


def test_a_tracefile_of_lcov() -> None:
    found = read_tracefile(lcov(Coverage([text("b.prg"), text("a.prg")])))
    assert list(found) == ["a.prg", "b.prg"]
    assert found["b.prg"].lines == {1: 5, 3: 5, 4: 0, 6: 0}
    assert found["b.prg"].branches == {(1, 0, 0): 5, (1, 0, 1): 0, (4, 0, 0): None, (4, 0, 1): None}


def test_a_table() -> None:
    assert table(Coverage([text()])).splitlines() == [
        "file   statements  missed  branches  missed  percent  missing",
        "p.prg           4       2         4       3   37.5 %  4-6, 1->end",
    ]


def test_a_table_of_several_files_has_their_sum() -> None:
    rows = table(Coverage([text("a.prg"), text("b.prg", (1, 1, 1, 1))])).splitlines()
    assert rows[-1].split() == ["all", "8", "2", "8", "6", "50.0", "%"]


def test_percent_is_100_for_all_only() -> None:
    """1999 of 2000 are 99.95 %."""
    lines = "\n" * 2000
    statements = {at: Statement(at, at + 1, at + 1) for at in range(2000)}
    hits = Counter(dict.fromkeys(range(1999), 1))
    one = TextCoverage("p", SourceText("p", lines), statements, {at: (at + 1,) for at in range(2000)}, hits)
    assert "99.9 %" in table(Coverage([one]))
    assert "100.0 %" in table(Coverage())


def test_json() -> None:
    data = json.loads(json_text(Coverage([text()])))
    summary = {"statements": 4, "missed": 2, "branches": 4, "missed_branches": 3, "percent": 37.5}
    assert data["summary"] == data["files"][0]["summary"] == summary
    assert data["files"][0]["path"] == "p.prg"
    assert data["files"][0]["missing_lines"] == [4, 6]
    assert data["files"][0]["statements"][1] == {"line": 3, "column": 1, "count": 5}
    assert data["files"][0]["branches"][:2] == [
        {"line": 1, "column": 1, "to_line": 3, "count": 5},
        {"line": 1, "column": 1, "to_line": None, "count": 0},
    ]


class PageReader(HTMLParser):
    """The lines of the source: class and text."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[tuple[str, str]] = []
        self.asked: list[str] = []
        """Addresses of what a page needs besides itself."""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.asked += [value for key in ("src", "href") if (value := given.get(key)) and not value.startswith("#")]
        if tag == "li":
            self.lines.append((given.get("class") or "", ""))

    def handle_data(self, data: str) -> None:
        if self.lines:
            state, before = self.lines[-1]
            self.lines[-1] = state, before + data.rstrip("\n")


def test_a_page_shows_the_source_and_needs_nothing_else() -> None:
    reader = PageReader()
    reader.feed(page(Coverage([text()])))
    assert reader.lines == [
        ("part", "15anever to the end"),
        ("", "2; <comment>"),
        ("run", "35b"),
        ("miss", "40c & d"),
        ("", "5"),
        ("miss", "60e"),
    ]
    assert reader.asked == []


def test_a_page_in_which_every_way_was_taken_has_no_partly_executed_line() -> None:
    full = text(hits=(6, 6, 6, 6))
    full.taken.update(dict.fromkeys(full.ways, 1))
    reader = PageReader()
    reader.feed(page(Coverage([full])))
    assert [state for state, _ in reader.lines] == ["run", "", "run", "run", "", "run"]


def test_plain_values_are_the_same_coverage_for_another_process() -> None:
    before = Coverage([text("a.prg"), text("b.prg")])
    after = Coverage.from_json(json.loads(json.dumps(before.to_json())))
    assert [(one.path, one.summary, one.hits, one.taken) for one in after] == [
        (one.path, one.summary, one.hits, one.taken) for one in before
    ]


def test_other_texts_under_one_path_are_counted_apart() -> None:
    other = TextCoverage("p.prg", SourceText("p.prg", "z"), {0: Statement(0, 1, 1)}, {0: (END,)})
    coverage = Coverage([text(), other, text()])
    assert [one.summary.statements for one in coverage] == [4, 1]
    assert next(iter(coverage)).hits[0] == 10
