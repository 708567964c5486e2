"""Worlds as people use them: from TOML and Python, in virtual time."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from world_rig import moved, small

from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.files.recording import recording_of
from steptwin.files.world import World
from steptwin.simulation.script import steps as do
from steptwin.wbc.check import check
from steptwin.wbc.image import build
from steptwin.wbc.positions import parse_positions

EXAMPLES = sorted((Path(__file__).parents[2] / "examples" / "worlds").glob("*.toml"))


def test_homing_finds_the_switch() -> None:
    world = small()
    world.mic488["a"].axis[1].enable()
    world.mic488["a"].axis[1].home(-20.0)
    world.run(until="a.M1.status == 4 or a.M1.status == 5", for_="20 s")
    assert world.mic488["a"].axis[1].position == 0.0
    assert world.axis["x"].position == pytest.approx(0.21)


def test_a_run_ends_at_a_moment_a_duration_or_a_condition() -> None:
    world = small()
    assert world.run(until=2.5) is None
    assert world.run(for_="1 min") is None
    assert world.time == 62.5
    moved(world, 10.0)
    assert world.run(until="x.position >= 55", for_=30) == "x.position >= 55"
    assert world.axis["x"].position == 55.0
    assert world.run(until="idle") == "idle"
    assert world.axis["x"].position == 60.0
    assert world.run(until="b.IN3", for_=5) is None
    assert world.run(until=90, for_=1) is None
    assert world.run(until=90.5, for_=60) is None
    assert world.time == 90.5
    for moment, message in ((90, r"until 90 s: this world is at 90\.5 s already"), (float("nan"), "nan is not a time")):
        with pytest.raises(Misuse, match=message):
            world.run(until=moment)
    with pytest.raises(Misuse, match="run needs until \\(a moment or a condition\\) or for_"):
        world.run()


def test_until_the_moment_is_exact() -> None:
    world = moved(small(), 10.0)
    world.run(until="x.position >= 55")
    profile = world.mic488["a"].device.axes[0].profile
    assert world.now == profile.pulse_time(500, 0)


def test_the_last_hand_on_a_button_says_when_it_is_released() -> None:
    world = small()
    levels = []
    world.at("0.5 s", lambda: world.press("go", 1))
    world.at("2 s", lambda: world.press("go", 1))
    world.at("2.4 s", lambda: world.release("go"))
    world.at("2.7 s", lambda: world.press("go"))
    world.press("go", 1)
    for _ in range(20):
        levels.append(int(world.mic488["b"].pins["IN4"]))
        world.run(for_=0.2)
    assert levels == [1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 1, 1, 1, 1]
    assert recording_of(world).replay().trace.digest() == world.trace.digest()


def test_at_and_when_call_functions() -> None:
    world = small()
    seen: list[tuple[float, float]] = []
    world.at(2, lambda: moved(world, 5.0))
    world.when("x.position >= 52", lambda: seen.append((world.time, world.axis["x"].position)), once=True)
    world.run(for_=10)
    assert [position for _, position in seen] == [52.0]


def test_a_moment_that_has_passed_is_refused() -> None:
    world = small()
    world.run(for_=3)
    with pytest.raises(Misuse, match=r"at 2\.5 s: this world is at 3 s already"):
        world.at(2.5, do.Note("late"))
    with pytest.raises(Misuse, match=r"at 0 s: this world is at 3 s already"):
        world.at("0 s", lambda: None)
    world.at(3, do.Note("now"))
    world.run(for_=1)
    assert [(r.time, r.value) for r in world.trace.events("world")] == [(3 * SECOND, "now")]


def test_a_branch_of_a_world_that_had_a_fault_goes_on_alike() -> None:
    world = World.load(EXAMPLES[0].parent / "feeder.toml")
    world.run(for_=1)
    name = world.fault("stuck machine=table pin=IN3 value=1")
    world.run(for_=1)
    world.clear_fault(name)
    other = world.branch()
    for one in (world, other):
        one.run(until=3)
    assert other.trace.digest() == world.trace.digest()


def test_a_branch_goes_its_own_way() -> None:
    world = moved(small(), 30.0)
    world.run(for_=0.5)
    other = world.branch()
    other.mic488["a"].axis[1].stop()
    assert other.run(until="idle") == world.run(until="idle") == "idle"
    assert world.axis["x"].position == 80.0
    assert 50.0 < other.axis["x"].position < 80.0
    assert world.trace.digest() != other.trace.digest()


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_run_as_their_scripts_expect(path: Path) -> None:
    world = World.load(path)
    world.run(for_="30 s")
    assert list(world.failures) == []


def test_the_pages_about_worlds_do_what_they_say(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    root = Path(__file__).parents[2]
    (code,) = re.findall(r"```python\n(.*?)```", (root / "docs/worlds/python.md").read_text(), re.DOTALL)
    (toml,) = re.findall(r"```toml\n(.*?)```", (root / "docs/worlds.md").read_text(), re.DOTALL)
    monkeypatch.chdir(root)
    exec(compile(code, "python.md", "exec"), {})
    *_, gentle, hasty = capsys.readouterr().out.split("\n")[:-1]
    assert gentle.endswith(" 0")
    assert int(hasty.split()[1]) < -10_000
    world = World.from_toml(toml)
    world.run(for_=60)
    assert list(world.failures) == []


def test_a_compiled_image_runs_like_a_program_with_its_own_table(tmp_path: Path) -> None:
    table, _ = parse_positions("A;1;x;x;x\nB;7;x;x;x\n")
    executable = check("M1 = ON\nMOVEPTP 1\nWAITPOS\nOUT1 = ON\nWAIT IN1 = ON\n", table).executable
    assert executable is not None
    data, refused = build(executable, table)
    assert (data is None, refused) == (False, [])
    (tmp_path / "a.wbc").write_bytes(data or b"")
    (tmp_path / "w.toml").write_text('[[mic488]]\nname = "a"\nprogram = "a.wbc"\nstart = true\n')
    world = World.load(tmp_path / "w.toml")
    world.run(for_="20 s")
    assert world.mic488["a"].axis[1].position == 7.0
