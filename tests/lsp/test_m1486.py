"""M1486 programs in the session."""

from __future__ import annotations

import pytest
from tests.lsp.test_editorsession import Shelf

from steptwin.diagnostics import Span
from steptwin.errors import Misuse
from steptwin.lsp import navigation
from steptwin.lsp.analysis import Analysis
from steptwin.lsp.editorsession import EditorSession

URI = "file:///m/drum.m1486"
PROGRAM = """\
[           ; store what follows
S200
V1000
A5000
F12800      ; 200 full steps
@5
i2H7
T3
t43
R
'6
J5
@6
>3
.
@7
W250
]
"""
CHAIN = "X0\n[\n@1\nR\nJ1\n]\nX7\n[\n@1\nZ3\nJ1\n]\n"


def session(text: str = PROGRAM, **files: str) -> EditorSession:
    made = EditorSession(Shelf(**files))
    made.open(URI, "", 1, text)
    return made


def of(made: EditorSession) -> Analysis:
    found = made.analysis(URI)
    assert found is not None
    return found


def hover(mark: str, text: str = PROGRAM, add: int = 0) -> str:
    found = of(session(text)).hover(text.index(mark) + add)
    return "" if found is None else found.text


def test_hovers() -> None:
    assert "12 800 minimum microsteps are 200 full steps" in hover("F12800")
    assert "32 bits of command memory" in hover("F12800")
    assert "chapter VII.2" in hover("F12800")
    assert "Line B3" in hover("T3", add=1)
    assert "Function 43, Edge" in hover("t43", add=1)
    assert "Register 3, 16 bits" in hover(">3", add=1)
    assert "It needs no command memory; acts when compressed" in hover("]")
    assert "internal variable is used" in hover("R\nF\n", "R\nF\n", add=2)
    assert hover("; 200", add=3) == ""


def items(text: str, **files: str) -> list[str]:
    return [item.label for item in of(session(text, **files)).items(len(text)).items]


def test_completions() -> None:
    assert {"F", "G+", "@", "XG"} <= set(items(""))
    assert items("@3\nR\n@12\nV300\nJ") == ["J", "3", "12"]
    assert items("@3\nR\nI2H") == ["3"]
    assert items("M") == ["M", "1", "2", "4", "8", "16", "32", "64"]
    assert "43" in items("T4")
    assert items("@1\nR\n@")[-1] == "2"
    assert items("R ; F") == []
    assert items("X0\n@1\nX7\nJ1") == []  # label 1 is that of the other chip


def test_signatures() -> None:
    analysis = of(session("I2H5\nC7\nR\n"))
    assert [(s.label, s.active) if (s := analysis.signature(end)) else None for end in map(analysis.lines.end, range(3))] == [
        ("I line or flag H or L label", 2),
        ("C number or line or function or flag", 0),
        None,
    ]


def test_labels_are_followed_within_their_chip() -> None:
    made = session()
    (place,) = navigation.definition(made, URI, PROGRAM.index("J5") + 1)
    assert place.span.start == PROGRAM.index("@5") + 1
    assert len(navigation.references(made, URI, PROGRAM.index("@5") + 1)) == 2
    made = session(CHAIN)
    assert len(navigation.references(made, URI, CHAIN.index("J1") + 1)) == 2
    assert [use.span.start for use in navigation.highlights(made, URI, CHAIN.rindex("J1") + 1)] == [
        CHAIN.rindex("@1") + 1,
        CHAIN.rindex("J1") + 1,
    ]


def test_a_label_gets_another_number() -> None:
    made = session()
    edits = navigation.rename(made, URI, PROGRAM.index("i2H7") + 3, "9")
    text = PROGRAM
    for edit in sorted(edits[URI], key=lambda edit: -edit.span.start):
        text = text[: edit.span.start] + edit.text + text[edit.span.end :]
    assert text == PROGRAM.replace("i2H7", "i2H9").replace("@7", "@9")
    for name, message in (("5", "there is a label 5"), ("99", "1 to 15 on M1486A"), ("main", "is not a label")):
        with pytest.raises(Misuse, match=message):
            navigation.rename(made, URI, PROGRAM.index("i2H7") + 3, name)
    with pytest.raises(Misuse, match="B3 is fixed"):
        navigation.rename(made, URI, PROGRAM.index("T3") + 1, "4")


def test_the_world_that_names_a_program_decides_about_its_type() -> None:
    world = "[[m1486]]\nname = 'drum'\nvariant = 'B'\nprogram = 'drum.m1486'\n"
    text = "[\n@40\nR\nJ40\n]\n"
    assert [d.code for d in of(session(text)).diagnostics() if d.code.startswith("M1")] == ["M110", "M110"]
    assert [d.code for d in of(session(text, cell_toml=world)).diagnostics() if d.code.startswith("M1")] == []


def test_hints_show_distances_memory_and_times() -> None:
    shown = {hint.place: hint.label for hint in of(session("[\nS200\nV200\nF12800\nR\n]\n")).hints()}
    text = "[\nS200\nV200\nF12800\nR\n]\n"
    assert shown[text.index("F12800") + 6] == "200 full steps"
    # V is not above S: 200 full steps at 200 step/s, without ramp.
    assert shown[text.index("R") + 1] == "1 s"
    # S and V take 8 + 16 bits each, F 8 + 24, R 8.
    assert shown[text.index("]") + 1] == "88 of 864 bits"


def test_outline_folds_calls_and_format() -> None:
    made = session()
    analysis = of(made)
    assert [section.name for section in analysis.outline()] == ["@5", "@6", "@7"]
    assert [(fold.first, fold.last) for fold in analysis.folds()] == [(0, 17)]
    assert [(call.caller, call.callee) for call in analysis.calls()] == [("5", "7"), ("5", "6"), ("5", "5")]
    assert "I2H7" in (analysis.formatted() or "")
    caller = navigation.caller_at(made, URI, PROGRAM.index("'6") + 1)
    assert caller is not None
    assert [other.key for other, _ in navigation.calls(made, URI, caller.key, incoming=True)] == ["5"]
    assert [section.name for section in of(session(CHAIN)).outline()] == ["chip 0", "@1", "chip 7", "@1"]


def test_fixes() -> None:
    made = session("120\nF1O0\n")
    assert [action.title for action in navigation.fixes(made, URI, Span(0, 9))] == [
        "Replace 1 by L (M101)",
        "Replace 1O0 by 100 (M102)",
    ]
