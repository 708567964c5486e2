"""Texts that are put into the program memories of controllers while a world runs."""

from __future__ import annotations

import pickle
import tomllib
from collections.abc import Mapping

import pytest

from steptwin.controller import SECOND
from steptwin.errors import Misuse, Refusal, SourceErrors
from steptwin.files.recording import recording_of
from steptwin.files.world import World
from steptwin.mic488.config import read_config
from steptwin.mic488.inifile import IniFile
from steptwin.simulation.kinds.m1486.kind import M1486
from steptwin.simulation.kinds.programs import StatementSubscription
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.inputs import Download
from steptwin.simulation.world.worldprograms import WorldPrograms, configuration_text, program_texts
from steptwin.subject.commands import ControlProgram
from steptwin.subject.world import WorldSubject

WORLD = """
[world]
name = "hall"
[[line]]
name = "bus"
kind = "modbus"
[[mic488]]
name = "table"
line = "bus"
program = "a.prg"
positions = "p.csv"
[[line]]
name = "chips"
kind = "m1486"
[[m1486]]
name = "drum"
line = "chips"
variant = "B"
address = 7
[[m1486]]
name = "feeder"
line = "chips"
variant = "E1"
address = 9
[[m1486]]
name = "alone"
"""
FILES = {"a.prg": b"LOOP:\n$R0 = $R0 + 1\nDELAY 0.1\nJUMP LOOP\n", "p.csv": b"HOME;1;2;3;4\n"}


def world(files: Mapping[str, bytes] = FILES, more: str = "") -> World:
    """``more``: keys of the MIC488."""
    return World.from_toml(WORLD.replace('positions = "p.csv"', f'positions = "p.csv"\n{more}'), files)


def start(there: World) -> None:
    WorldSubject(there).do(ControlProgram("table", "start"))


def test_a_program_runs_from_its_next_start_on() -> None:
    there = world()
    there.apply_input(Download("table", "program 0", "M1 = ON\nPABS M1 5\n$R4 = 9\nEND\n"))
    start(there)
    there.run(for_="1 s")
    assert there.read("table.USER_REGISTER[4]:real") == 9.0
    text = WorldPrograms(there).text("table", "program 0")
    assert (text.name, text.text) == ("a.prg", "M1 = ON\nPABS M1 5\n$R4 = 9\nEND\n")


def test_names_of_positions_are_those_of_the_table_of_the_bank() -> None:
    there = world()
    with pytest.raises(SourceErrors, match=r"a\.prg:1:9"):
        there.apply_input(Download("table", "program 0", "MOVEPTP @PICK\n"))
    there.apply_input(Download("table", "positions 0", "HOME;1;2;3;4\nPICK;5;x;x;x\n"))
    there.apply_input(Download("table", "program 0", "M1 = ON\nMOVEPTP @PICK\nDELAY 1\n$R6 = 1\nEND\n"))
    start(there)
    there.run(for_="2 s")
    assert there.read("table.USER_REGISTER[6]:real") == 1.0
    assert WorldPrograms(there).text("table", "positions 0").text == "HOME;1;2;3;4\nPICK;5;x;x;x\n"


@pytest.mark.parametrize(
    ("place", "text", "error", "message"),
    [
        ("program 0", "DELAY\n", SourceErrors, "a.prg:1:1: error"),
        ("positions 0", "HOME;1;2\n", SourceErrors, "p.csv:1:1: error"),
        ("program 6", "END\n", Misuse, "table has no place 'program 6' for a program: places are program 0, "),
    ],
)
def test_what_is_wrong_is_refused_and_nothing_changes(place: str, text: str, error: type[Exception], message: str) -> None:
    there = world()
    before = there.controllers["table"].snapshot()
    with pytest.raises(error) as refused:
        there.apply_input(Download("table", place, text))
    assert str(refused.value).startswith(message)
    assert there.controllers["table"].snapshot() == before
    assert not there.inputs


def test_a_program_that_runs_is_stopped_first() -> None:
    there = world()
    start(there)
    for place in ("program 0", "positions 0"):
        with pytest.raises(Refusal, match=f"{place} is in use by the program that runs or is paused: stop it first"):
            there.apply_input(Download("table", place, "END\n"))
    there.apply_input(Download("table", "program 3", "END\n"))
    WorldSubject(there).do(ControlProgram("table", "stop"))
    there.apply_input(Download("table", "program 0", "END\n"))


def test_snapshots_and_copies_have_what_was_downloaded() -> None:
    there = world()
    first = there.snapshot()
    there.apply_input(Download("table", "program 0", "$R2 = 3\nLOOP:\nDELAY 0.1\nJUMP LOOP\n"))
    there.apply_input(Download("drum", "program", "w5000\n"))
    start(there)
    there.run(for_="500 ms")
    second = there.snapshot()
    there.restore(first)
    programs = WorldPrograms(there)
    assert programs.text("table", "program 0").text == FILES["a.prg"].decode()
    assert programs.text("drum", "program").empty is True
    start(there)
    there.run(for_="1 s")
    assert there.read("table.USER_REGISTER[0]:real") > 5.0
    there.restore(second)
    for one in (there, pickle.loads(pickle.dumps(there))):
        assert one.read("table.USER_REGISTER[2]:real") == 3.0
        assert one.now == SECOND // 2
        assert WorldPrograms(one).text("table", "program 0").line == 3
        assert WorldPrograms(one).text("drum", "program").running is True


def test_a_session_has_what_was_downloaded() -> None:
    there = world()
    there.apply_input(Download("table", "program 0", "$R2 = 3\n"))
    there.apply_input(Download("feeder", "program", "f640\nr\n"))
    start(there)
    there.run(for_="5 s")
    recording = recording_of(there)
    assert recording.replay().trace.digest() == recording.digest


def test_a_program_is_typed_to_a_chip_and_runs_then() -> None:
    there = world()
    there.apply_input(Download("drum", "program", "f640 ; a full turn\nr\nw1000\n"))
    there.run(for_="500 ms")
    assert there.read("drum.position") == 640.0
    text = WorldPrograms(there).text("drum", "program")
    assert (text.text, text.running, text.empty) == ("f640 ; a full turn\nr\nw1000\n", True, False)
    there.apply_input(Download("drum", "program", "[\nb640\nr\n]\n"))
    there.run(for_="1 s")
    assert there.read("drum.position") == 0.0


def test_a_chip_that_moves_on_and_on_is_stopped_with_its_ramp_first() -> None:
    there = world()
    there.apply_input(Download("drum", "program", "@1\nf6400\nr\nj1\n"))
    there.run(for_="10 s")
    assert there.read("drum.moving") == 1.0
    before = there.read("drum.position")
    there.apply_input(Download("drum", "program", "w1\n"))
    there.run(for_="5 s")
    assert there.read("drum.moving") == 0.0
    assert 0 < there.read("drum.position") - before < 6400
    assert WorldPrograms(there).text("drum", "program").text == "w1\n"


def test_an_eeprom_takes_its_time_and_keeps_the_program() -> None:
    """Erased in 1 s (E1), 0.5 s for each of two commands (chapter II, Memory)."""
    there = world()
    there.apply_input(Download("feeder", "program", "f640\nr\n"))
    there.run(for_="1900 ms")
    assert there.read("feeder.position") == 0.0
    there.run(for_="1500 ms")
    assert there.read("feeder.position") == 640.0
    there.apply_input(do.PowerCycle("feeder"))
    there.run(for_="1 s")
    assert there.read("feeder.position") == 1280.0


@pytest.mark.parametrize(
    ("controller", "text", "error", "message"),
    [
        ("alone", "f640\n", Refusal, "alone is on no line, so nothing can be typed to it"),
        ("drum", "; nothing\n", Misuse, "program has no commands"),
        ("drum", "f0\n", SourceErrors, "program:1:2: error"),
        ("drum", "x3\nf640\n", Misuse, "X3 cannot be stored: a program to switch on with is one file for one chip"),
    ],
)
def test_what_a_chip_does_not_take(controller: str, text: str, error: type[Exception], message: str) -> None:
    there = world()
    with pytest.raises(error) as refused:
        there.apply_input(Download(controller, "program", text))
    assert str(refused.value).startswith(message)


@pytest.mark.parametrize("is_off", [True, False])
def test_a_chip_that_is_shut_down_receives_nothing(is_off: bool) -> None:
    there = world()
    chip = there.m1486["drum"].chip
    if is_off:
        chip.power_off(0)
    else:
        chip.set_pin("SD", 0, 0)
    with pytest.raises(Refusal, match=r"^drum is .*shut down.*, so it receives nothing$"):
        there.apply_input(Download("drum", "program", "f640\n"))
    assert not there.inputs


def test_statements_are_those_of_the_present_texts() -> None:
    there = world()
    seen: list[tuple[str, str, object]] = []
    subscriber = StatementSubscription(
        there.programs, lambda record: seen.append((record.controller, record.subject, record.value))
    )
    there.apply_input(Download("drum", "program", "; two\n\nf640\nr\n"))
    there.apply_input(Download("table", "program 3", "\n\nDELAY 0.5\n"))
    there.apply_input(do.Write((("table", "PROG_BANK_SEL", 3.0),)))
    start(there)
    there.run(for_="1 s")
    subscriber.close()
    assert [row for row in seen if row[0] == "drum"] == [("drum", "program", 3), ("drum", "program", 4)]
    assert ("table", "program 3", 3) in seen


# ---------------------------------------------------------------------- what editors need

CONFIG = b"[Axis0]\r\nGear=100\r\nUnit=3\r\n"


def configured() -> World:
    return world({**FILES, "m.cfg": CONFIG}, 'config = "m.cfg"')


def test_the_texts_of_all_controllers() -> None:
    """Banks 0 to 5 of the MIC488 with firmware 1.70 (MIC-28), the one program of each chip."""
    rows = WorldPrograms(configured()).list()
    places = [*(f"program {bank}" for bank in range(6)), *(f"positions {bank}" for bank in range(6))]
    assert [(row.controller, row.place) for row in rows] == [
        *(("table", place) for place in places), ("drum", "program"), ("feeder", "program"), ("alone", "program"),
    ]  # fmt: skip
    assert [(row.place, row.name) for row in rows if not row.empty] == [("program 0", "a.prg"), ("positions 0", "p.csv")]


def test_files_of_an_editor_server_are_a_description_of_their_own() -> None:
    """It reads back as a world: types, texts in their places, the configuration."""
    there = configured()
    there.apply_input(Download("drum", "program", "w5000\n"))
    files = dict(WorldPrograms(there).files())
    toml = files.pop("steptwin:///world.toml").decode()
    assert files == {
        "steptwin:///table/config.cfg": CONFIG,
        "steptwin:///table/program-0.prg": FILES["a.prg"],
        "steptwin:///table/positions-0.csv": FILES["p.csv"],
        "steptwin:///drum/program.m1486": b"w5000\n",
    }
    tables = tomllib.loads(toml)
    (table,), chips = tables["mic488"], tables["m1486"]
    assert table["config"] == "table/config.cfg"
    assert table["programs"] == {str(bank): f"table/program-{bank}.prg" for bank in range(6)}
    assert table["positions"] == {"0": "table/positions-0.csv"}  # empty tables would be those of all banks
    assert [(chip.get("variant"), chip["program"]) for chip in chips] == [
        ("B", "drum/program.m1486"), ("E1", "feeder/program.m1486"), (None, "alone/program.m1486"),
    ]  # fmt: skip


def test_what_a_text_takes_of_the_memory_of_its_place() -> None:
    description = '[[m1486]]\nname = "c"\nprogram = "p"\n'
    texts = WorldPrograms(World.from_toml(description, {"p": b"[\nf64\nr\n]\n"}))
    (place,) = (one.place for one in texts.list())
    (part,) = texts.memory("c", place, "[\nf64\nr\n]\n")
    assert (part.what, part.most, part.unit) == ("command memory", 254, "bytes")
    (longer,) = texts.memory("c", place, "[\nf64\nr\nf64\nr\n]\n")
    assert [one.used for one in (part, longer)] == [5, 10]
    (wrong,) = texts.memory("c", place, "[\n")
    assert wrong.used == 0
    assert texts.memory("c", place, "[\nhello\n]\n") == []  # no commands
    assert texts.memory("c", place, "x3\nf64\n") == []  # for another chip
    (own,) = texts.memory("c", place, "x3\nf64\nxf\nf64\nr\n")
    assert own.used == 5


def test_what_positions_take_of_the_memory() -> None:
    texts = WorldPrograms(world())
    used = [texts.memory("table", "positions 0", rows)[0].used for rows in ("A;1;2;3;4\n", "A;1;2;3;4\nB;1;2;3;4\n")]
    assert used == [1, 2]


@pytest.mark.parametrize(("variant", "kept"), [("B", False), ("E1", True)])
def test_a_program_to_switch_on_with_stays_in_an_eeprom(variant: str, kept: bool) -> None:
    text = f'[[m1486]]\nname = "c"\nvariant = "{variant}"\nprogram = "p"\n'
    chip = World.from_toml(text, {"p": b"[\nf64\nr\n]\n"}).m1486["c"].chip
    images: list[bytes] = []
    M1486.keep_memory(chip, chip.image, images.append)
    assert images == []
    M1486.keep_memory(chip, None, images.append)
    assert images == ([chip.image] if kept else [])


def test_positions_have_a_place_even_while_none_are_there() -> None:
    empty = World.from_toml('[[mic488]]\nname = "m"\nfirmware = "1.40"\n')
    (table,) = tomllib.loads(WorldPrograms(empty).files()["steptwin:///world.toml"].decode())["mic488"]
    assert (table["firmware"], len(table["programs"]), table["positions"]) == ("1.40", 8, {"0": "m/positions-0.csv"})


def test_the_configuration_of_a_controller_is_its_file() -> None:
    there = configured()
    source = configuration_text(there, "table")
    assert source is not None
    assert (source.name, source.text) == ("m.cfg", CONFIG.decode())
    assert configuration_text(there, "drum") is None
    with pytest.raises(Misuse, match="there is no controller 'nobody': there are table, drum, feeder, alone"):
        configuration_text(there, "nobody")
    with pytest.raises(Misuse, match="there is no controller 'nobody': there are table, drum, feeder, alone"):
        program_texts(there, "nobody")


@pytest.mark.parametrize("more", ["", '\nconfig = "m.cfg"'])
def test_keys_of_the_description_are_in_the_configuration(more: str) -> None:
    """What a table sets besides the file, and a controller without one, is written as a file would have it."""
    text = f'[[mic488]]\nname = "m"{more}\n[mic488.M1]\nacc = 12.5\nlimit_mode = "KL"\nin_kl = "IN3"\n'
    source = configuration_text(World.from_toml(text, {"m.cfg": CONFIG}), "m")
    assert source is not None
    assert source.name == "m.cfg"
    axis = read_config(IniFile.of_text(source.text)).axes[0]
    gear, unit = (100.0, 3) if more else (1.0, 0)
    assert (axis.acc, axis.limit_mode, axis.in_kl, axis.gear, axis.unit) == (12.5, 1, 2, gear, unit)


def test_a_text_runs_only_as_long_as_it_is_what_the_chip_has() -> None:
    """A host types another program; and one whose text is not known runs in a chip without any."""
    text = (
        '[[line]]\nname = "l"\nkind = "m1486"\n[[m1486]]\nname = "one"\nline = "l"\naddress = 1\nprogram = "p"\n'
        '[[m1486]]\nname = "two"\nline = "l"\naddress = 2\n'
    )
    there = World.from_toml(text, {"p": b"[\n@1\nw1000\nj1\n]\n"})
    there.run(for_="1 s")
    programs = WorldPrograms(there)
    assert (programs.text("one", "program").running, programs.text("one", "program").empty) == (True, False)
    for number in (1, 2):
        there.apply_input(do.Send("l", f"x{number}\rk\r\\\r[\r@1\rw2000\rj1\r]\r".encode()))
        there.run(for_="1 s")
    assert there.m1486["two"].chip.memory.begin is not None
    found = [programs.text(name, "program") for name in ("one", "two")]
    assert [(one.running, one.empty) for one in found] == [(False, False), (False, True)]
