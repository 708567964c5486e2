"""What every element has, from the list of elements itself: faults, signals, a drawing, a section with a picture, tests of its
own, and its lanes in exports. A new element that lacks one fails here."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from toy import lamp
from whole_world import everything

from steptwin.files.export import axis_views, write_trace
from steptwin.world.elements import ELEMENTS

ROOT = Path(__file__).parents[3]
NAMES = sorted(ELEMENTS)
NO_OWN_FAULTS = {
    "axis": "stall, lost-steps and slip are faults of its drive",
    "button": "its input can be stuck or bounce",
    "wire": "its input can be stuck; the output before it, too",
}
DRAWN_ELSEWHERE = {"axis": "Axis.svelte", "button": "Machine.svelte", "wire": "../io/Wiring.svelte"}
"""In the page, those that are no symbol and no track."""
TESTS = {
    "axis": "../test_mechanics.py",
    "button": "../test_contacts.py",
    "wire": "../test_wiring.py",
    "source": "../test_sources.py",
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
        for spec in ELEMENTS[name].named(world.spec.elements[name]):
            assert world.parts.element_signals(spec.name)


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
    pages = [(ROOT / "docs" / page).read_text("utf-8") for page in ("elements.md", "motors.md", "worlds.md")]
    sections = [section for page in pages for section in re.split(r"^## ", page, flags=re.MULTILINE) if f"[[{name}]]" in section]
    assert any("](images/" in section for section in sections)


@pytest.mark.parametrize("name", NAMES)
def test_it_has_tests_of_its_own(name: str) -> None:
    assert (Path(__file__).parent / TESTS.get(name, f"test_{name}.py")).is_file()


def test_every_lane_is_in_every_export(tmp_path: Path) -> None:
    """Those of terminals, contacts and faults; and what an axis moves besides."""
    with lamp.registered():
        world = everything()
        world.run(for_=0.6)
        pins = {pin for machine in world.machines.values() for pin in machine.pins()}
        lanes = {record.subject for record in world.trace.edges()} - pins
        moved = {
            spec.name
            for element in ELEMENTS.values()
            if element.moved is not None
            for spec in element.named(world.spec.elements[element.name])
        }
        formats = ("jsonl", "html", "vcd", "csv")
        write_trace(world.trace, tmp_path, views=axis_views(world), ended=world.now, formats=formats)
    for one in formats:
        (file,) = tmp_path.glob(f"*.{one}")
        text = file.read_text("utf-8")
        lacking = {lane for lane in lanes if lane not in text and lane.replace(".", "_") not in text}
        assert not lacking, one
        assert not {name for name in moved if not re.search(rf"{name}[ _](position|angle|x)|\"{name}\"", text)}, one
