"""Descriptions of worlds in the session."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.lsp.test_editorsession import Shelf

from steptwin.diagnostics import Span
from steptwin.errors import Misuse
from steptwin.lsp import navigation
from steptwin.lsp.analysis import Analysis
from steptwin.lsp.editorsession import EditorSession
from steptwin.simulation.describe.tables import all_keys

URI = "file:///m/cell.toml"
PROGRAM_URI = "file:///m/a.prg"
EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"
WORLD = """\
[world]
name = "cell"

[[line]]
name = "bus"

[[mic488]]
name = "table"
line = "bus"
firmware = "1.23"
programs = ["a.prg"]
positions = "rows.csv"

[mic488.M1]
unit = "mm"

[[axis]]
name = "x"
drive = "table.M1"
pitch = 5.0

[[axis.switch]]
below = 0.0
to = "table.IN1"

[[button]]
name = "start"
to = "table.IN5"

[[script]]
name = "operator"
steps = [
  { write = { "table.M1_EN" = 1 } },
  { until = "x.position > 10 and table.M1.status == 4", within = "1 s" },
  { press = "start", for = "1 s" },
  { note = "start the table" },
]
"""


def session(text: str = WORLD, **files: str) -> EditorSession:
    made = EditorSession(
        Shelf(**({"a_prg": "x = 1\nOUT1 = x\nMOVEPTP @row\nM1 = ON\nEND\n", "rows_csv": "row;1;x;x;x\n"} | files))
    )
    made.open(URI, "", 1, text)
    return made


def of(made: EditorSession, uri: str = URI) -> Analysis:
    found = made.analysis(uri)
    assert found is not None
    return found


def test_a_world_that_is_right() -> None:
    assert of(session()).diagnostics() == []


@pytest.mark.parametrize("name", ["feeder", "handwheel", "lift"])
def test_examples_are_right(name: str) -> None:
    made = session((EXAMPLES / f"{name}.toml").read_text())
    assert of(made).diagnostics() == []
    assert len(of(made).outline()) > 5


def test_signals_that_do_not_exist_have_a_fix() -> None:
    steps = (
        '[[script]]\nname = "s"\nat = 0\nsteps = [{ until = "m.M1.psition > 4" }, { expect = "tabel.OUT1" }, { press = "gp" }]\n'
    )
    text = '[[mic488]]\nname = "m"\n[[mic488]]\nname = "table"\n[[button]]\nname = "goon"\nto = "m.IN1"\n' + steps
    made = session(text)
    titles = [action.title for action in navigation.fixes(made, URI, Span(0, len(text)))]
    assert titles == ["Replace m.M1.psition by m.M1.position (D009)", "Replace tabel by table (D009)"]


def test_what_is_wrong_has_its_place_and_a_fix() -> None:
    text = WORLD.replace("pitch =", "pich =").replace('to = "table.IN5"', 'to = "table.IN5"\ncontact = "N0"')
    made = session(text)
    found = {d.code: text[d.span.start : d.span.end] for d in of(made).diagnostics()}
    assert found == {"D004": "pich = 5.0", "D003": 'contact = "N0"'}
    fixed = text
    for action in reversed(navigation.fixes(made, URI, Span(0, len(text)))):
        ((edit,),) = action.edits.values()
        fixed = fixed[: edit.span.start] + edit.text + fixed[edit.span.end :]
    assert fixed == WORLD.replace('to = "table.IN5"', 'to = "table.IN5"\ncontact = "N0"')


def test_references_that_lead_nowhere_are_found() -> None:
    made = session(WORLD.replace('line = "bus"', 'line = "buss"').replace("rows.csv", "nothing.csv"))
    assert [d.code for d in of(made).diagnostics()] == ["D009", "D009"]
    assert [action.title for action in navigation.fixes(made, URI, Span(0, len(WORLD)))] == ["Replace buss by bus (D009)"]


def test_half_typed_text_still_has_names() -> None:
    made = session(WORLD + "\n[[wire]]\nfrom = \n")
    assert [d.code for d in of(made).diagnostics()] == ["D001"]
    assert len(navigation.references(made, URI, WORLD.index('"table.IN1"') + 2)) == 6


def items(text: str, made: EditorSession | None = None) -> list[str]:
    made = session(text) if made is None else made
    return [item.label for item in of(made).items(len(text)).items]


def test_completions() -> None:
    assert {"[[axis]]", "[axis.motor]", "[mic488.M1]", "[[fault]]"} <= set(items(WORLD + "\n["))
    found = items(WORLD + "\n[[axis]]\nname = 'y'\npi")
    assert {"pitch", "drive"} <= set(found)
    assert "name" not in found
    assert {"[[use]]", "[[supply]]", "[[follower.switch]]", "[[carriage.switch]]", "[gateway.opcua]", "[gateway.mqtt]"} <= set(
        items(WORLD + "\n[")
    )
    assert {"above", "to"} <= set(items(WORLD + "\n[[follower]]\nname = 'k'\n[[follower.switch]]\na"))
    assert items(WORLD + "\n[gateway.prometheus]\nli") == ["listen"]
    assert {"listen", "security"} <= set(items(WORLD + "\n[gateway.opcua]\n"))
    assert {"broker", "tls", "sparkplug"} <= set(items(WORLD + "\n[gateway.mqtt]\n"))
    assert items(WORLD + '\n[gateway.mqtt]\nrole = "') == ["viewer", "operator", "engineer"]
    assert items(WORLD + '\n[gateway.opcua]\nsecurity = "') == ["none", "sign", "encrypt"]
    assert {"name", "file"} <= set(items(WORLD + "\n[[use]]\n"))
    with_part = session(WORLD + '\n[[use]]\nfile = "', part_toml="")
    assert items(WORLD + '\n[[use]]\nfile = "', with_part) == ["part.toml"]
    assert items(WORLD + '\n[[axis]]\nkind = "') == ["linear", "rotary"]
    assert "home_mode" in items("[[mic488]]\nname='t'\n[mic488.M1]\nho")
    assert items(WORLD + "\n[[axis]]\ninverted = ") == ["true", "false"]
    assert items(WORLD + '\n[[mic488]]\nline = "') == ["bus"]
    assert items(WORLD + '\n[[axis]]\ndrive = "table')[:2] == ["table.M1", "table.M2"]
    assert items(WORLD + '\n[[wire]]\nfrom = "')[0] == "table.OUT1"
    assert items(WORLD + '\n[[mic488]]\nprogram = "') == ["a.prg"]
    assert items(WORLD + '\n[[script]]\nsteps = [\n{ press = "') == ["start"]
    assert {"until", "move", "wait_for"} <= set(items(WORLD + "\n[[script]]\nsteps = [\n{ "))
    assert items(WORLD + '\n[[script]]\nsteps = [\n{ move = "')[:2] == ["table.M1", "table.M2"]
    assert items(WORLD + '\n[[brake]]\naxis = "') == ["x"]
    assert items(WORLD + '\n[[collision]]\neffect = "') == ["report", "jam"]
    assert items(WORLD + '\n[[transducer]]\nto = "') == ["table.AIN1", "table.AIN2"]
    assert {"from", "until", "to", "bounce"} <= set(items(WORLD + "\n[[shaft.cam]]\n"))
    assert items("# [[axis]]\n[[mic488]]\n# ") == []


def test_signals_are_completed_where_conditions_and_steps_name_them() -> None:
    script = WORLD + "\n[[script]]\nsteps = [\n{ "
    assert items(script + 'until = "')[:3] == ["table", "bus", "x"]
    assert "time" in items(script + 'until = "t')
    assert items(script + 'until = "x.position > 1 and x.') == ["x.position", "x.lost", "x.stalled", "x.power", "x.speed"]
    assert items(script + "expect = 'not bus.") == ["bus.idle"]
    readable = items(script + 'until = "table.M1.st')
    assert {"table.M1.status", "table.IN1", "table.OUT1", "table.AIN1"} <= set(readable)
    writable = items(script + 'write = { "table.IN1" = 1, "table.')
    assert {"table.M1_EN", "table.OUT1"} <= set(writable)
    assert not {"table.M1.status", "table.IN1"} & set(writable)
    settable = items(script + 'set = { "table.')
    assert {"table.IN1", "table.AIN1"} <= set(settable)
    assert not {"table.M1_EN", "table.OUT1"} & set(settable)
    assert items(script + 'write = { "') == ["table"]
    assert items(WORLD + '\n[[collision]]\nwhen = "x.') == ["x.position", "x.lost", "x.stalled", "x.power", "x.speed"]
    assert items(script + 'until = "nothing.') == []
    assert items(script + 'note = "table.') == []
    assert "within" not in items(script + 'until = "x.position > 1", ')  # a key follows, no signal


CYLINDER = '\n[[cylinder]]\nname = "ram"\nstroke = 50.0\nextend_time = "1 s"\nextend = "table.OUT1"\n'


def test_signals_of_elements_are_completed_while_other_tables_are_wrong() -> None:
    wrong = WORLD + CYLINDER + "\n[[script]]\nname = 5\nsteps = [\n{ until = '"
    made = session(wrong)
    assert {"ram", "start"} <= set(items(wrong, made))
    for typed, signals in {"ram.": ["extend", "extended", "retracted", "position"], "start.": ["pressed"]}.items():
        made.open(URI, "", 2, wrong + typed)
        assert items(wrong + typed, made) == [f"{typed}{signal}" for signal in signals]
    load = WORLD + CYLINDER + "\n[[load]]\nname = 'part'\naxis = 'x'\nwhen = 'ram.posi"
    assert "ram.position" in items(load)
    broken = wrong.replace("stroke = 50.0", "stroke = ") + "ram."
    made.open(URI, "", 3, broken)
    assert "ram.position" in items(broken, made)


def test_signals_of_elements_in_used_files_are_completed() -> None:
    text = '[[mic488]]\nname = "table"\n[[use]]\nfile = "part.toml"\nname = "left"\n[[event]]\nwhen = "'
    part = '[parameters]\n[[button]]\nname = "go"\nto = "table.IN1"\n'
    assert "left_go" in items(text, session(text, part_toml=part))
    assert items(text + "left_go.", session(text + "left_go.", part_toml=part)) == ["left_go.pressed"]


_STOP = re.compile(r"""\$\{\d+\|(\w+)[^}]*\}|\$\{\d+:(\w+)\}|(?<=")\$\d(?=")|\$[1-9]""")
"""Of a snippet, with the first word or the default of it."""


def test_every_snippet_of_a_table_has_the_keys_that_it_needs() -> None:
    found = [item for item in of(session(WORLD + "\n[")).items(len(WORLD) + 2).items if item.is_snippet]
    assert len(found) > 40
    for item in found:
        text = _STOP.sub(lambda stop: stop[1] or stop[2] or "1", item.insert).removesuffix("$0")
        assert tomllib.loads(text), item
        keys = {line.partition(" = ")[0] for line in text.splitlines()[1:]}
        name = item.label.strip("[]").rpartition(".")[2]
        assert {key.name for key in all_keys().get(name, ()) if key.is_required} <= keys, item.label


def test_hovers_of_signals() -> None:
    analysis = of(session())
    for mark, text in {
        "M1_EN": "`table.M1_EN`: ",
        "M1.status ==": "5 = position error",
        "position > 10": "`x.position`: position of the axis x. Unit: mm.",
    }.items():
        found = analysis.hover(WORLD.index(mark))
        assert (found is None) if text is None else (found is not None and text in found.text), (mark, found)


def test_hovers() -> None:
    analysis = of(session())
    for mark, text in {
        "pitch": "Units per motor revolution",
        "[[axis]]": "* `drive`: what drives it",
        "unit = ": "`unit` of `mic488.M1`",
        "table.IN5": "`table`: controller, named in line 8",
    }.items():
        found = analysis.hover(WORLD.index(mark))
        assert found is not None, mark
        assert text in found.text


def test_a_rename_changes_names_and_conditions_but_no_notes() -> None:
    made = session()
    edits = navigation.rename(made, URI, WORLD.index('name = "table"') + 9, "bench")
    text = WORLD
    for edit in sorted(edits[URI], key=lambda edit: -edit.span.start):
        text = text[: edit.span.start] + edit.text + text[edit.span.end :]
    assert text == WORLD.replace('"table', '"bench').replace("and table.", "and bench.")
    assert "start the table" in text
    for name, message in (("x", "taken already"), ("1x", "is not a name"), ("idle", "is a signal"), ("TIME", "is a signal")):
        with pytest.raises(Misuse, match=message):
            navigation.rename(made, URI, WORLD.index('name = "table"') + 9, name)


def test_a_rename_reaches_what_elements_and_steps_name() -> None:
    text = WORLD + (
        '[[transducer]]\nname = "gap"\nof = "x.position"\nto = "table.AIN1"\npoints = [[0, 0.0], [9, 9.0]]\n'
        '[[collision]]\nname = "far"\nwhen = "x.position > 90"\n[[shaft]]\nname = "cams"\naxis = "x"\nratio = 0.1\n'
        '[[script]]\nname = "s"\nsteps = [{ home = "table.M1", velocity = -5 }, { move = "table.M1", to = 3 }]\n'
    )
    made = session(text)
    assert of(made).diagnostics() == []
    assert len(navigation.references(made, URI, text.index('name = "x"') + 8)) == 5
    assert len(navigation.references(made, URI, text.index('"table.IN1"') + 2)) == 9


SPACE = """
[[cylinder]]
name = "lift"
extend = "table.OUT1"
stroke = 50
on = "x"
along = "-z"

[[body]]
name = "head"
on = "lift"
at = [0, 0, -20]
size = [10, 10, 10]

[[body]]
name = "post"
at = [0, 0, -500]
size = [10, 10, 10]

[[body]]
name = "workpiece"
at = [90, 0, -35]
size = [10, 10, 10]

[[nest]]
name = "tray"
at = [900, 0, 0]

[[conveyor]]
name = "belt"
length = 100
speed = 10
run = "table.OUT3"
[[conveyor.sensor]]
at = 5
sees = "workpiece"
to = "table.IN7"

[[collision]]
name = "crash"
between = ["head", "post", "workpieces"]
except = [["lift", "post"]]

[[beam]]
name = "gate"
at = [0, 0, -30]
length = 100
sees = ["workpieces", "head", "workpiece"]
to = "table.IN8"
"""


def test_elements_in_space_are_found_and_renamed_where_others_name_them() -> None:
    text = WORLD + SPACE
    made = session(text)
    assert of(made).diagnostics() == []
    for name, count in (("x", 3), ("lift", 3), ("head", 3), ("post", 3), ("workpiece", 2), ("tray", 1)):
        place = text.index(f'name = "{name}"') + 8
        assert len(navigation.references(made, URI, place)) == count, name
    renamed = navigation.rename(made, URI, text.index('name = "lift"') + 8, "ram")[URI]
    assert sorted(edit.span.start for edit in renamed) == [found.start() for found in re.finditer("lift", text)]
    used = text.index('on = "lift"') + 7
    (defined,) = navigation.definition(made, URI, used)
    assert text[defined.span.start : defined.span.end] == "lift"


def test_keys_of_places_are_completed() -> None:
    text = WORLD + SPACE
    placed = ["x", "lift", "belt", "tray", "head", "post", "workpiece", "gate"]
    assert items(text + '\n[[body]]\non = "') == placed
    assert items(text + '\n[[collision]]\nbetween = ["') == ["workpieces", *placed]
    assert items(text + '\n[[collision]]\nbetween = ["head", "p') == ["workpieces", *placed]
    assert items(text + '\n[[collision]]\nexcept = [["head", "post"], ["') == placed
    assert items(text + "\n[[beam]]\nsees = [") == ["workpieces", *placed]
    assert items(text + '\n[[cylinder]]\nalong = "') == ["+x", "-x", "+y", "-y", "+z", "-z"]
    assert items(text + '\n[[tool]]\nalong = ["+x", "') == ["+x", "-x", "+y", "-y", "+z", "-z"]
    assert items(text + '\n[[supply]]\nfeeds = ["') == ["table"]
    assert items(text + "\n[[body]]\nsize = [") == []
    found = {item.label: item.insert for item in of(session(text + "\n[[collision]]\n")).items(len(text) + 16).items}
    assert found["between"] == 'between = ["$1", "$2"]'
    assert found["except"] == 'except = [["$1", "$2"]]'
    found = {item.label: item.insert for item in of(session(text + "\n[[body]]\n")).items(len(text) + 10).items}
    assert found["at"] == "at = [${1:0}, ${2:0}, ${3:0}]"
    assert found["on"] == 'on = "$1"'
    hover = of(session(text)).hover(text.index("sees = [") + 1)
    assert hover is not None
    assert "`sees` of `beam`" in hover.text


def test_files_are_links_and_programs_look_at_the_files_of_their_world() -> None:
    made = session()
    links = of(made).links()
    assert [link.uri for link in links] == ["file:///m/a.prg", "file:///m/rows.csv"]
    (place,) = navigation.definition(made, URI, WORLD.index("a.prg"))
    assert place.uri == PROGRAM_URI
    made.open(PROGRAM_URI, "wbc", 1, "PULSE(OUT1, 1)\nMOVEPTP @row\nM1 = ON\nEND\n")
    # Firmware 1.23 has no PULSE; the row is in the table that the world names.
    assert [d.code for d in of(made, PROGRAM_URI).diagnostics()] == ["W139"]
    assert set(made.affected(PROGRAM_URI)) == {PROGRAM_URI, URI}
    made.open("file:///m/rows.csv", "", 1, "row;1;x;x;x\n")
    assert [use.uri for use in navigation.references(made, "file:///m/rows.csv", 1)] == ["file:///m/rows.csv", PROGRAM_URI]


def test_a_world_reads_only_what_lies_beside_it() -> None:
    made = session(WORLD.replace("a.prg", "../../etc/passwd"))
    (found,) = of(made).diagnostics()
    assert "is outside the folder" in found.message


def test_while_a_world_is_no_toml_its_programs_keep_their_firmware() -> None:
    made = session()
    made.open(PROGRAM_URI, "wbc", 1, "PULSE(OUT1, 1)\nEND\n")
    assert [d.code for d in of(made, PROGRAM_URI).diagnostics()] == ["W139"]
    made.open(URI, "", 2, WORLD + "[[")
    assert [d.code for d in of(made, PROGRAM_URI).diagnostics()] == ["W139"]


LINES = [
    *WORLD.splitlines(),
    "[[",
    "[mic488",
    "x =",
    'y = "',
    "'''",
    "steps = [",
    "]",
    "{ press = ",
    "[[axis]]",
    "a.b.c = 1",
    "[axis.motor]",
    "torque = [[0, 1]]",
]


@given(st.lists(st.sampled_from(LINES), max_size=16), st.data())
def test_every_question_about_any_text_is_answered(lines: list[str], data: st.DataObject) -> None:
    text = "\n".join(["[world]", *lines])
    made = session(text)
    analysis = of(made)
    place = data.draw(st.integers(0, len(text)))
    for diagnostic in analysis.diagnostics():
        assert 0 <= diagnostic.span.start <= diagnostic.span.end <= len(text)
    analysis.hover(place)
    for item in analysis.items(place).items:
        assert item.span.start <= place <= item.span.end
    for section in analysis.outline():
        assert section.span.start <= section.name_span.start <= section.name_span.end <= section.span.end
    for fold in analysis.folds():
        assert fold.first < fold.last < len(analysis.lines.starts)
    for one, other in zip(analysis.tokens(), analysis.tokens()[1:], strict=False):
        assert one.span.end <= other.span.start
    assert analysis.signature(place) is None
    analysis.links()
    navigation.definition(made, URI, place)
    navigation.fixes(made, URI, Span(0, len(text)))
    navigation.workspace_symbols(made, "")
