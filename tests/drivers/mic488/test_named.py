"""Registers and addresses as users name them. The twin lives in virtual time."""

from __future__ import annotations

import struct
from array import array
from collections.abc import Sequence

import pytest
from host_rig import Wire, driver
from line_rig import at_every_address
from mic488_rig import loaded

from steptwin.drivers.kind import DeviceAddress, ReadValue, ReadValues
from steptwin.drivers.mic488.addresses import ValueAddress, places
from steptwin.drivers.mic488.kind import MIC488_DRIVER
from steptwin.drivers.mic488.named import expanded
from steptwin.drivers.mic488.sync import Mic488
from steptwin.errors import Misuse
from steptwin.mic488.registers import CONTROLLER_STATUS_TEXTS, register_map

MAP = register_map()
ADDRESS = DeviceAddress("memory", "mic488", 1, 38400, 0.3)
overview, followed, names, writing = MIC488_DRIVER.info, MIC488_DRIVER.followed, MIC488_DRIVER.names, MIC488_DRIVER.writing


def read(mic: Mic488, wanted: Sequence[str]) -> ReadValues:
    return MIC488_DRIVER.reading(wanted)(mic)


def filled() -> Wire:
    """User registers 10 to 13: -2, 0x1234, and the REAL 2.5 with its low word first."""
    wire = Wire()
    low, high = struct.unpack("<HH", struct.pack("<f", 2.5))
    wire.twin.user[10:14] = array("H", [0xFFFE, 0x1234, low, high])
    return wire


# ---------------------------------------------------------------------- reading


def test_values_with_unit_and_meaning() -> None:
    found = read(driver(Wire()), ["M1_POS_ACT", "M2_STATUS", "DATA_TYPE"])
    assert list(found) == ["M1_POS_ACT", "M2_STATUS", "DATA_TYPE"]
    assert found["M1_POS_ACT"] == ReadValue(0.0, "mm", "")
    assert (found["M2_STATUS"].value, found["M2_STATUS"].unit) == (0, "")
    assert found["DATA_TYPE"].meaning == "REAL"


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("hr:10", 0xFFFE),
        ("hr:10:word", 0xFFFE),
        ("hr:10:int", -2),
        ("hr:10:hex", "FFFEh"),
        ("hr:11:hex", "1234h"),
        ("hr:10:dint", 0x1234FFFE),
        ("hr:12:real", 2.5),
        ("co:6000", False),
        ("di:5004", False),
    ],
)
def test_values_by_address(name: str, value: object) -> None:
    (found,) = read(driver(filled()), [name]).values()
    assert found == ReadValue(value)
    assert type(found.value) is type(value)


def test_a_range_is_read_with_one_request() -> None:
    wire = filled()
    mic = driver(wire)
    before = len(wire.sent)
    found = read(mic, ["hr:10-13:hex"])
    assert {name: one.value for name, one in found.items()} == {
        "hr:10:hex": "FFFEh",
        "hr:11:hex": "1234h",
        "hr:12:hex": "0000h",
        "hr:13:hex": "4020h",
    }
    assert len(wire.sent) == before + 1
    assert [one.value for one in read(mic, ["hr:10-13:dint"]).values()] == [0x1234FFFE, 0x40200000]
    assert len(wire.sent) == before + 2


def test_a_long_range_is_cut_between_values() -> None:
    found = places("hr:0-243:dint", MAP)
    assert found is not None
    assert found[0] == ValueAddress("hr", 0, "dint", 0, 120)
    assert found[59] == ValueAddress("hr", 118, "dint", 0, 120)
    assert found[60] == ValueAddress("hr", 120, "dint", 120, 120)
    assert found[-1] == ValueAddress("hr", 242, "dint", 240, 4)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("hr:5", [ValueAddress("hr", 5, "word", 5, 1)]),
        ("HR:5:REAL", [ValueAddress("hr", 5, "real", 5, 2)]),
        ("co:7-8", [ValueAddress("co", 7, "", 7, 2), ValueAddress("co", 8, "", 7, 2)]),
        ("hr:65535", [ValueAddress("hr", 65535, "word", 65535, 1)]),
        ("hr:65534:dint", [ValueAddress("hr", 65534, "dint", 65534, 2)]),
        ("M1_ACC", None),
    ],
)
def test_addresses(text: str, expected: list[ValueAddress] | None) -> None:
    assert places(text, MAP) == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("hr:9-8", "permitted are addresses from 0 to 65535, the first not above the last"),
        ("hr:65536", "permitted are addresses from 0 to 65535"),
        ("hr:65535:dint", "a DINT takes 2 registers, and 65535 is the last address"),
        ("hr:1-3:real", "a REAL takes 2 registers, 3 are not a multiple of it"),
        ("hr:0-1000", "at most 1000 values at once"),
        ("co:1:hex", "expected ADDRESS"),
        ("xx:1", "expected ADDRESS"),
        ("hr:1:bits", "expected ADDRESS"),
    ],
)
def test_addresses_that_cannot_be_read(text: str, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        places(text, MAP)


def test_most_values_at_once() -> None:
    assert len(places("hr:0-999", MAP) or ()) == 1000
    assert len(places("hr:0-1999:dint", MAP) or ()) == 1000


def test_names_stand_for_several() -> None:
    assert expanded(MAP, ["M?_ACC"]) == ["M1_ACC", "M2_ACC", "M3_ACC", "M4_ACC"]
    assert expanded(MAP, ["m1_ac*", "M1_ACC"]) == ["M1_ACC"]
    assert expanded(MAP, ["USER_REGISTER[3-5]"]) == ["USER_REGISTER[3]", "USER_REGISTER[4]", "USER_REGISTER[5]"]
    assert expanded(MAP, ["USER_REGISTER[2-5]:REAL"]) == ["USER_REGISTER[2]:REAL", "USER_REGISTER[4]:REAL"]
    assert expanded(MAP, ["USER_REGISTER[2-5]:dint"]) == ["USER_REGISTER[2]:dint", "USER_REGISTER[4]:dint"]
    assert expanded(MAP, ["USER_REGISTER[2-3]:int"]) == ["USER_REGISTER[2]:int", "USER_REGISTER[3]:int"]
    assert expanded(MAP, ["10020"]) == ["M1_POS_ACT"]
    assert expanded(MAP, ["17"]) == ["USER_REGISTER[17]"]
    # What can only be written, and the user registers, are not among them.
    every = expanded(MAP, ["*"])
    assert "M1_STOP" not in every
    assert "USER_REGISTER" not in every
    assert "M1_STATUS" in every


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("X*", r"'X\*' matches no register that can be read"),
        ("USER_REGISTER[5-4]", "matches no register that can be read"),
        ("10021", "10021 is the second word of M1_POS_ACT, which is at 10020; hr:10021 reads it"),
        ("9999", "firmware 1.70 has no register at 9999; hr:9999 reads it all the same"),
    ],
)
def test_names_of_nothing(name: str, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        expanded(MAP, [name])


def test_registers_of_a_twin() -> None:
    assert followed(["M1_ACC", "10020"], None) == ["M1_ACC", "M1_POS_ACT"]
    assert followed(["M1_ACC", "hr:10020"], "1.70") is None
    assert followed([], None) == [f"M{axis}_{what}" for what in ("POS_ACT", "VEL_ACT", "STATUS") for axis in (1, 2, 3, 4)]
    assert "M1_POS_ACT" in names()


# ---------------------------------------------------------------------- writing


def test_what_holds_its_value_is_read_again() -> None:
    wire = Wire()
    mic = driver(wire)
    assert writing(["M1_ACC=40", "USER_REGISTER[4]=7", "M1_EN=on"])(mic) == {
        "M1_ACC": ReadValue(40.0, "mm/s²"),
        "USER_REGISTER[4]": ReadValue(7),
    }
    assert wire.twin.user[4] == 7
    assert mic.status().axes[0] == 1


def test_all_are_checked_before_the_first_is_written() -> None:
    mic = driver(Wire())
    for change, message in (("M1_DEC=-5", "permitted > 0"), ("M1_DEC=x", "'M1_DEC=x': 'x' is not a number")):
        with pytest.raises(Misuse, match=message):
            writing(["M1_ACC=40", change])(mic)
    assert mic.get("M1_ACC") == {"M1_ACC": 50.0}
    with pytest.raises(Misuse, match=r"'M1_ACC': expected NAME=VALUE, such as M1_ACC=50"):
        writing(["M1_ACC"])


# ---------------------------------------------------------------------- at a glance


def test_an_overview() -> None:
    wire = Wire()
    mic = driver(wire)
    writing(["M2_EN=on", "M2_POS_ABS=3"])(mic)
    wire.rest(5.0)
    wire.twin.set_pin("IN20", 1.0, wire.now)
    mic.set("OUT3", 1)
    found = overview(mic, ADDRESS)
    assert found.head == (
        f"MIC488, unit 1 at memory, firmware 1.70 or 1.40, {CONTROLLER_STATUS_TEXTS[0]}",
        "program stopped, values travel as REAL",
    )
    assert list(found.rows[1])[:6] == ["M2", 3.0, "mm", 0.0, "mm/s", 4]
    assert found.tail[1] == "outputs on: OUT3"
    assert {name: found.data[name] for name in ("device", "unit", "firmware", "data_type", "program")} == {
        "device": "memory",
        "unit": 1,
        "firmware": "1.70",
        "data_type": "REAL",
        "program": "stopped",
    }
    assert [axis["axis"] for axis in found.data["axes"]] == [1, 2, 3, 4]
    assert found.data["axes"][1]["position"] == 3.0
    mic.set("OUT3", 0)
    assert overview(mic, ADDRESS).tail[1] == "outputs on: none"
    wire.twin.load_program(0, loaded("WHILE 1 = 1\nDELAY 1\nENDWHILE\n")[0])
    mic.program.start()
    assert overview(mic, ADDRESS).data["program"] == "running"
    mic.program.pause()
    assert overview(mic, ADDRESS).data["program"] == "paused"
    known = DeviceAddress("memory", "mic488", 1, 38400, 0.3, "1.70")
    assert overview(mic, known).data["firmware_may_be"] == ["1.70"]
    mic.set("DATA_TYPE", 1)
    assert overview(mic, known).data["data_type"] == "DINT"


# ---------------------------------------------------------------------- typed lines


def test_typed_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = Wire()
    at_every_address(monkeypatch, wire)
    log: list[str] = []
    terminal = MIC488_DRIVER.terminal(ADDRESS, log.append, log.append)
    assert wire.opened == 1
    terminal.greet()
    assert log  # the frames

    def answer(line: str) -> list[str]:
        return list(terminal.answer(line, waits=True))

    assert terminal.greeting == "memory, unit 1, firmware 1.70; 'help' helps, Ctrl-D ends"
    assert terminal.prompt == "1> "
    assert list(terminal.names) == list(names())
    assert terminal.help.startswith("NAME")
    assert [terminal.is_stop(line) for line in ("stop", "M1_ACC")] == [True, False]
    assert answer("") == answer("  # nothing") == answer("M1_EN=on") == answer("set M1_POS_ABS=8") == []
    assert answer("wait M1") == ["M1: target reached, 8"]
    assert answer("M1_POS_ACT M1_STATUS  # both") == ["M1_POS_ACT = 8 u", "M1_STATUS = 4"]
    assert answer("get M1_ACC OUT1") == ["M1_ACC = 50 u/s²", "OUT1 = OFF"]
    assert answer("raw 03 27 24 00 02") == ["answer: 03 04 00 00 41 00"]
    assert answer("M1_VEL_ABS=5") == []
    assert wire.moving(1)
    assert answer("stop") == []
    assert not wire.moving(1)
    terminal.close()
    with pytest.raises(Misuse):
        answer("M1_ACC")


def test_typing_leaves_the_data_type(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = Wire()
    driver(wire).set("DATA_TYPE", 1)
    at_every_address(monkeypatch, wire)
    terminal = MIC488_DRIVER.terminal(ADDRESS, str, None)
    assert list(terminal.answer("DATA_TYPE", waits=True)) == ["DATA_TYPE = 1"]


def test_the_usual_values() -> None:
    assert list(MIC488_DRIVER.names()) == list(names())
    assert list(MIC488_DRIVER.usual) == ["M?_POS_ACT", "M?_VEL_ACT", "M?_STATUS"]
