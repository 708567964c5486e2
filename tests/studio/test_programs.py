"""The texts of programs that viewers can read."""

from __future__ import annotations

from tests.support.studio_rig import ENGINEER, OPERATOR, VIEWER, Studio

from steptwin.simulation.script import steps as do

WORLD = """
    [world]
    name = "hall"
    [[line]]
    name = "bus"
    kind = "modbus"
    [[mic488]]
    name = "table"
    line = "bus"
    programs = { 0 = "a.prg", 2 = "b.prg" }
    positions = { 0 = "p.csv" }
    [[line]]
    name = "chips"
    kind = "m1486"
    [[m1486]]
    name = "drum"
    line = "chips"
    address = 7
"""
LOOP = b"START:\nDELAY 1\nJUMP START\n"
FILES = {"a.prg": LOOP, "b.prg": b"DELAY 1\n", "p.csv": b"home;1;2;3;4\n"}


def test_texts_are_listed_with_the_line_of_the_one_that_runs() -> None:
    studio = Studio(WORLD, files=FILES)
    tab = studio.open()
    listed = tab.ok("programs")
    assert [(one["controller"], one["place"], one["name"], one["language"]) for one in listed if not one["empty"]] == [
        ("table", "program 0", "a.prg", "wbc"),
        ("table", "program 2", "b.prg", "wbc"),
        ("table", "positions 0", "p.csv", "csv"),
    ]
    assert [one["place"] for one in listed if one["empty"]] == [
        *(f"program {bank}" for bank in (1, 3, 4, 5)),
        *(f"positions {bank}" for bank in range(1, 6)),
        "program",
    ]
    assert not any(one["running"] or one["line"] for one in listed)
    assert {(one["language"], one["suffix"], one["has_statements"], one["is_typed"]) for one in listed} == {
        ("wbc", ".prg", True, False),
        ("csv", ".csv", False, False),
        ("m1486", ".m1486", True, True),
    }
    tab.ok("program", controller="table", action="start")
    studio.run(200)
    assert [one["place"] for one in tab.ok("programs") if one["running"]] == ["program 0"]
    assert tab.ok("program_text", controller="table", place="program 0")["line"] == 2
    tab.ok("program", controller="table", action="pause")
    studio.run(2000)
    paused = tab.ok("programs")[0]
    assert paused["running"] is False
    assert paused["line"] is not None


def test_a_viewer_reads_a_text_with_what_the_checker_finds() -> None:
    files = {**FILES, "b.prg": b"DELAY 1\nJUMP LAST\nDELAY 2\nLAST:\nEND\n"}
    tab = Studio(WORLD, files=files, tokens=True).open(token=VIEWER)
    text = tab.ok("program_text", controller="table", place="program 2")
    assert text["text"] == files["b.prg"].decode()
    assert [(one["line"], one["column"], one["severity"]) for one in text["diagnostics"]] == [(3, 1, "warning")]
    assert tab.ok("program_text", controller="table", place="program 0")["diagnostics"] == []


def test_a_text_of_a_chip_runs_only_while_it_is_what_is_stored() -> None:
    world = WORLD + '    program = "drum.m1486"\n'
    studio = Studio(world, files={**FILES, "drum.m1486": b"[\n@1\nw2000\nJ1\n]\n"})
    tab = studio.open()
    studio.run(200)
    text = tab.ok("program_text", controller="drum", place="program")
    assert (text["language"], text["running"], text["line"]) == ("m1486", True, 3)
    for step in (b"k\r", b"\\\r", b"w3000\r"):
        studio.world.apply_input(do.Send("chips", step))
    studio.run(100)
    assert studio.world.m1486["drum"].chip.program.ready > studio.world.now
    assert tab.ok("program_text", controller="drum", place="program")["running"] is False


def test_a_text_that_is_not_there_is_named_with_those_that_are() -> None:
    tab = Studio(WORLD, files=FILES).open()
    assert tab.error("program_text", controller="drum", place="program 0") == (
        "misuse",
        "drum has no place 'program 0' for a program: places are program",
    )
    assert "places are program 0, program 1, " in tab.error("program_text", controller="table", place="x")[1]
    assert tab.error("program_text", controller="x", place="x") == ("misuse", "there is no controller 'x': there are table, drum")


def test_an_engineer_downloads_a_program_and_the_log_has_it() -> None:
    studio = Studio(WORLD, files=FILES, tokens=True)
    operator = studio.open(token=OPERATOR)
    fields = {"controller": "table", "place": "program 0", "text": "$R4 = 7\nEND\n"}
    assert operator.error("download", **fields)[0] == "refusal"
    tab = studio.open(token=ENGINEER)
    tab.ok("download", **fields)
    tab.ok("program", controller="table", action="start")
    studio.run(200)
    assert tab.ok("read", points=["table.USER_REGISTER[4]:real"])[0]["value"] == 7.0
    text = tab.ok("program_text", controller="table", place="program 0")
    assert (text["text"], text["name"], text["diagnostics"]) == (fields["text"], "a.prg", [])
    entry = tab.ok("audit")[0]
    assert (entry["do"], entry["viewer"], entry["outcome"]) == ("download", "piotr (viewer 1)", "refusal")
    assert [entry["do"] for entry in tab.ok("audit") if entry["outcome"] == "done"][:2] == ["download", "program"]
