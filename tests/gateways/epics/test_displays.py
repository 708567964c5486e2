"""Displays: widgets and properties that Phoebus has, at places beside each other, with records that the gateway serves."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple
from xml.etree import ElementTree

import pytest
from tests.conftest import Served, ServedM1486

from steptwin.access.roles import Role
from steptwin.commands.displays import described, write_displays
from steptwin.errors import LineFailure, Misuse
from steptwin.gateways.epics.controller import EpicsController
from steptwin.gateways.epics.records import Record, found_field
from steptwin.gateways.epics.recordset import make_records
from steptwin.gateways.leases import JogLeases
from steptwin.gateways.points import CLOCK, registers_by_machine
from steptwin.gateways.sampling import Sampler, SharedSamples
from steptwin.subject.contract import Description

HALL = """
    [[mic488]]
    name = "table"
    [[m1486]]
    name = "feed"
    line = "bus"
    [[line]]
    name = "bus"
    kind = "m1486"
"""
DEVICES = """
    [[device]]
    name = "table"
    address = "tcp://127.0.0.1:{table}"
    [[device]]
    name = "feed"
    address = "tcp://127.0.0.1:{feed},kind=m1486"
"""
GATEWAY = """
    [gateway.epics]
    prefix = "ST:"
    registers = ["table.USER_REGISTER[5]", "table.M1_VMAX"]
"""
_ALL = "name x y width height visible tooltip actions rules scripts class "
_PV = f"{_ALL} pv_name border_alarm_sensitive "
_TEXT = "font foreground_color background_color "
_ASKING = "enabled confirm_dialog confirm_message password "
_LABELS = "bit off_label off_color on_label on_color labels_from_pv "
_SHOWING = "format precision show_units wrap_words vertical_alignment horizontal_alignment "
_LISTS = {
    "action_button": f"{_PV} {_TEXT} {_ASKING} text transparent rotation_step",
    "bool_button": f"{_PV} {_TEXT} {_ASKING} {_LABELS} off_image on_image show_led mode",
    "combo": f"{_PV} {_TEXT} {_ASKING} items_from_pv items editable",
    "group": f"{_ALL} {_TEXT} macros style transparent line_color",
    "label": f"{_ALL} {_TEXT} text transparent horizontal_alignment vertical_alignment auto_size wrap_words",
    "led": f"{_PV} {_LABELS} font foreground_color line_color square",
    "textentry": f"{_PV} {_TEXT} {_SHOWING} multi_line enabled",
    "textupdate": f"{_PV} {_TEXT} {_SHOWING} transparent rotation_step interactive",
}
PROPERTIES = {kind: set(listed.split()) for kind, listed in _LISTS.items()}
"""By the type of a widget: those that `defineProperties` of its class has in ControlSystemStudio/phoebus,
app/display/model/src/main/java/org/csstudio/display/builder/model/widgets."""
VERSIONS = dict.fromkeys(PROPERTIES, "2.0.0") | dict.fromkeys(("action_button", "group", "textentry"), "3.0.0")
"""Those of `getVersion` of the same classes; what is older is read as a file of the display builder before Phoebus."""
ACTIONS = {"write_pv": {"description", "pv_name", "value"}, "open_display": {"description", "file", "target"}}
MOST = {"mode": 2, "vertical_alignment": 2, "style": 3}
"""The last of the values that a property has, which are numbers in a file."""
WRITING = ("textentry", "combo", "bool_button")


COMMON = "RBV MOVN STOP VAL SPMG TWR TWV TWF JOGR JOGF JVEL LLM LLS HLM HLS LVIO"
MORE = "HOMR HOMF HVEL ATHM VELO ACCL CNEN"


class Plant(NamedTuple):
    """What a file of a plant describes, and the displays that the command has written for it."""

    description: Description
    shown: dict[str, ElementTree.Element]


def plant_of(text: str, folder: Path) -> Plant:
    file = folder / "plant.toml"
    file.write_text(text + GATEWAY)
    displays = write_displays(file, folder / "bob")
    assert sorted(displays) == sorted((folder / "bob").iterdir())
    return Plant(described(file)[1], {path.name: ElementTree.parse(path).getroot() for path in displays})


@pytest.fixture(scope="module", params=["world", "devices"])
def plant(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Plant]:
    folder = tmp_path_factory.mktemp("plant")
    if request.param == "world":
        yield plant_of(HALL, folder)
        return
    twins = Served(tmp_path_factory.mktemp("table")), ServedM1486(tmp_path_factory.mktemp("feed"))
    try:
        for twin in twins:
            twin.wait_until_ready()
        table, feed = (twin.tcp_port for twin in twins)
        yield plant_of(DEVICES.format(table=table, feed=feed), folder)
        for twin in twins:
            twin.end()
    finally:
        for twin in twins:
            twin.close()


@pytest.fixture(scope="module")
def shown(plant: Plant) -> dict[str, ElementTree.Element]:
    return plant.shown


def widgets(node: ElementTree.Element) -> Iterator[ElementTree.Element]:
    return node.iter("widget")


def place(node: ElementTree.Element) -> list[int]:
    return [int(node.findtext(key, "")) for key in ("x", "y", "width", "height")]


def test_there_is_one_for_each_controller_and_an_overview_that_opens_them(shown: dict[str, ElementTree.Element]) -> None:
    displays = shown
    assert list(displays) == ["overview.bob", "controller-table.bob", "controller-feed.bob"]
    assert all((node.tag, node.get("version")) == ("display", "2.0.0") for node in displays.values())
    opened = {name: sorted(node.text or "" for node in display.iter("file")) for name, display in displays.items()}
    assert opened == {
        "overview.bob": ["controller-feed.bob", "controller-table.bob"],
        "controller-table.bob": ["overview.bob"],
        "controller-feed.bob": ["overview.bob"],
    }


def test_widgets_and_properties_are_those_of_phoebus(shown: dict[str, ElementTree.Element]) -> None:
    for display in shown.values():
        assert {child.tag for child in display} == {"name", "width", "height", "widget"}
        for widget in widgets(display):
            kind = widget.get("type", "")
            assert widget.get("version") == VERSIONS[kind]
            assert {child.tag for child in widget} - {"widget"} <= PROPERTIES[kind]
            assert kind == "group" or widget.find("widget") is None
            assert {child.tag: int(child.text or "") for child in widget if child.tag in MOST}.items() <= {
                (tag, number) for tag, most in MOST.items() for number in range(most + 1)
            }
            for action in widget.iter("action"):
                assert {child.tag for child in action} == ACTIONS[action.get("type", "")]


def test_widgets_are_beside_each_other_and_within_their_display(shown: dict[str, ElementTree.Element]) -> None:
    def look(inside: ElementTree.Element) -> None:
        parts = inside.findall("widget")
        wide, high = int(inside.findtext("width", "")), int(inside.findtext("height", ""))
        for x, y, width, height in map(place, parts):
            assert x >= 0 <= y
            assert x + width <= wide, inside.findtext("name")
            assert y + height <= high, inside.findtext("name")
        for (x, y, width, height), (u, v, breadth, length) in combinations(map(place, parts), 2):
            assert x + width <= u or u + breadth <= x or y + height <= v or v + length <= y
        for group in parts:
            if group.get("type") == "group":
                look(group)

    for display in shown.values():
        look(display)


def needed(widget: ElementTree.Element) -> set[str]:
    """The properties without which a widget of this type shows nothing, or does nothing."""
    kind = widget.get("type", "")
    if kind == "action_button":
        return {"text", "actions"}
    return {"label": {"text"}, "group": {"widget"}}.get(kind, {"pv_name"})


def test_every_widget_has_what_its_type_needs(shown: dict[str, ElementTree.Element]) -> None:
    for widget in (widget for display in shown.values() for widget in widgets(display)):
        assert widget.findtext("name")
        assert min(place(widget)) >= 0
        for key in needed(widget):
            assert (found := widget.find(key)) is not None, (widget.get("type"), widget.findtext("name"), key)
            assert len(found) or (found.text or "").strip()
        assert all(child.text for action in widget.iter("action") for child in action)
        for colour in widget.iter("color"):
            assert set(colour.attrib) == {"red", "green", "blue"}
            assert all(0 <= int(part) <= 255 for part in colour.attrib.values())


@pytest.fixture
def records(plant: Plant) -> dict[str, Record]:
    """Those that the gateway has for the same description."""
    description = plant.description
    registers = registers_by_machine("[gateway.epics]", ["table.USER_REGISTER[5]", "table.M1_VMAX"], description)
    subject: Any = SimpleNamespace(description=description, follow=lambda what, bound: SimpleNamespace())
    subject.samples = SharedSamples(subject)
    leases, sampler = JogLeases(subject), Sampler(subject, registers)
    names = [*(part.name for part in description.machines), CLOCK]
    controllers = {name: EpicsController(name, subject, sampler, leases, Role.ENGINEER) for name in names}
    return make_records("ST:", subject, controllers, registers)


def test_every_name_is_one_that_the_gateway_serves(shown: dict[str, ElementTree.Element], records: dict[str, Record]) -> None:
    """And what is put can be put."""
    names = {node.text or "" for display in shown.values() for node in display.iter("pv_name")}
    assert len(names) > 100
    assert {name for name in records if name.startswith("ST:table:M") and name.count(":") == 2} == {
        f"ST:table:M{number}" for number in range(1, 5)
    }
    for name in names:
        assert found_field(records, name)[1] is not None
    puts = [node for display in shown.values() for node in display.iter("action") if node.get("type") == "write_pv"]
    puts += [node for display in shown.values() for node in widgets(display) if node.get("type") in WRITING]
    assert [name for node in puts if not found_field(records, name := node.findtext("pv_name", ""))[1].is_writable] == []


def test_a_panel_has_what_its_axis_does(shown: dict[str, ElementTree.Element]) -> None:
    """An M1486 does not home, has no drive that is switched, and tells no velocity."""
    fields = {
        name: {(node.text or "").partition(".")[2] for node in display.iter("pv_name")} - {""} for name, display in shown.items()
    }
    assert fields["controller-feed.bob"] == set(COMMON.split())
    assert fields["controller-table.bob"] == set(f"{COMMON} {MORE}".split())


@pytest.mark.parametrize("text", [HALL, DEVICES.format(table=1, feed=1) + "[gateway.prometheus]\n"])
def test_files_without_records(tmp_path: Path, text: str) -> None:
    file = tmp_path / "hall.toml"
    file.write_text(text)
    with pytest.raises(Misuse, match=r"hall\.toml has no \[gateway\.epics\]"):
        write_displays(file, tmp_path / "bob")


def test_a_device_that_is_not_there(tmp_path: Path) -> None:
    """What it is, is not guessed; nothing is written."""
    file = tmp_path / "cell.toml"
    file.write_text(DEVICES.format(table=1, feed=1) + GATEWAY)
    with pytest.raises(LineFailure, match=r"127\.0\.0\.1:1"):
        write_displays(file, tmp_path / "bob")
    assert not (tmp_path / "bob").exists()
