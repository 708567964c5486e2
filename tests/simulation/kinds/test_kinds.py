"""The kinds of controllers and their data sheets."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import get_args

import pytest
from facts import check_facts

import steptwin.mic488
from steptwin import m1486
from steptwin.datasheet import Access, Limits, PointAddress, PointEffect
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.jsonvalues import to_json
from steptwin.m1486.events import M1486Event
from steptwin.m1486.variants import VARIANTS
from steptwin.mic488.events import EVENTS
from steptwin.motioncontroller import MotionController
from steptwin.simulation.faults import read
from steptwin.simulation.kinds.kind import ControllerKind, ControllerSpec, LinkKind
from steptwin.simulation.kinds.mic488.kind import Mic488Kind
from steptwin.simulation.kinds.mic488.linekind import ModbusLines
from steptwin.simulation.kinds.registry import KINDS, M1486, MIC488, register
from steptwin.simulation.script.control import ControllerCommand
from steptwin.simulation.script.steps import Set, SetFault

WORLD = World.from_toml(
    """
[[mic488]]
name = "table"
[mic488.M2]
unit = "mm"
gear = 100.0
[[mic488]]
name = "old"
firmware = "1.23"
[[m1486]]
name = "chip"
variant = "A"
"""
)
SHEETS = {name: WORLD.kind(name).datasheet(controller) for name, controller in WORLD.controllers.items()}


@pytest.mark.parametrize("name", SHEETS)
def test_every_pin_and_every_point_of_a_data_sheet_can_be_named(name: str) -> None:
    sheet, kind = SHEETS[name], WORLD.kind(name)
    controller = WORLD.controllers[name]
    assert sheet.kind == kind.name
    assert {pin.name for pin in sheet.pins} == set(controller.pins())
    assert {pin: controller.pin(pin) for pin in controller.pins()} == controller.pins()
    assert len(sheet.axes) == len(controller.axes)
    paths = [point.path for point in sheet.points]
    assert len({path.upper() for path in paths}) == len(paths)
    for point in sheet.points:
        if point.path == "USER_REGISTER":
            continue  # many values
        found = kind.point(controller, point.path)
        assert found is not None
        assert found.point == point
        assert (found.read is not None) is (point.access is not Access.WRITE), point.path
        if found.read is not None:
            assert isinstance(float(found.read(WORLD.now)), float)


@pytest.mark.parametrize("name", SHEETS)
def test_a_data_sheet_is_json(name: str) -> None:
    data = json.loads(json.dumps(to_json(SHEETS[name]), allow_nan=False))
    assert data["kind"] == SHEETS[name].kind
    assert [point["path"] for point in data["points"]] == [point.path for point in SHEETS[name].points]


def test_a_position_has_unit_and_address() -> None:
    """Manual 1.70, 4.7: POS_ACT of M2; the configured unit."""
    position = SHEETS["table"].point("M2.position")
    assert (position.unit, position.access, position.effect) == ("mm", Access.READ, PointEffect.NONE)
    assert position.addresses == SHEETS["table"].point("M2_POS_ACT").addresses
    assert SHEETS["table"].point("M2_VEL_ACT").unit == "mm/s"
    goal = SHEETS["table"].point("M1_POS_ABS")
    assert goal.effect is PointEffect.MOVES
    assert [command.code for command in SHEETS["table"].commands if command.code == "M1_POS_ABS"] == ["M1_POS_ABS"]


def test_a_configuration_file_as_a_form_has_the_units_of_the_controller() -> None:
    form = MIC488.configuration_format
    assert form is not None
    text = "[Axis1]\nGear=50\nAcc=20\n"
    assert form.form(text, "m.cfg", SHEETS["table"]).points["M2_ACC"] == 10.0  # at 100 pulses per mm
    assert form.with_values(text, "m.cfg", {"Axis1.Acc": "30"}) == "[Axis1]\nGear=50\nAcc=30\n"
    banks = {
        name: setting.limits
        for name in ("table", "old")
        for section in form.form(text, "m.cfg", SHEETS[name]).sections
        for setting in section.settings
        if setting.name == "ProgBankToRun"
    }
    assert banks == {"table": Limits(0, 5), "old": Limits(0, 7)}


def test_addresses_are_those_of_the_firmware() -> None:
    assert SHEETS["table"].point("USER_REG_SAVE").addresses != ()
    assert SHEETS["table"].point("DATA_TYPE").addresses != SHEETS["old"].point("DATA_TYPE").addresses


def test_a_command_of_a_chip_has_range_and_unit() -> None:
    """Manual chapter VII.2: A takes 1 to 65 000 step/s²; labels of an A end at 15."""
    commands = {(command.code, command.name): command for command in SHEETS["chip"].commands}
    (argument,) = commands["A", "Acceleration"].arguments
    assert (argument.unit, argument.limits) == ("step/s²", Limits(1, 65_000))
    assert commands["R", "Run"].effect is PointEffect.MOVES
    assert commands["J", "Jump"].arguments[0].limits == Limits(1, 15)
    assert SHEETS["chip"].point("U16").addresses == (PointAddress(space="command", place="U16"),)


def test_every_event_of_a_mic488_is_in_its_table() -> None:
    folder = Path(steptwin.mic488.__path__[0])
    source = "".join(path.read_text("utf-8") for path in folder.glob("*.py"))
    used = re.findall(r'\bevent\(\s*"([\w-]+)"', source) + re.findall(r'axis_event\(\s*[\w.]+, "([\w-]+)"', source)
    assert set(used) == EVENTS.keys()


def test_a_name_that_is_taken_is_refused() -> None:
    before = list(KINDS)
    with pytest.raises(Misuse, match="a kind of controllers called 'mic488' already"):
        register(MIC488)
    assert list(KINDS) == before


def test_a_kind_that_lacks_a_method_is_refused_when_it_is_made() -> None:
    class Incomplete(ControllerKind[ControllerSpec, MotionController, object]):
        name = "incomplete"

    with pytest.raises(TypeError, match=r"abstract methods? .*address.*keep_memory.*view"):
        Incomplete()  # type: ignore[abstract]


def test_commands_of_a_kind_are_those_that_it_does() -> None:
    assert set(MIC488.commands) == set(get_args(ControllerCommand))
    assert [command.__name__ for command in M1486.commands] == ["Move", "Jog", "StopAxes", "ControlProgram"]
    assert (MIC488.offers(ControllerKind.seek), M1486.offers(ControllerKind.seek)) == (False, True)


TAKEN = '[[m1486]]\nname = "chip"\ninterface = "two"\n'


def test_pins_that_the_driver_interface_has_are_no_inputs_and_no_outputs() -> None:
    """Two DACs has B8 to B17 (M-21)."""
    said = "B12 is taken: the Two DACs interface has B8 to B17"
    world = World.from_toml(TAKEN)
    for step in (Set((("chip", "b12", 0.0),)), SetFault(read("stuck machine=chip pin=B12 value=0"))):
        with pytest.raises(Misuse, match=said):
            world.apply_input(step)
    world.apply_input(Set((("chip", "B7", 0.0),)))
    assert world.read("chip.B7") == 0.0
    for more in ('[[wire]]\nfrom = "chip.B12"\nto = "chip.B1"\n', '[[button]]\nname = "b"\nto = "chip.B12"\n'):
        with pytest.raises(Misuse, match=said):
            World.from_toml(TAKEN + more)


def test_a_kind_of_lines_that_no_description_could_open_is_refused() -> None:
    class OtherLines(ModbusLines):
        def __init__(self, name: str, links: Mapping[str, LinkKind]) -> None:
            self.name = name
            self.links = dict(links)

    class OtherKind(Mic488Kind):
        name = "new"

        def __init__(self, line: ModbusLines) -> None:
            self.line = line

    before, links = list(KINDS), MIC488.line.links
    link = next(iter(links.values()))
    with pytest.raises(Misuse, match=r"lines of kind 'other' have links that are no keys of \[\[line\]\]: pipe, post"):
        register(OtherKind(OtherLines("other", {**links, "post": link, "pipe": link})))
    with pytest.raises(Misuse, match="a kind of lines called 'modbus' already"):
        register(OtherKind(OtherLines("modbus", {})))
    assert list(KINDS) == before


@pytest.mark.parametrize(
    ("facts", "message"),
    [
        ((("line", 3), ("level", 1)), ""),
        ((("line", 3),), "says line, level"),
        ((("line", 3), ("level", 1), ("pin", "B3")), "says line, level"),
        ((("line", 3), ("level", True)), "level is to be a whole number"),
    ],
)
def test_facts_of_events_are_compared_with_the_data_sheet(facts: tuple[tuple[str, object], ...], message: str) -> None:
    """`facts` does that for every event in all tests."""
    event = M1486Event(0, "output", "B3 high", facts)
    with pytest.raises(AssertionError, match=message) if message else nullcontext():
        check_facts(event, m1486.events.EVENTS)


@pytest.mark.parametrize("name", [v.name for v in VARIANTS])
def test_every_variant_of_the_m1486_can_be_described(name: str) -> None:
    for written in (name, name.lower(), f"M1486{name}"):
        made = World.from_toml(f'[[m1486]]\nname = "a"\nvariant = "{written}"\n')
        assert made.m1486["a"].chip.variant.name == name
