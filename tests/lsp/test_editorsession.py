"""The session without protocol: texts that change, files that belong together."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.lsp.conftest import BROKEN, CONFIG, PROGRAM, TABLE, WORLD

from steptwin.diagnostics import Span
from steptwin.errors import Misuse
from steptwin.lsp import navigation
from steptwin.lsp.analysis import Analysis
from steptwin.lsp.documents import TextChange
from steptwin.lsp.editorsession import EditorSession
from steptwin.lsp.positions import Encoding, LineIndex

PRG, CSV, CFG = "file:///m/machine.prg", "file:///m/machine.csv", "file:///m/machine.cfg"
CHIP = "file:///m/drum.m1486"


class Shelf:
    """Files by address, as a studio in a browser has them."""

    def __init__(self, **texts: str) -> None:
        self.texts = {f"file:///m/{name.replace('_', '.')}": text for name, text in texts.items()}

    def stamp(self, uri: str) -> object | None:
        return self.texts.get(uri)

    def read(self, uri: str) -> bytes:
        if uri not in self.texts:
            raise Misuse(f"no {uri}")
        return self.texts[uri].encode()

    def beside(self, uri: str, suffix: str) -> list[str]:
        return sorted(name for name in self.texts if name.endswith(suffix))


def session(text: str = PROGRAM, **files: str) -> EditorSession:
    made = EditorSession(Shelf(**files))
    made.open(PRG, "wbc", 1, text)
    return made


def codes(made: EditorSession, uri: str = PRG) -> list[str]:
    analysis = made.analysis(uri)
    assert analysis is not None
    return [diagnostic.code for diagnostic in analysis.diagnostics()]


# ---------------------------------------------------------------------- texts

LETTERS = st.text(st.sampled_from("aMż😀1 =@#\r\n:"), max_size=12)
EDITS = st.lists(
    st.tuples(st.tuples(st.integers(0, 6), st.integers(0, 8)), st.tuples(st.integers(0, 6), st.integers(0, 8)), LETTERS)
)


def utf16(text: str, line: int, column: int) -> int:
    """The character of a position, found by encoding the line."""
    lines = text.replace("\r\n", "\n\0").replace("\r", "\n").split("\n")
    start = sum(len(part) + 1 for part in lines[:line])
    if line >= len(lines):
        return len(text)
    content = lines[line].removeprefix("\0")
    lead = len(lines[line]) - len(content)
    units = content.encode("utf-16-le")[: 2 * column]
    return start + lead + len(units.decode("utf-16-le", "ignore"))


@given(LETTERS, st.lists(EDITS, max_size=4))
def test_changes_in_parts_give_the_whole_text(
    text: str, rounds: list[list[tuple[tuple[int, int], tuple[int, int], str]]]
) -> None:
    made = session(text)
    for version, edits in enumerate(rounds, 2):
        made.change(PRG, version, [TextChange(inserted, *sorted((a, b))) for a, b, inserted in edits])
        for a, b, inserted in edits:
            start, end = (utf16(text, *place) for place in sorted((a, b)))
            text = text[:start] + inserted + text[end:]
        document = made.document(PRG)
        assert document is not None
        assert document.text == text
        other = session(text)
        assert codes(made) == codes(other)


def test_a_change_without_range_is_the_whole_text() -> None:
    made = session("x")
    made.change(PRG, 2, [TextChange("OUT1 = ON\nEND\n")])
    assert codes(made) == []


def test_columns_are_those_of_the_client() -> None:
    for encoding, column in ((Encoding.UTF8, 4), (Encoding.UTF16, 2), (Encoding.UTF32, 1)):
        made = EditorSession(encoding=encoding)
        made.open(PRG, "wbc", 1, "😀x")
        made.change(PRG, 2, [TextChange("y", (0, column), (0, column + 1))])
        document = made.document(PRG)
        assert document is not None
        assert document.text == "😀y"


# ---------------------------------------------------------------------- files of a machine


def test_table_and_configuration_beside_the_program_are_used() -> None:
    assert "W215" in codes(session())
    made = session(machine_csv=TABLE, machine_cfg=CONFIG)
    assert codes(made) == []
    made = session(machine_csv="other;1;2;x;x\n", machine_cfg=CONFIG)
    assert codes(made) == ["W126"]


def test_an_open_table_counts_before_the_file() -> None:
    made = session(machine_csv="other;1;2;x;x\n")
    assert "W126" in codes(made)
    made.open(CSV, "", 1, TABLE)
    assert "W126" not in codes(made)
    made.change(CSV, 2, [TextChange("", (0, 0), (1, 0))])
    assert "W126" in codes(made)
    made.close(CSV)
    assert "W126" in codes(made)


def test_a_file_that_changes_outside_is_read_again() -> None:
    made = session(machine_csv="other;1;2;x;x\n")
    assert "W126" in codes(made)
    shelf = made.files
    assert isinstance(shelf, Shelf)
    shelf.texts[CSV] = TABLE
    assert "W126" not in codes(made)


def test_rows_no_program_uses_are_pale() -> None:
    made = session(machine_csv=TABLE)
    made.open(CSV, "", 1, TABLE)
    assert codes(made, CSV) == ["W251"]
    made.change(PRG, 2, [TextChange(PROGRAM + "MOVEPTP @unused\n")])
    assert codes(made, CSV) == []


def test_the_spelling_of_an_address_does_not_matter() -> None:
    made = EditorSession(Shelf())
    made.open("file:///m%2Fmachine%2Eprg", "wbc", 1, "MOVEPTP @above\n")
    made.open("file:///m/machine.csv", "", 1, TABLE)
    assert codes(made, "file:///m/machine.prg") == ["W207", "W207"]


def test_texts_of_other_programs_are_left_alone() -> None:
    made = EditorSession()
    for uri, text in (
        ("file:///setup.cfg", "[metadata]\nname=x\n"),
        ("file:///a.csv", "1,2,3\n"),
        ("file:///a.toml", "[tool]\n"),
    ):
        made.open(uri, "plaintext", 1, text)
        assert made.analysis(uri) is None


class Interruption(BaseException):
    """As of a request that is cancelled."""


@contextmanager
def interrupted(line: int) -> Generator[None]:
    """Raise at a line, counted as they are executed, of what the session does and of what reads a text in parts."""
    left = line

    def at_line(frame: FrameType, event: str, _: object) -> Any:
        nonlocal left
        if event == "line":
            left -= 1
            if left == 0:
                raise Interruption
        return at_line

    def at_call(frame: FrameType, event: str, _: object) -> Any:
        return at_line if frame.f_code.co_filename.endswith(("session.py", "incremental.py", "memory.py", "built.py")) else None

    before = sys.gettrace()
    sys.settrace(at_call)
    try:
        yield
    finally:
        sys.settrace(before)


CYLINDER = '[[cylinder]]\nname = "ram"\nstroke = 50.0\nextend_time = "1 s"\nextend = "table.OUT1"\n'


@pytest.mark.parametrize(
    ("uri", "text", "change", "ask"),
    [
        (PRG, "#a 1\nx = a\ny = q\n", TextChange("\n", (1, 0), (1, 0)), lambda one: one.diagnostics()),
        (
            "file:///m/cell.toml",
            WORLD + "\n[[script]]\nsteps = [\n{ until = 'ram.",
            TextChange(CYLINDER, (0, 0), (0, 0)),
            lambda one: one.items(len(one.text)).items,
        ),
    ],
    ids=["program", "world"],
)
def test_what_is_interrupted_anywhere_is_made_when_it_is_asked_for_again(
    uri: str, text: str, change: TextChange, ask: Callable[[Analysis], Sequence[object]]
) -> None:
    def opened() -> EditorSession:
        made = session("")
        made.open(uri, "", 1, text)
        return made

    def asked(made: EditorSession) -> Sequence[object]:
        analysis = made.analysis(uri)
        assert analysis is not None
        return ask(analysis)

    changed = opened()
    changed.change(uri, 2, [change])
    wanted = asked(changed)
    assert wanted
    for line in itertools.count(1):
        made = opened()
        asked(made)
        made.change(uri, 2, [change])
        try:
            with interrupted(line):
                asked(made)
        except Interruption:
            assert asked(made) == wanted, f"interrupted at line {line}"
        else:
            break
    assert line > 50


def test_a_text_of_any_size_is_not_looked_at() -> None:
    made = session("x = 1\n" * 300_000)
    assert codes(made) == ["S001"]
    made.open("file:///chip.m1486", "m1486", 1, "+1\n" * 50_000)
    analysis = made.analysis("file:///chip.m1486")
    assert analysis is not None
    (found,) = analysis.diagnostics()
    assert found.message == "the text has 150000 characters: texts of more than 131072 are not analysed"


# ---------------------------------------------------------------------- questions


def at(text: str, mark: str, part: str) -> int:
    """The place of a part in the first line with a mark."""
    start = text.index(mark)
    return start + mark.index(part)


def hover(made: EditorSession, place: int) -> str:
    analysis = made.analysis(PRG)
    assert analysis is not None
    found = analysis.hover(place)
    return "" if found is None else found.text


def test_hovers_tell_what_names_mean() -> None:
    made = session(machine_csv=TABLE, machine_cfg=CONFIG)
    expected = {
        ("HOME M1 speed", "HOME"): "Homes the drive at this velocity",
        ("HOME M1 speed", "speed"): "#speed -40",
        ("gripper = ON", "gripper"): "another name of OUT1",
        ("gripper = ON", "ON"): "Predefined: 1",
        ("count = count", "count"): "1 of 2; a program has at most 128",
        ("$I10 = count", "$I10"): "signed 16-bit number",
        ("MOVEPTP @above", "above"): "Row 0 of 2: p1 = 40.5, p2 = 60, p3 = x, p4 = x",
        ("sin(count)", "sin"): "angle in degrees",
        ("JUMP PICK", "PICK"): "1 JUMP comes here",
        ("INT_IN1:", "INT"): "Label of the interrupt IN1",
        ("CFGINT_IN1 =", "CFGINT"): "INT_OFF, RIS, FALL, RIS_FALL",
        ("PREL M1", "PREL"): "Executable line 14 of at most 4000",
    }
    for (line, part), text in expected.items():
        assert text in hover(made, at(PROGRAM, line, part)), (line, part)


def test_units_are_those_of_the_configuration() -> None:
    made = session("y = PosM1\n$R0 = y\n", machine_cfg=CONFIG)
    assert "mm (100 pulses per mm)" in hover(made, 5)


def labels(made: EditorSession, text: str, place: int | None = None) -> list[str]:
    made.change(PRG, 9, [TextChange(text)])
    analysis = made.analysis(PRG)
    assert analysis is not None
    return [item.label for item in analysis.items(len(text) if place is None else place).items]


def test_completions_fit_what_is_being_typed() -> None:
    made = session(machine_csv=TABLE)
    assert "HOME" in labels(made, "HO")
    assert labels(made, "LOOP:\nJUMP ") == ["LOOP"]
    assert labels(made, "MOVEPTP @") == ["above", "unused"]
    assert labels(made, "#pump OUT3\nPULSE(")[0] == "pump"
    assert labels(made, "WAIT IN1 = ")[:2] == ["ON", "OFF"]
    assert "sqrt" in labels(made, "x = sq")
    assert labels(made, "HOME ") == ["M1", "M2", "M3", "M4"]
    assert "VactM1" not in labels(made, "SET V")  # read-only
    assert "VmaxM1" in labels(made, "SET V")
    assert "IN1" in labels(made, "WAIT I")
    assert labels(made, "WAIT IN1 ") == ["=", "<", ">", "<=", ">="]
    assert "$I7" in labels(made, "$I7 = 1\nx = $")
    assert labels(made, "x = 1 // HO") == []
    assert labels(made, "DELAY 1 ") == []


def in_table(table: str, line: int, column: int) -> list[str]:
    made = session("MOVEPTP @above\nMOVEPTP @below\nMOVEPTP @side\n", machine_csv=table)
    made.open(CSV, "mic488-positions", 1, table)
    analysis = made.analysis(CSV)
    assert analysis is not None
    start = sum(map(len, table.splitlines(keepends=True)[:line]))
    return [item.insert or item.label for item in analysis.items(start + column).items]


def test_completions_in_every_place_of_a_table() -> None:
    table = "above;1;2;x;40\n;1;25;x;x\n\nb\nc;2;\n"
    assert in_table(table, 0, 0) == ["BELOW", "SIDE"]
    assert in_table(table, 1, 0) == ["BELOW", "SIDE"]
    assert in_table(table, 0, 6) == ["x", "2"]
    assert in_table(table, 1, 3) == ["x", "2"]
    assert in_table(table, 4, 4) == ["x", "25", "2"]
    row = "${1:x};${2:x};${3:x};${4:x}"
    assert in_table(table, 2, 0) == [f"BELOW;{row}", f"SIDE;{row}", f"${{5:name}};{row}"]
    assert in_table(table, 3, 1) == [f"BELOW;{row}", f"b;{row}"]
    assert in_table("", 0, 0)[-1] == f"${{5:name}};{row}"
    assert in_table("a;1;2;3;4;5", 0, 11) == []


def test_a_completion_replaces_the_word_it_completes() -> None:
    made = session("x = 1\nPABS M1 POS")
    analysis = made.analysis(PRG)
    assert analysis is not None
    item = next(item for item in analysis.items(len("x = 1\nPABS M1 POS")).items if item.label == "PosM1")
    assert item.span == Span(14, 17)


def test_signatures_know_the_operand() -> None:
    made = session("PABS M1 \nSET x = max(1, \nPULSE(OUT1, \nWAIT IN1 = \nEND ")
    analysis = made.analysis(PRG)
    assert analysis is not None
    found = [analysis.signature(end) for end in map(analysis.lines.end, range(len(analysis.lines.starts)))]
    assert [(s.label, s.active) for s in found if s is not None] == [
        ("PABS Mx position", 1),
        ("max(Y, Z)", 1),
        ("PULSE(OUTn, seconds)", 1),
        ("WAIT X = Y", 2),
    ]


def test_definitions_go_to_constants_labels_variables_and_rows() -> None:
    made = session(machine_csv=TABLE)

    def target(line: str, part: str) -> tuple[str, str]:
        place, *more = navigation.definition(made, PRG, at(PROGRAM, line, part))
        assert not more
        text = made.lines(place.uri)
        assert text is not None
        return place.uri, text.line(text.line_of(place.span.start))

    assert target("HOME M1 speed", "speed") == (PRG, "#speed -40")
    assert target("JUMP PICK", "PICK") == (PRG, "PICK:")
    assert target("sin(count)", "count") == (PRG, "count = count + 1")
    assert target("MOVEPTP @above", "above") == (CSV, "above;40,5;60;x;x")
    assert target("CFGINT_IN1 =", "CFG") == (PRG, "INT_IN1:")


def test_references_cross_files() -> None:
    made = session(machine_csv=TABLE)
    found = navigation.references(made, CSV, 2)
    assert [place.uri for place in found] == [CSV, PRG]
    assert len(navigation.references(made, CSV, 2, with_definition=False)) == 1


def test_a_rename_changes_every_use_in_every_file() -> None:
    made = session(machine_csv=TABLE)
    edits = navigation.rename(made, PRG, at(PROGRAM, "MOVEPTP @above", "above"), "over")
    assert {uri: len(found) for uri, found in edits.items()} == {PRG: 1, CSV: 1}
    edits = navigation.rename(made, PRG, at(PROGRAM, "count = count", "count"), "parts")
    text = PROGRAM
    for edit in sorted(edits[PRG], key=lambda edit: -edit.span.start):
        text = text[: edit.span.start] + edit.text + text[edit.span.end :]
    assert text == PROGRAM.replace("count", "parts")


def test_a_rename_that_would_change_the_meaning_is_refused() -> None:
    made = session(machine_csv=TABLE)
    cases = {
        ("count = count", "x"): "x is a variable already",
        ("count = count", "PosM1"): "PosM1 is a register already",
        ("count = count", "ä"): "is not a name",
        ("count = count", "pick"): "pick is a label already",
        ("HOME M1 speed", "HOME"): "there is no name",
        ("JUMP PICK", "MAIN"): "MAIN is a label already",
        ("MOVEPTP @above", "unused"): "there is a position unused already",
        ("INT_IN1:", "OTHER"): "whose name is fixed",
        ("M1 = ON", "AXIS"): "is a register",
    }
    for (line, name), message in cases.items():
        part = {"HOME M1 speed": "HOME", "JUMP PICK": "PICK", "MOVEPTP @above": "above"}.get(line, line[:2])
        with pytest.raises(Misuse, match=message):
            navigation.rename(made, PRG, at(PROGRAM, line, part), name)


def test_outline_folds_and_calls() -> None:
    made = session(machine_csv=TABLE)
    analysis = made.analysis(PRG)
    assert analysis is not None
    assert [section.name for section in analysis.outline()] == [
        "speed", "gripper", "ready", "MAIN", "PICK", "INT_IN1", "count", "x",
    ]  # fmt: skip
    assert sorted((fold.first, fold.last) for fold in analysis.folds()) == [(1, 3), (7, 12), (14, 25), (18, 20), (27, 29)]
    caller = navigation.caller_at(made, PRG, at(PROGRAM, "JUMP PICK", "PICK"))
    assert caller is not None
    assert caller.key == "PICK"
    incoming = navigation.calls(made, PRG, "PICK", incoming=True)
    assert [(other.key, len(found)) for other, found in incoming] == [("MAIN", 1)]
    outgoing = navigation.calls(made, PRG, "MAIN", incoming=False)
    assert [other.key for other, _ in outgoing] == ["PICK", "MAIN"]


def test_fixes_of_what_was_said() -> None:
    made = session("GOTO MAIN\nMAIN:\nx == 3\nOUT1 = x\nEND\n")
    found = navigation.fixes(made, PRG, Span(0, 30))
    assert [action.title for action in found] == ["Replace GOTO by JUMP (W137)", "Replace == by = (W116)"]


@pytest.mark.parametrize(
    ("uri", "text", "fixed"),
    [
        (CFG, "[Axis0\nGear=2\n", "[Axis0]\nGear=2\n"),
        (CSV, "a;1;2\nb;1;2;3;4\n", "a;1;2;x;x\nb;1;2;3;4\n"),
        (CSV, "a;1;2;3;4;;;\n", "a;1;2;3;4\n"),
        (CSV, "a;1;2;3;4;5\n", None),
    ],
)
def test_fixes_of_files_beside_a_program(uri: str, text: str, fixed: str | None) -> None:
    made = session()
    made.open(uri, {CFG: "mic488-config", CSV: "mic488-positions"}[uri], 1, text)
    found = navigation.fixes(made, uri, Span(0, 5))
    edits = [edit for action in found for edit in action.edits[uri]]
    assert [text[: edit.span.start] + edit.text + text[edit.span.end :] for edit in edits] == ([] if fixed is None else [fixed])


def test_hover_of_a_section_of_the_configuration() -> None:
    made = session()
    made.open(CFG, "", 1, "[Axis1]\nGear=2\n[nothing]\n")
    analysis = made.analysis(CFG)
    assert analysis is not None
    found = analysis.hover(2)
    assert found is not None
    assert found.text.startswith("`[Axis1]` is axis M2.\n\n* `Unit`: permitted: 0 = imp, 1 = rev")
    assert analysis.hover(17) is None


def test_hints_show_values_memory_and_times() -> None:
    made = session(machine_csv=TABLE, machine_cfg=CONFIG)
    analysis = made.analysis(PRG)
    assert analysis is not None
    shown = [hint.label for hint in analysis.hints()]
    assert "= -40" in shown
    assert "40.5; 60; x; x" in shown
    assert "21 of 4000 lines" in shown
    # 12.5 mm at 50 mm/s with 500 mm/s² both ways: 2 × 0.1 s of ramp, 5 mm in them, 7.5 mm at 50 mm/s.
    assert "0.35 s" in shown


def test_the_formatted_text_comes_as_edits_of_lines() -> None:
    text = "x=1\nIF x=1\nout1=ON\nENDIF\nEND"
    made = session(text)
    analysis = made.analysis(PRG)
    assert analysis is not None
    edits = analysis.format_edits()
    for edit in reversed(edits):
        text = text[: edit.span.start] + edit.text + text[edit.span.end :]
    assert text == "x = 1\nIF x = 1\n    out1 = ON\nENDIF\nEND\n"
    assert len(edits) == 4


def test_symbols_of_all_texts() -> None:
    made = session(machine_csv=TABLE)
    assert [(uri, section.name) for uri, section in navigation.workspace_symbols(made, "abo")] == [(CSV, "above")]
    assert [section.name for _, section in navigation.workspace_symbols(made, "pick")] == ["PICK"]


# ---------------------------------------------------------------------- any text

CHIP_LINES = (
    "[",
    "]",
    "@5",
    "@ 5",
    "J5",
    "J",
    "I2H5",
    "i1",
    "'5",
    ".",
    "L3",
    "E",
    "F1 28 ; x",
    "FR",
    "X7",
    "XG",
    "T43",
    "C87",
    "?14",
    "\\",
    "1 2",
)
PIECES = st.lists(
    st.sampled_from(
        [*PROGRAM.splitlines(), *BROKEN.splitlines(), *CHIP_LINES, "\ud800", "/*", "*/", ";;;;", "[Axis0]", "Unit=9"]
    ),
    max_size=12,
)
URIS = st.sampled_from((PRG, CSV, CFG, CHIP))


@given(URIS, PIECES, st.sampled_from(("\n", "\r\n", "\r")), st.data())
def test_every_question_about_any_text_is_answered(uri: str, pieces: list[str], end: str, data: st.DataObject) -> None:
    text = end.join(pieces)
    made = session(machine_csv=TABLE, machine_cfg=CONFIG)
    made.open(uri, {PRG: "wbc", CSV: "mic488-positions", CFG: "mic488-config", CHIP: "m1486"}[uri], 1, text)
    analysis = made.analysis(uri)
    assert analysis is not None
    lines = LineIndex(text)
    place = lines.place(*lines.position(data.draw(st.integers(0, len(text))), Encoding.UTF16), Encoding.UTF16)
    inside = range(len(text) + 1)
    for diagnostic in analysis.diagnostics():
        assert diagnostic.span.start in inside
        assert diagnostic.span.end in inside
    found = analysis.hover(place)
    assert found is None or found.span.start <= place <= found.span.end
    for item in analysis.items(place).items:
        assert item.span.start <= place <= item.span.end
    analysis.signature(place)
    analysis.format_edits()
    tokens = analysis.tokens()
    for token in tokens:
        assert token.span.start < token.span.end
        assert lines.line_of(token.span.start) == lines.line_of(token.span.end - 1)
    for one, other in itertools.pairwise(tokens):
        assert one.span.end <= other.span.start
    for hint in analysis.hints():
        assert hint.place in inside
    for section in analysis.outline():
        assert section.span.start <= section.name_span.start <= section.name_span.end <= section.span.end
    for fold in analysis.folds():
        assert 0 <= fold.first < fold.last < len(lines.starts)
    navigation.definition(made, uri, place)
    navigation.references(made, uri, place)
    navigation.highlights(made, uri, place)
    navigation.fixes(made, uri, Span(0, len(text)))
    navigation.workspace_symbols(made, "a")
    caller = navigation.caller_at(made, uri, place)
    if caller is not None:
        navigation.calls(made, uri, caller.key, incoming=True)
        navigation.calls(made, uri, caller.key, incoming=False)
    try:
        edits = navigation.rename(made, uri, place, "quite_new")
    except Misuse:
        return
    assert edits
