"""Points of a MIC488: names and addresses of the manuals, and the values that they show."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import pytest
from mic488_rig import Rig, controller, programmed

from steptwin.controller import SECOND
from steptwin.datasheet import Access
from steptwin.errors import Misuse
from steptwin.mic488.config import AxisConfig
from steptwin.mic488.points import live_point, marks, points
from steptwin.points import LivePoint

CONFIG = controller(AxisConfig(), AxisConfig(unit=3, gear=100.0, acc=200.0, dec=400.0, vel=50.0))


def point(rig: Rig, name: str) -> LivePoint:
    found = live_point(rig.device, name)
    assert found is not None, name
    return found


def value(rig: Rig, name: str) -> float:
    found = point(rig, name)
    assert found.read is not None, name
    rig.device.advance(rig.now)
    return float(found.read(rig.now))


def moved() -> Rig:
    """M2, which has 100 imp/mm, has gone to 30 mm; M1 goes on at -50 imp/s; IN4, OUT3 and user registers are set."""
    rig = programmed("WAIT IN20 = ON\n", "", CONFIG)
    rig.enable(1, 2)
    rig.set("POS_ABS", 30.0, 2)
    rig.set("VEL_ABS", -50.0, 1)
    rig.pin("IN4", 1.0)
    rig.coil(6002, True)
    rig.i(6, -2)
    rig.r(8, 2.5)
    rig.write_words(10, 0xFFFE, 0xFFFF)
    rig.start()
    rig.wait(3.0)
    return rig


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("status", 0), ("program", 1), ("M1.status", 2), ("M2.status", 4), ("m2.Enabled", 1), ("M3.enabled", 0), ("M1.moving", 1),
        ("M2.moving", 0), ("M2.position", 30.0), ("M1.velocity", -50.0), ("M2.velocity", 0.0), ("M2.encoder", 375),
        ("M2_POS_ACT", 30.0), ("m1_vel_act", -50.0), ("M2_ACC", 200.0), ("M2_DEC", 400.0), ("M2_VMAX", 50.0), ("PROGRAM_CTRL", 1),
        ("IN4", 1), ("IN5", 0), ("OUT3", 1), ("OUT2", 0), ("ENC2_IMP", 375), ("ENC2_XPOS", 30.0), ("DATA_TYPE", 0),
        # Table 3.2, offset 10000: the position of M2 at 10022, its status at 10011; inputs from 5000, outputs from 6000 on.
        ("hr:10022", 30.0), ("HR:10011", 4), ("di:5003", 1), ("di:5004", 0), ("co:6002", 1), ("co:6001", 0), ("hr:10054", 50.0),
        # User registers from 0 on, two for DINT and REAL with the low word first.
        ("hr:6", 65534), ("hr:6:int", -2), ("hr:8:real", 2.5), ("hr:10:dint", -2), ("USER_REGISTER[6]", 65534),
        ("user_register[6]:int", -2), ("USER_REGISTER[8]:REAL", 2.5), ("USER_REGISTER[10]:dint", -2),
        ("USER_REGISTER[11]", 65535),
    ],
)  # fmt: skip
def test_values(name: str, shown: float) -> None:
    """400 counts of the encoder in 3200 pulses (MIC-27)."""
    assert value(moved(), name) == shown


def test_firmware_1_23_has_its_registers_at_1000() -> None:
    rig = Rig(CONFIG, "1.23")
    rig.enable(2)
    assert (value(rig, "hr:1011"), value(rig, "M2.status"), value(rig, "status")) == (1, 1, 0)
    assert point(rig, "M2.status").point.addresses[0].place == 1011


def test_status_of_a_firmware_without_its_register_is_a_value_all_the_same() -> None:
    """M_STATUS is a register of 1.70; programs and mechanics make it on the others too."""
    assert (point(Rig(firmware="1.40"), "status").point.addresses, value(Rig(firmware="1.40"), "status")) == ((), 0)
    assert point(Rig(), "status").point.addresses[0].place == 10009


@pytest.mark.parametrize(
    "name", ["M5.status", "M0.position", "X1.status", "1.status", "M1.nothing", "M1_NOTHING", "lamp", "hr10022"]
)
def test_what_is_no_point(name: str) -> None:
    assert live_point(Rig().device, name) is None


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("hr:10023", "'hr:10023': this is the second word of M2_POS_ACT, which is at 10022"),
        ("ir:10022", "'ir:10022': addresses begin with hr:, co:, di:"),
        ("hr:10022:real", "'hr:10022:real': M2_POS_ACT is of type .*; leave out :real"),
        ("hr:7:real", "7"),
        ("hr:9999", "9999"),
        ("", "'' is not a name of a value"),
    ],
)
def test_what_is_no_whole_value(name: str, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        live_point(Rig().device, name)


def test_what_can_only_be_written_has_no_value() -> None:
    for name in ("M1_EN", "M2_JOG_PLUS", "M_STOP", "JOG_SPEED", "M1_HOME"):
        found = point(Rig(), name)
        assert found.read is None
        assert found.point.access is Access.WRITE


def test_units_are_those_of_the_axis_and_user_registers_are_named_by_their_type() -> None:
    rig = Rig(CONFIG)
    units = {
        name: point(rig, name).point.unit for name in ("M1.position", "M2.position", "M2_ACC", "M2.velocity", "M1_VEL_ACT", "IN4")
    }
    assert units == {
        "M1.position": "imp",
        "M2.position": "mm",
        "M2_ACC": "mm/s²",
        "M2.velocity": "mm/s",
        "M1_VEL_ACT": "imp/s",
        "IN4": "",
    }
    (address,) = point(rig, "hr:10:dint").point.addresses
    assert (address.place, address.words, address.type) == (10, 2, "DINT")
    assert point(rig, "hr:10:dint").is_kept
    assert not point(rig, "M2_POS_ABS").is_kept


def test_a_value_goes_one_way_between_its_turns() -> None:
    """A move of 30 mm at 50 mm/s: up for 0.25 s, then even, then down within 0.125 s, at rest from then on."""
    rig = Rig(CONFIG)
    rig.enable(2)
    before = point(rig, "M2.velocity")
    assert before.version is not None
    version = before.version()
    rig.set("POS_ABS", 30.0, 2)
    assert before.version() != version
    for name in ("M2.velocity", "M2.position", "M2_POS_ACT", "M2.encoder"):
        found = point(rig, name)
        assert found.turning_points is not None
        up, down = 0.25, 0.125
        even = (30.0 - 0.5 * 50.0 * (up + down)) / 50.0
        turning_points = [turn / SECOND for turn in found.turning_points(rig.now)]
        assert turning_points[:3] == pytest.approx([up, up + even, up + even + down], abs=1e-8)
    assert point(rig, "IN4").turning_points is None
    assert point(rig, "M2_ACC").turning_points is None


@pytest.mark.parametrize(
    ("name", "is_kept"),
    [("M2_ACC", True), ("M1_DEC", True), ("M4_VMAX", True), ("DATA_TYPE", True), ("M2_POSLIM_L", False), ("PROGRAM_CTRL", False)],
)
def test_mic_40_a_write_that_acts_on_the_next_command_is_no_event(name: str, is_kept: bool) -> None:
    """ACC, DEC and VMAX act on the next command, soft limits at once."""
    assert point(Rig(CONFIG), name).is_kept is is_kept


def test_marks_change_with_each_point_that_neither_moves_nor_is_only_kept() -> None:
    rig = programmed("WAIT IN20 = ON\n", "", CONFIG)
    device = rig.device
    named = {one.path: live_point(device, one.path) for one in points(device.registers, [""] * 4) if "USER_REG" not in one.path}
    others = {
        path: one
        for path, one in named.items()
        if one and one.turning_points is None and not one.is_kept and path not in device.pins()
    }
    watched = {path: one.read for path, one in others.items() if one.read is not None}
    changed: set[str] = set()
    acts: list[Callable[[], object]] = [lambda: rig.enable(1, 2, 3, 4), rig.start, lambda: device.set_master_error(True, rig.now)]
    acts += [
        partial(rig.set, f"POSLIM_{side}", value, axis) for side, value in (("L", -9.0), ("R", 9.0)) for axis in (1, 2, 3, 4)
    ]
    acts += [partial(rig.word, f"AXIS_{key}_TRIG", 1) for key in ("VEL_ABS", "VEL_REL", "POS_ABS", "POS_REL")]
    for act in acts:
        values, before = {path: read(rig.now) for path, read in watched.items()}, marks(device)
        act()
        rig.wait(0.02)
        found = {path for path, read in watched.items() if read(rig.now) != values[path]}
        assert not found or marks(device) != before, found
        changed |= found
    assert changed == {*watched}
