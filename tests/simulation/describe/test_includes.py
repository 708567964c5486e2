"""Files of tables that a description uses: names, parameters, places of errors, overrides, recordings."""

from __future__ import annotations

import pickle
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from steptwin.errors import Misuse
from steptwin.files import recording as recordings
from steptwin.files.world import World
from steptwin.simulation.describe import includes
from steptwin.simulation.describe.description import describe
from steptwin.simulation.describe.includes import FILE_KEYS, MOST_NESTED, Includes, beside, given_files, no_files, normal
from steptwin.simulation.describe.tables import tables
from steptwin.simulation.kinds.registry import KINDS
from steptwin.simulation.toml.reader import TomlText, WorldError
from steptwin.simulation.world.check import diagnose

STATION = """\
[parameters]
drive = {}
limit = {}
length = 300.0

[[axis]]
name = "x"
drive = "{drive}"
pulses_per_unit = 100
travel = [-2.0, "{length}"]

[[axis.switch]]
above = 50.0
to = "{limit}"

[[collision]]
name = "stop"
when = "x.position >= {length} - 1 or x.lost > 0"

[[event]]
name = "far"
when = "x.position > 20 and not stop.hit"
steps = [{ note = "x has {{left}} {length}" }, { set = { "table.IN9" = 1 } }]
"""
MAIN = """\
[[mic488]]
name = "table"

[[use]]
name = "left"
file = "parts/station.toml"
with = { drive = "table.M1", limit = "table.IN1" }

[[use]]
name = "right"
file = "parts/station.toml"
with = { drive = "table.M2", limit = "table.IN2", length = 120 }
"""
FILES = {"parts/station.toml": STATION.encode()}


def wrong(text: str, files: Mapping[str, str] | None = None) -> str:
    given = FILES if files is None else {name: content.encode() for name, content in files.items()}
    with pytest.raises(WorldError) as caught:
        World.from_toml(text, given, name="m.toml")
    return str(caught.value)


def test_each_use_has_its_names_and_parameters() -> None:
    data = describe("m.toml", MAIN, read=given_files(FILES)).text.data
    assert [axis["name"] for axis in data["axis"]] == ["left_x", "right_x"]
    assert [axis["drive"] for axis in data["axis"]] == ["table.M1", "table.M2"]
    assert [axis["travel"][1] for axis in data["axis"]] == [300.0, 120]
    assert [axis["switch"][0]["to"] for axis in data["axis"]] == ["table.IN1", "table.IN2"]
    assert data["collision"][1]["when"] == "right_x.position >= 120 - 1 or right_x.lost > 0"
    assert data["event"][0]["when"] == "left_x.position > 20 and not left_stop.hit"
    assert data["event"][1]["when"] == "right_x.position > 20 and not right_stop.hit"
    assert data["event"][0]["steps"] == [{"note": "x has {left} 300.0"}, {"set": {"table.IN9": 1}}]


def test_a_world_of_two_runs_as_the_one_that_is_written_out() -> None:
    """Compared with the same machine as a single text."""
    out = MAIN[: MAIN.index("[[use]]")]
    tables = STATION[STATION.index("[[axis]]") :].split("\n\n")
    for side, drive, limit, length in (("left", "M1", "IN1", 300.0), ("right", "M2", "IN2", 120)):
        text = "\n\n".join(tables).replace('"x"', f'"{side}_x"').replace("x.", f"{side}_x.").replace('"stop"', f'"{side}_stop"')
        text = text.replace("stop.hit", f"{side}_stop.hit").replace('"far"', f'"{side}_far"').replace('"{length}"', f"{length}")
        out += text.replace("{drive}", f"table.{drive}").replace("{limit}", f"table.{limit}").replace("{length}", f"{length}")
        out = out.replace("{{left}}", "{left}")
    steps = '\n[[script]]\nname = "s"\nsteps = [{ write = { "table.M1_EN" = 1 } }, { move = "table.M1", to = 6000 }]\n'
    one, other = World.from_toml(MAIN + steps, FILES), World.from_toml(out + steps)
    for world in (one, other):
        world.run(until="left_x.position >= 55", for_="1 min")
        assert world.now > 0
    assert one.trace.digest() == other.trace.digest()


@pytest.mark.parametrize(
    ("change", "messages"),
    [
        (
            ("length = 120", "lenght = 120"),
            ["m.toml:12:51: error D004", "no parameter 'lenght' (did you mean 'length'?)", "parameters are drive"],
        ),
        ((', limit = "table.IN2"', ""), ["m.toml:9:1: error D005: parts/station.toml: limit is missing"]),
        (
            ("length = 120", "length = 'far'"),
            ["parts/station.toml:10:1: error D003", "'far': expected a number", "used in m.toml:9"],
        ),
        (
            ('"table.M2"', '"tabel.M2"'),
            ["parts/station.toml:8:1: error D009: nothing is called 'tabel' (did you mean 'table'?)", "used in m.toml:9"],
        ),
        (
            ('"table.IN2"', '"table.IN1"'),
            [
                "station.toml:12:1: error D009: table.IN1 is driven already, from line 14 of parts/station.toml",
                "used in m.toml:9",
            ],
        ),
        (('"right"', '"left"'), ["error D006", "'left_x'", "used in m.toml:9"]),
        (('name = "right"\n', ""), ["m.toml:9:1: error D005: [use]: name is missing"]),
        (
            ('name = "right"', 'name = "right"\nfiel = 1'),
            ["m.toml:11:1: error D004: [use] has no 'fiel' (did you mean 'file'?)"],
        ),
        (
            ("length = 120 }", 'length = 120 }\n[[button]]\nname = "b"\nto = "table.IN1"\n'),
            ["m.toml:13:1: error D009: table.IN1 is driven already, from line 14 of parts/station.toml"],
        ),
        (('with = { drive = "table.M2"', "with = 3 #"), ["m.toml:12:1: error D002: with is 3"]),
        (
            ("parts/station.toml", "parts/none.toml"),
            ["m.toml:11:1: error D009: file = 'parts/none.toml': the content of the file"],
        ),
    ],
)
def test_errors_name_the_file_and_where_it_is_used(change: tuple[str, str], messages: list[str]) -> None:
    assert change[0] in MAIN
    before, _, after = MAIN.rpartition(change[0])
    found = wrong(before + change[1] + after)
    for message in messages:
        assert message in found


def test_an_error_of_the_file_is_shown_once_with_all_places_that_use_it() -> None:
    found = wrong(MAIN, {"parts/station.toml": STATION.replace("above = 50.0", "abov = 50.0")})
    assert found.count("[axis.switch] has no 'abov' (did you mean 'above'?)") == 1
    assert "parts/station.toml:13:1: error D004" in found
    assert "used in m.toml:4, 9" in found
    assert found.count("error") == 2  # and that the switch has no zone


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[axis]\n", "parts/station.toml:1:"),
        ("[world]\nseed = 1\n", "parts/station.toml:1:1: error D004: [world] is for the description"),
        ("[axis]\nname = 'x'\n", "parts/station.toml:1:1: error D002: [axis] is a single table"),
        ("[[axes]]\n", "parts/station.toml:1:1: error D004: the file has no [axes] (did you mean 'axis'?)"),
        ("parameters = 3\n", "parts/station.toml:1:1: error D002: parameters is 3"),
        (
            "[parameters]\ndrive={}\nlimit={}\nlength=1\n[[axis]]\nname='x'\ndrive='{driv}'\n",
            ":7:1: error D004: the file has no parameter 'driv' (did you mean 'drive'?)",
        ),
        ("[[use]]\nname = 'a'\nfile = 'station.toml'\n", "parts/station.toml uses parts/station.toml, itself"),
        ("[[use]]\nname = 'a'\nfile = '../parts/./station.toml'\n", "parts/station.toml uses parts/station.toml, itself"),
    ],
)
def test_files_that_cannot_be_used_are_refused(text: str, message: str) -> None:
    assert message in wrong(MAIN, {"parts/station.toml": text})


def test_pieces_use_pieces_and_files_beside_them() -> None:
    files = {
        "cells/cell.toml": """
[parameters]
size = 1.5
[[mic488]]
name = "c"
program = "run.prg"
programs = ["a.prg", "../b.prg"]
[[use]]
name = "arm"
file = "parts/arm.toml"
with = { host = "c", height = "{size}" }
[[event]]
when = "arm_x.position > {size}"
steps = [{ note = "c" }, { move = "c.M1", to = 3 }]
""",
        "cells/parts/arm.toml": """
[parameters]
host = {}
height = 1
[[axis]]
name = "x"
drive = "{host}.M1"
pulses_per_unit = 10
start = "{height}"
""",
    }
    text = '[[use]]\nname = "one"\nfile = "cells/cell.toml"\nwith = { size = 2.5 }\n'
    spec = describe("m.toml", text, read=given_files({name: content.encode() for name, content in files.items()}))
    data = spec.text.data
    assert data["mic488"][0] == {"name": "one_c", "program": "cells/run.prg", "programs": ["cells/a.prg", "b.prg"]}
    assert data["axis"][0] == {"name": "one_arm_x", "drive": "one_c.M1", "pulses_per_unit": 10, "start": 2.5}
    assert data["event"][0]["when"] == "one_arm_x.position > 2.5"
    assert data["event"][0]["steps"] == [{"note": "c"}, {"move": "one_c.M1", "to": 3}]
    assert [name for name, _ in spec.files()][:2] == ["cells/cell.toml", "cells/parts/arm.toml"]
    broken = files | {"cells/parts/arm.toml": files["cells/parts/arm.toml"].replace("height = 1", "")}
    found = wrong(text, broken)
    assert "cells/cell.toml:11:22: error D004: cells/parts/arm.toml has no parameter 'height'" in found
    assert "used in m.toml:1" in found
    broken = files | {"cells/parts/arm.toml": files["cells/parts/arm.toml"].replace("_unit = 10", "_unit = -1")}
    assert "cells/parts/arm.toml:8:1: error D003" in (found := wrong(text, broken))
    assert "used in cells/cell.toml:8\n  used in m.toml:1" in found


def test_files_that_use_one_another_without_end_are_refused() -> None:
    text = '[[use]]\nname = "a"\nfile = "p{n}.toml"\n[[use]]\nname = "b"\nfile = "p{n}.toml"\n'
    nested = {f"p{n}.toml": text.replace("{n}", str(n + 1)) for n in range(40)}
    assert f"{MOST_NESTED} in one another" in wrong('[[use]]\nname = "a"\nfile = "p0.toml"\n', nested)


@pytest.mark.parametrize("key", ["left.length", "use.left.with.length", "left.with.length"])
def test_parameters_are_overridden(key: str) -> None:
    world = World.from_toml(MAIN, FILES, overrides={key: 33.0})
    assert world.spec.text.data["axis"][0]["travel"] == [-2.0, 33.0]
    assert world.spec.text.data["axis"][1]["travel"] == [-2.0, 120]


def test_what_a_use_gives_is_overridden_by_its_name() -> None:
    data = World.from_toml(MAIN, FILES, overrides={"right_x.pulses_per_unit": 7, "axis.left_x.backlash": 0.5}).spec.text.data
    assert (data["axis"][1]["pulses_per_unit"], data["axis"][0]["backlash"]) == (7, 0.5)
    with pytest.raises(WorldError, match=r"station\.toml:9:1: error D003: \[axis\]: pulses_per_unit: -7"):
        World.from_toml(MAIN, FILES, overrides={"right_x.pulses_per_unit": -7})
    with pytest.raises(WorldError, match=r"has no parameter 'lenth' \(did you mean 'length'\?\)"):
        World.from_toml(MAIN, FILES, overrides={"left.lenth": 7})
    with pytest.raises(Misuse, match=r"override 'right_y\.start': there is no 'right_y' \(did you mean 'right_x'\?\)"):
        World.from_toml(MAIN, FILES, overrides={"right_y.start": 7})


def test_sessions_snapshots_and_pickles_have_the_files(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "m.toml").write_text(MAIN)
    (tmp_path / "parts/station.toml").write_text(STATION)
    world = World.load(tmp_path / "m.toml", overrides={"left.length": 44})
    world.mic488["table"].write("M1_EN", 1)
    world.mic488["table"].axis[1].move_to(2000)
    world.run(for_="0.3 s")
    twin = pickle.loads(pickle.dumps(world))
    recordings.save(recordings.recording_of(world), tmp_path / "s.json")
    (tmp_path / "parts/station.toml").unlink()
    again = recordings.load(tmp_path / "s.json").replay()
    other = world.branch()
    for one in (world, twin, again, other):
        one.go_on()
        one.run(for_="5 s")
        assert one.axis["left_x"].position == world.axis["left_x"].position > 0.0
    assert twin.trace.digest() == again.trace.digest() == other.trace.digest() == world.trace.digest()


def test_files_from_outside_the_folder_are_refused(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "station.toml").write_text(STATION)
    (tmp_path / "in/m.toml").write_text(MAIN.replace("parts/", "../"))
    with pytest.raises(WorldError, match="outside"):
        World.load(tmp_path / "in/m.toml")
    assert World.load(tmp_path / "in/m.toml", allow_outside=True).axis["left_x"].position == 0.0


def test_editors_see_errors_at_the_use_and_none_in_the_file_itself() -> None:
    broken = {"parts/station.toml": STATION.replace("above", "abov").encode()}
    found = diagnose("m.toml", MAIN, given_files(broken)).findings
    assert {finding.span.start for finding in found} == {MAIN.index("[[use]]"), MAIN.rindex("[[use]]")}
    assert all(finding.message.startswith("a file has errors: parts/station.toml:") for finding in found)
    assert diagnose("station.toml", STATION, given_files({})).findings == ()
    with pytest.raises(WorldError, match=r"a file with \[parameters\] is for \[\[use\]\] of a description"):
        World.from_toml(STATION)


def test_files_of_controllers_have_known_keys() -> None:
    for kind in KINDS.values():
        keys: dict[str, Any] = {key.name: key for key in kind.keys}
        assert {"config", "program", "programs", "positions"} & set(keys) <= FILE_KEYS


@pytest.mark.parametrize(
    ("path", "expected"),
    [("a/b.toml", "a/b.toml"), ("a/../b", "b"), ("./a//b/./c", "a/b/c"), ("../../a", "../../a"), ("/a/../b", "/b")],
)
def test_paths_have_one_spelling(path: str, expected: str) -> None:
    assert normal(path) == expected


WHOLE = """\
[parameters]
on = "m.OUT1"
n = {}
[[mic488]]
name = "unit"
unit = 3
program = "p.prg"
[mic488.M1]
unit = "mm"
[[mic488]]
name = "b"
[[line]]
name = "to"
[[gate]]
name = "g"
kind = "or"
inputs = ["b.OUT1", "unit.OUT1", "{on}", "other.OUT1"]
[[body]]
name = "mark"
on = "other"
[[nest]]
name = "tray"
on = "mark"
[[collision]]
between = ["mark", "tray", "workpieces"]
except = [["mark", "tray"], ["tray", "other"]]
[[beam]]
name = "eye"
along = "+x"
sees = ["workpieces", "mark"]
[[conveyor]]
name = "belt"
[[conveyor.sensor]]
sees = "mark"
[[supply]]
feeds = ["unit", "b", "other"]
[[use]]
name = "in"
file = "inner/i.toml"
with = { to = "b.IN1" }
[[fault]]
name = "late"
kind = "delay"
for_ms = "{n}"
[[script]]
name = "s"
steps = [
  { set = { "b.IN1" = 1, "in_k.x" = 0 } },
  { write = { "unit.M1_EN" = 1 } },
  { clear_fault = "late" },
  { note = "b, {{b}} and {n} of g" },
  { until = "g.out and b.unit-g > {n} or in_k.pressed" },
  { repeat = 2, steps = [{ press = "in_k" }, { wait = "1 s" }] },
]
"""
INNER = '[parameters]\nto = {}\n[[button]]\nname = "k"\nto = "{to}"\n[[mic488]]\nname = "i"\nconfig = "../c.cfg"\n'
WRITTEN_OUT = """\
[[mic488]]
name = "u_unit"
unit = 3
program = "d/p.prg"
[mic488.M1]
unit = "mm"
[[mic488]]
name = "u_b"
[[mic488]]
name = "u_in_i"
config = "d/c.cfg"
[[line]]
name = "u_to"
[[gate]]
name = "u_g"
kind = "or"
inputs = ["u_b.OUT1", "u_unit.OUT1", "m.OUT1", "other.OUT1"]
[[body]]
name = "u_mark"
on = "other"
[[nest]]
name = "u_tray"
on = "u_mark"
[[collision]]
between = ["u_mark", "u_tray", "workpieces"]
except = [["u_mark", "u_tray"], ["u_tray", "other"]]
[[beam]]
name = "u_eye"
along = "+x"
sees = ["workpieces", "u_mark"]
[[conveyor]]
name = "u_belt"
[[conveyor.sensor]]
sees = "mark"
[[supply]]
feeds = ["u_unit", "u_b", "other"]
[[fault]]
name = "u_late"
kind = "delay"
for_ms = 5
[[script]]
name = "u_s"
steps = [
  { set = { "u_b.IN1" = 1, "u_in_k.x" = 0 } },
  { write = { "u_unit.M1_EN" = 1 } },
  { clear_fault = "u_late" },
  { note = "b, {b} and 5 of g" },
  { until = "u_g.out and u_b.unit-g > 5 or u_in_k.pressed" },
  { repeat = 2, steps = [{ press = "u_in_k" }, { wait = "1 s" }] },
]
[[button]]
name = "u_in_k"
to = "u_b.IN1"
"""


def put_in(text: str, files: Mapping[str, str]) -> TomlText:
    found = TomlText("m.toml", text)
    read = given_files({name: content.encode() for name, content in files.items()})
    Includes(read, tables(), ("mic488",), ()).put_into(found)
    return found


def test_a_use_is_what_it_stands_for_written_out() -> None:
    """Only what names something is renamed: not keys, not units, not parts of longer words."""
    found = put_in('[[use]]\nname = "u"\nfile = "d/w.toml"\nwith = { n = 5 }\n', {"d/w.toml": WHOLE, "d/inner/i.toml": INNER})
    assert found.findings == []
    assert found.data == tomllib.loads(WRITTEN_OUT)


def test_as_many_uses_as_are_permitted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(includes, "MOST_INCLUDES", 3)
    one = '[[use]]\nname = "u{n}"\nfile = "p.toml"\n'
    for number, findings in ((3, 0), (4, 1)):
        text = "".join(one.replace("{n}", str(n)) for n in range(number))
        assert len(put_in(text, {"p.toml": '[[button]]\nname = "b"\n'}).findings) == findings


@pytest.mark.parametrize(
    ("text", "files", "findings"),
    [
        ("[use]\nname = 'u'\nfile = 'p'\n", {}, ["D002 [use] is a single table"]),
        ("[[use]]\nname = 'u'\nfile = 'p'\n", {"p": "mic488 = ['x']\nbutton = [3, 'b']\n"}, []),
        (
            "[[use]]\nname = 'u'\nfile = 'p'\n",
            {"p": "parameters = 3\n"},
            ["D010 a file has errors: p:1:1: error D002: parameters is 3"],
        ),
        (
            "[[use]]\nname = 'u'\nfile = 'q'\n",
            {},
            ["D009 file = 'q': the content of the file 'q' is not given with the description"],
        ),
        ("[[use]]\nname = 'u'\nfile = 'p'\nwith = 3\n", {"p": ""}, ["D002 with is 3"]),
    ],
)
def test_what_is_wrong_with_a_use_is_told_once(text: str, files: dict[str, str], findings: list[str]) -> None:
    assert [f"{found.code} {found.message}" for found in put_in(text, files).findings] == findings


@pytest.mark.parametrize("file", ["[[button", None])
def test_what_a_use_would_have_given_is_not_missed(file: str | None) -> None:
    """Only the file is told, not each name that it would have given."""
    text = (
        '[[mic488]]\nname = "t"\n[[use]]\nname = "left"\nfile = "p.toml"\n[[event]]\nwhen = "left_x.position > 1"\nsteps = []\n'
    )
    found = wrong(text, {} if file is None else {"p.toml": file})
    assert "left_x" not in found
    assert found.count("error ") == 1


def test_without_files_a_description_uses_none() -> None:
    with pytest.raises(Misuse, match=r"the content of the file 'p\.toml' is not given"):
        no_files("p.toml")


@pytest.mark.parametrize(
    ("file", "name", "found"),
    [
        ("a/b.toml", "c", "a/c"),
        ("a\\b.toml", "c", "a\\c"),
        ("a/b/c.toml", "../d", "a/b/../d"),
        ("b.toml", "c", "c"),
        ("a/b.toml", "/c", "/c"),
        ("a/b.toml", "\\c", "\\c"),
        ("a/b.toml", "C:c", "C:c"),
        ("a/b.toml", "C:", "C:"),
        ("a/b.toml", "cC:x", "a/cC:x"),
    ],
)
def test_a_file_beside_another(file: str, name: str, found: str) -> None:
    assert beside(file, name) == found


def test_a_file_that_is_no_text_is_refused() -> None:
    with pytest.raises(WorldError, match=r"cannot read parts/station\.toml: it is not UTF-8 text"):
        World.from_toml(MAIN, {"parts/station.toml": b"\xff\xfe[\0"})


def test_editors_see_errors_of_a_controllers_file_at_the_use() -> None:
    """They have places of their own in that file, not in the include that names it."""
    main = '# two chips\n[[use]]\nname = "left"\nfile = "parts/chip.toml"\n[[mic488]]\nname = "a"\n'
    files = {"parts/chip.toml": b'[[m1486]]\nname = "chip"\nprogram = "p.txt"\n', "parts/p.txt": b"xx\n"}
    (found,) = diagnose("m.toml", main, given_files(files)).findings
    assert found.span.start == main.index("[[use]]")
    assert found.message == "a file has errors: parts/p.txt:1:2: error M105: address expected, found 'x'"
