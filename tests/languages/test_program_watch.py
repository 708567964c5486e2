"""A program in a world, as `steptwin run` shows it, and what can be asked of it."""

from __future__ import annotations

import re
from pathlib import Path

from steptwin.files.world import World
from steptwin.files.worldoptions import ShownOptions
from steptwin.languages.run_world import WorldRun, run
from steptwin.mic488.present import state_of

WORLD = """\
[world]
name = "cell"
[[mic488]]
name = "table"
programs = ["first.prg", "second.prg"]
start = true
[[mic488]]
name = "other"
[[event]]
at = "2s"
steps = [{ set = { "table.IN3" = 1, "other.IN1" = 1 } }]
"""
FIRST = "M1 = ON\nCOUNT = 2.5\nOUT1 = ON\nPREL M1 500\nWAIT IN3 = ON\nOUT1 = OFF\nEND\n"


def controller(folder: Path) -> Path:
    (folder / "first.prg").write_text(FIRST)
    (folder / "second.prg").write_text("END\n")
    (folder / "machine.toml").write_text(WORLD)
    return folder / "machine.toml"


def test_a_run_shows_what_a_program_does_with_its_statements(tmp_path: Path) -> None:
    said: list[str] = []
    assert run(WorldRun(world=controller(tmp_path), limit=5_000_000_000), said.append, said.append)
    shown = [re.split(r"  +", line.strip()) for line in said if " table " in line]
    assert shown == [
        ["0.001000 s", "table", "M1 on", "1", "M1 = ON"],
        ["0.003000 s", "table", "OUT1 on", "3", "OUT1 = ON"],
        ["0.004000 s", "table", "M1 moves to 500 imp", "4", "PREL M1 500"],
        ["0.005000 s", "table", "waits for IN3", "5", "WAIT IN3 = ON"],
        ["1.418214 s", "table", "M1 at 500 imp, position reached"],
        ["2.011000 s", "table", "OUT1 off", "6", "OUT1 = OFF"],
        ["2.012000 s", "table", "the program ends", "7", "END"],
        ["2.012000 s", "table", "M1 off", "7", "END"],
    ]


def test_what_is_shown_can_be_chosen(tmp_path: Path) -> None:
    def shown(names: tuple[str, ...] = (), kinds: tuple[str, ...] = ()) -> list[str]:
        said: list[str] = []
        assert run(
            WorldRun(world=controller(tmp_path), limit=5_000_000_000, shown=ShownOptions(of=names, show=kinds)),
            said.append,
            said.append,
        )
        return [line.split()[2] for line in said if re.match(r" +[0-9.]+ s ", line)]

    assert set(shown()) == {"table"}
    assert shown(("other",)) == []
    assert shown(kinds=("program",)) == shown()
    assert shown(kinds=("note,fault",)) == []


def test_watching_changes_nothing(tmp_path: Path) -> None:
    path = controller(tmp_path)
    said: list[str] = []
    run(WorldRun(world=path, limit=5_000_000_000), said.append, said.append)
    run(WorldRun(world=path, limit=5_000_000_000, as_json=True), said.append, said.append)
    digest = re.findall(r"digest\W+([0-9a-f]{32})", "\n".join(said))
    assert len(digest) == 2
    assert digest[0] == digest[1]


def test_the_state_has_the_variables_of_a_program(tmp_path: Path) -> None:
    world = World.load(controller(tmp_path))
    device = world.mic488["table"].device
    for moment, value in ((1_500_000, 0.0), (2_500_000, 2.5), (1_000_000_000, 2.5)):
        world.advance(moment)
        world.sync("table")
        assert state_of(device, moment).program.variables == {"COUNT": value}
    world.advance(3_000_000_000)
    world.sync("table")
    assert state_of(device, world.now).program.variables == {}
