"""The motion calculator and configurations, as viewers ask for them."""

from __future__ import annotations

from base64 import b64decode

import pytest
from tests.support.studio_rig import VIEWER, WORLD, Studio

from steptwin.controller import SECOND
from steptwin.wire.pcapng import CapturedFrame, capture


def test_a_move_of_an_axis_in_its_units() -> None:
    tab = Studio(tokens=True).open(token=VIEWER)
    what = tab.ok("calculator", controller="table", axis=1)
    assert [one["name"] for one in what["quantities"]] == ["distance", "velocity", "acceleration", "deceleration"]
    assert what["quantities"][1]["unit"] == "mm/s"
    assert what["quantities"][1]["limits"]["high"] == 640
    assert what["times"][0]["name"] == "time"
    move = tab.ok("calculate", controller="table", axis=1, given={"distance": 100, "velocity": 40, "acceleration": 400})
    assert move["times"]["time"] == pytest.approx(2.6)
    assert [(one["code"], one["value"]) for one in move["settings"]] == [("M1_VMAX", 40), ("M1_ACC", 400), ("M1_DEC", 400)]
    found = tab.ok("calculate", controller="table", axis=1, given={"distance": 100, "acceleration": 400, "time": 2.6})
    assert (found["found"], found["exact"]) == ("velocity", pytest.approx(40))


def test_a_move_of_a_chip() -> None:
    tab = Studio().open()
    move = tab.ok("calculate", controller="drum", axis=1, given={"distance": 64000, "velocity": 1000, "acceleration": 5000})
    assert move["times"]["time"] == pytest.approx(1.128)
    assert ("V", "V", 1000) in [(one["code"], one["detail"], one["value"]) for one in move["settings"]]


def test_what_cannot_be_calculated() -> None:
    tab = Studio().open()
    given = {"distance": 100, "velocity": 700, "acceleration": 400}
    assert "permitted above 0 up to 640 mm/s" in tab.error("calculate", controller="table", axis=1, given=given)[1]
    assert "no motion calculator for axis 9 of table" in tab.error("calculator", controller="table", axis=9)[1]
    assert "did you mean 'table'" in tab.error("calculator", controller="tabel", axis=1)[1]
    assert "'far': expected a number" in tab.error("calculate", controller="table", axis=1, given={"distance": "far"})[1]


def test_gear_from_mechanics() -> None:
    assert Studio().open().ok("gear", microsteps=16, lead=5)["mm"] == 640


def test_the_configuration_of_a_controller_as_a_form() -> None:
    form = Studio().open().ok("configuration", controller="table")
    sections = {section["name"]: section for section in form["sections"]}
    assert sections["Axis0"]["title"] == "M1"
    settings = {one["name"]: one for one in sections["Axis0"]["settings"]}
    assert (settings["Gear"]["value"], settings["Gear"]["unit"]) == (100, "imp/mm")
    assert (settings["Acc"]["value"], settings["Acc"]["point"], settings["Acc"]["default"]) == (400, "M1_ACC", 1000)
    assert settings["InKL"]["choices"]["20"] == "none"
    assert form["points"]["M1_VMAX"] == 40
    assert form["diagnostics"] == []


def test_a_file_is_shown_as_it_is() -> None:
    text = "; of the table\r\n[Axis0]\r\nUnit=3\r\nGear=640\r\n"
    world = WORLD.replace('line = "bus"', 'line = "bus"\n    config = "a.cfg"', 1).split("[mic488.M1]")[0]
    form = Studio(world, files={"a.cfg": text.encode()}).open().ok("configuration", controller="table")
    assert (form["name"], form["text"]) == ("a.cfg", text)


def test_other_values_keep_the_rest_of_the_file() -> None:
    tab = Studio().open()
    text = "; mine\n[Axis0]\nUnit=3\nGear=100\nAcc=400 ; soft\n"
    form = tab.ok("edit_configuration", controller="table", text=text, changes={"Axis0.Acc": "300,5", "IN3.Filter": "2"})
    assert form["text"] == "; mine\n[Axis0]\nUnit=3\nGear=100\nAcc=300,5 ; soft\n[IN3]\nFilter=2\n"
    assert form["points"]["M1_ACC"] == 300.5


def test_points_are_in_the_units_of_the_running_controller() -> None:
    """GEAR of the twin is 100 imp/mm: 300 mm/s² at 200 imp/mm are 60000 imp/s²."""
    form = Studio().open().ok("edit_configuration", controller="table", text="[Axis0]\nUnit=3\nGear=200\nAcc=300\n", changes={})
    assert form["points"]["M1_ACC"] == 600


def test_what_is_wrong_in_a_file() -> None:
    tab = Studio().open()
    form = tab.ok("edit_configuration", controller="table", text="[Axis0]\nGear=0\nGaer=3\n", changes={})
    assert [(one["line"], one["code"]) for one in form["diagnostics"]] == [(2, "C008"), (3, "C005")]
    assert (
        "settings are SECTION.KEY" in tab.error("edit_configuration", controller="table", text="", changes={"Axis9.Gear": "1"})[1]
    )
    assert (
        "would not read back" in tab.error("edit_configuration", controller="table", text="", changes={"Axis0.Gear": "1\n2"})[1]
    )
    assert "which has no configuration file" in tab.error("configuration", controller="drum")[1]
    assert "at most 48000 characters" in tab.error("edit_configuration", controller="table", text="x" * 50_000, changes={})[1]


def test_frames_as_a_capture() -> None:
    data = bytes.fromhex("000100000006010327240002")
    frame = {"time_ns": "2000000000", "controller": "bus", "client": "tcp-1", "direction": "in", "data": data.hex()}
    tab = Studio(tokens=True).open(token=VIEWER)
    made = b"".join(capture([CapturedFrame(2 * SECOND, "bus", "tcp-1", True, data)]))
    assert b64decode(tab.ok("capture", frames=[frame])["data"]) == made
    assert "expected 'in' or 'out'" in tab.error("capture", frames=[{**frame, "direction": "up"}])[1]
    assert "expected bytes as hexadecimal digits" in tab.error("capture", frames=[frame, {**frame, "data": "0"}])[1]
    assert "at most 5000 frames" in tab.error("capture", frames=[frame] * 5001)[1]
