from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from tests.files.export.test_timeline import shown

from steptwin.errors import Misuse
from steptwin.files.export import read_trace, write_trace
from steptwin.files.scene import scenescript
from steptwin.files.scene.picture import View, picture, write_picture
from steptwin.files.scene.recorder import SceneRecorder
from steptwin.files.world import World

ROOT = Path(__file__).parents[3]
WORLDS = ROOT / "examples/worlds"
MOST_BYTES = 1_500_000
Solid = tuple[str, float, float, tuple[str, ...]]


def solids(svg: str) -> list[Solid]:
    """Name, place and shapes with colours of all that is drawn, in order."""
    groups = re.findall(r'<g transform="translate\((\S+) (\S+)\)"[^>]*><title>([^<]*)</title>(.*?)</g>', svg)
    return [(name, float(x), float(y), tuple(re.findall(r' (?:d|fill)="([^"]*)"', paths))) for x, y, name, paths in groups]


def test_the_timeline_draws_what_a_picture_of_its_moment_does(chromium: str, tmp_path: Path) -> None:
    """In a browser, from a file, with all that the page needs in it; and the same after the trace was read again."""
    recorder, world = SceneRecorder(), World.load(WORLDS / "palletizer/palletizer.toml")
    recorder.follow(world)
    world.run(for_=12.0)
    write_trace(world.trace, tmp_path / "t.jsonl", scene=recorder.recorded())
    page = tmp_path / "t.html"
    saved = read_trace(tmp_path / "t.jsonl")
    write_trace(saved.trace, page, scene=saved.scene)
    text = page.read_text("utf-8")
    page.write_text(text.replace("readAddress();\n", 'location.hash = "#at=7.25";\nreadAddress();\n', 1), "utf-8")
    there = World.load(WORLDS / "palletizer/palletizer.toml")
    there.run(for_=7.25)
    found, expected = solids(shown(chromium, page)), solids(picture(there, View.ISO))
    assert [(name, shapes) for name, *_, shapes in found] == [(name, shapes) for name, *_, shapes in expected]
    places = [[one for _, x, y, _ in drawn for one in (x, y)] for drawn in (found, expected)]
    assert places[0] == pytest.approx(places[1], abs=0.011)  # rounded to two digits, and differently
    assert any(name.startswith("infeed.") for name, *_ in found)
    assert len(text.encode()) < MOST_BYTES
    assert not re.search(r'(?:src|href)="|import\(|import .* from|new Worker|fetch\(', text)


def test_views_lights_and_what_is_there_only_sometimes() -> None:
    world = World.load(WORLDS / "press/press.toml")
    world.run(for_=1.0)
    before = {name for name, *_ in solids(picture(world, View.FRONT))}
    world.run(for_=2.2)
    after = {view: solids(picture(world, view)) for view in View}
    assert {name for name, *_ in after[View.FRONT]} - before == {"hand"}
    # The ram goes down in front and side, and stands still from above.
    ram = {view: [(x, y) for name, x, y, _ in one if name == "ram"] for view, one in after.items()}
    assert len({tuple(places) for places in ram.values()}) == len(View)


@pytest.mark.parametrize(("name", "begin"), [("p.svg", b"<svg "), ("p.png", b"\x89PNG")])
def test_files(tmp_path: Path, name: str, begin: bytes) -> None:
    write_picture(World.load(WORLDS / "hoist/hoist.toml"), tmp_path / name, "top")
    assert (tmp_path / name).read_bytes().startswith(begin)


def test_a_world_without_space_and_a_script_that_was_not_built(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with pytest.raises(Misuse, match=r"^flat has no places in space, so nothing can be drawn: give its elements at, on or along"):
        write_picture(World.from_toml('[world]\nname = "flat"\n[[mic488]]\nname = "t"\n'), tmp_path / "p.svg")
    with pytest.raises(Misuse, match=r"p.pdf: pictures are .svg or .png$"):
        write_picture(World.load(WORLDS / "hoist/hoist.toml"), tmp_path / "p.pdf")
    with monkeypatch.context() as without:
        without.setattr("steptwin.files.scene.picture.lacking", lambda extra: ["quickjs-ng"])
        with pytest.raises(Misuse, match=r"^a picture needs .*pip install 'steptwin\[scene\]'$"):
            write_picture(World.load(WORLDS / "hoist/hoist.toml"), tmp_path / "p.svg")
    monkeypatch.setattr(scenescript, "scene_script", lambda: None)
    with pytest.raises(Misuse, match=r"^the script that draws machines in space has not been built: 'make page' in the clone"):
        write_picture(World.load(WORLDS / "hoist/hoist.toml"), tmp_path / "p.svg")
    assert not any(tmp_path.iterdir())


def test_names_are_escaped(tmp_path: Path) -> None:
    world = World.from_toml(
        '[world]\nname = "a <b> & c"\n[[mic488]]\nname = "t"\n[[body]]\nname = "floor"\nat = [0, 0, 0]\nsize = [9, 9, 9]\n'
    )
    assert "<title>a &#60;b&#62; &#38; c</title>" in picture(world, View.ISO)


def test_a_changed_scene_is_refused(tmp_path: Path) -> None:
    recorder, world = SceneRecorder(), World.load(WORLDS / "hoist/hoist.toml")
    recorder.follow(world)
    world.run(for_=1.0)
    write_trace(world.trace, tmp_path / "t.jsonl", scene=recorder.recorded())
    lines = (tmp_path / "t.jsonl").read_text("utf-8").splitlines()
    (n,) = [n for n, line in enumerate(lines) if '"motion"' in line and '"z.position"' in line]
    data = json.loads(lines[n])
    for wrong in (
        {**data, "numbers": data["numbers"][1:]},
        {**data, "numbers": ["x"] * 5},
        {**data, "scene": "song"},
        {"scene": "level"},
    ):
        (tmp_path / "w.jsonl").write_text("\n".join([*lines[:n], json.dumps(wrong), *lines[n + 1 :]]), "utf-8")
        with pytest.raises(Misuse, match=rf"w.jsonl:{n + 1}: not a record of a trace"):
            read_trace(tmp_path / "w.jsonl")
