"""What every element has, from the list of elements itself: faults, signals, a drawing, a section with a picture, tests of its
own, and its channels in exports. A new element that lacks one fails here."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, TypeAlias

import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from pyarrow import parquet
from toy import lamp
from whole_world import everything

from steptwin.files.export import axis_views, plot, write_trace
from steptwin.files.export.tracetracks import sort_out
from steptwin.motion.divisions import profile_of
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.mechanics.channels import AxisViews
from steptwin.simulation.world.simulation import Simulation

ROOT = Path(__file__).parents[3]
NAMES = sorted(ELEMENTS)
NO_OWN_FAULTS = {
    "axis": "stall, lost-steps and slip are faults of its drive",
    "button": "its input can be stuck or bounce",
    "wire": "its input can be stuck; the output before it, too",
    "body": "it only is where others have it",
    "nest": "workpieces in it are others' faults",
}
DRAWN_ELSEWHERE = {
    "axis": "Axis.svelte",
    "button": "Machine.svelte",
    "wire": "../io/Wiring.svelte",
    **dict.fromkeys(("beam", "body", "nest"), "Machine.svelte"),
}
"""In the page, those that are no symbol and no track."""
TESTS = {
    "axis": "../mechanics/test_mechanics.py",
    "button": "../logic/test_contacts.py",
    "wire": "../world/test_wiring.py",
    "source": "../logic/test_sources.py",
    **dict.fromkeys(("gate", "latch", "timer", "counter", "relay"), "test_logic.py"),
}
"""Where they are not in the file of its name."""


@pytest.mark.parametrize("name", NAMES)
def test_it_has_faults_or_a_reason(name: str) -> None:
    assert bool(ELEMENTS[name].faults) is not (name in NO_OWN_FAULTS)


@pytest.mark.parametrize("name", NAMES)
def test_it_is_in_the_world_of_all_elements_with_its_signals(name: str) -> None:
    """There snapshots, branches, states and signals are compared."""
    with lamp.registered():
        world = everything()
        assert world.spec.elements[name]
        for spec in ELEMENTS[name].named(world.spec.elements[name]) if name != "body" else ():
            assert world.objects.element_signals(spec.name)


@pytest.mark.parametrize("name", NAMES)
def test_the_page_draws_it(name: str) -> None:
    panel = ROOT / "studio-web" / "src" / "panels" / "machine"
    if name in DRAWN_ELSEWHERE:
        assert (panel / DRAWN_ELSEWHERE[name]).is_file()
        return
    symbols = (panel / "Symbol.svelte").read_text("utf-8")
    logic = re.search(r"const LOGIC[^=]*= \{(.*?)\}", symbols)
    assert logic is not None
    has_symbol = f'kind === "{name}"' in symbols or f"{name}:" in logic[1]
    assert (ELEMENTS[name].drawing is not None) is not has_symbol


@pytest.mark.parametrize("name", NAMES)
def test_its_section_has_a_picture(name: str) -> None:
    pages = [page.read_text("utf-8") for page in (ROOT / "docs").rglob("*.md")]
    sections = [section for page in pages for section in re.split(r"^## ", page, flags=re.MULTILINE) if f"[[{name}]]" in section]
    assert any("images/" in section for section in sections)


@pytest.mark.parametrize("name", NAMES)
def test_it_has_tests_of_its_own(name: str) -> None:
    assert (Path(__file__).parent / TESTS.get(name, f"test_{name}.py")).is_file()


OWN_FAULTS = [(name, kind.name) for name, element in ELEMENTS.items() for kind in element.faults if not kind.effect.holds]


@pytest.mark.parametrize(("name", "kind"), OWN_FAULTS)
def test_a_fault_says_that_it_begins_and_that_it_is_over(name: str, kind: str) -> None:
    """Of which element, for a world has several. Terminals that are held at a level: test_rigging.py."""
    with lamp.registered():
        world = everything()
        (spec, *_) = ELEMENTS[name].named(world.spec.elements[name])
        world.fault(f"{kind} element={spec.name} name=this-one")
        world.clear_fault("this-one")
        begins, ends = (str(record.value) for record in world.trace if (record.kind, record.subject) == ("fault", "this-one"))
    assert spec.name in begins
    assert spec.name in ends
    assert begins != ends


Recorded: TypeAlias = "tuple[Simulation, AxisViews, set[str], set[str]]"


@pytest.fixture(scope="module")
def recorded() -> Recorded:
    """The world of all elements after 0.6 s, its views, channels of terminals, contacts and faults, and what axes move
    besides."""
    with lamp.registered():
        world = everything()
        world.run(for_=0.6)
        pins = {pin for controller in world.controllers.values() for pin in controller.pins()}
        moved = {
            spec.name
            for element in ELEMENTS.values()
            if element.moved is not None
            for spec in element.named(world.spec.elements[element.name])
        }
        return world, axis_views(world), {record.subject for record in world.trace.edges()} - pins, moved


def lacking(text: str, channels: set[str], moved: set[str]) -> set[str]:
    """The channels that a text does not have."""
    return {channel for channel in channels if channel not in text and channel.replace(".", "_") not in text} | {
        name for name in moved if not re.search(rf"{name}[ _](position|angle|x)|\"{name}\"", text)
    }


@pytest.mark.parametrize("form", ["jsonl", "html", "vcd", "csv", "parquet"])
def test_every_channel_is_in_every_export(recorded: Recorded, form: str, tmp_path: Path) -> None:
    world, views, channels, moved = recorded
    (file,) = write_trace(world.trace, tmp_path / f"t.{form}", views=views, ended=world.now)
    text = "\n".join(parquet.read_schema(file).names) if form == "parquet" else file.read_text("utf-8")
    assert lacking(text, channels, moved) == set()


def test_every_channel_that_changes_is_in_the_picture(
    recorded: Recorded, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    world, views, channels, moved = recorded
    monkeypatch.setattr(plot, "MOST_ROWS", 1000)
    drawn: list[str] = []
    saved = Figure.savefig

    def save(figure: Figure, *args: Any, **kwargs: Any) -> None:
        drawn.extend(one.get_text() for one in figure.findobj(Text))
        saved(figure, *args, **kwargs)

    monkeypatch.setattr(Figure, "savefig", save)
    (file,) = write_trace(world.trace, tmp_path / "t.svg", views=views, ended=world.now)
    changed = {record.subject for record in world.trace.edges() if record.time > 0} & channels
    recording = sort_out(world.trace, views, until=world.now)
    moving = {
        track.view.name.split()[0]
        for track in recording.moved
        if any(profile_of(plan).moving(after) for plan, after, _ in track.intervals(0, world.now))
    } & moved
    assert len(changed) > 3
    assert lacking("\n".join(drawn), changed, moving) == set()
    assert lacking(file.read_text("utf-8"), changed, moving) == set()
