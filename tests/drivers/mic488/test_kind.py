"""The MIC488 as a kind of device: what the commands of the shell do with it. The twin lives in virtual time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from host_rig import Wire, driver, run_virtual
from line_rig import at_every_address
from mic488_rig import loaded

from steptwin.controller import MILLISECOND
from steptwin.drivers.kind import DeviceAddress, DriverKind, EndedMotion, FoundDevice, WantedMoves
from steptwin.drivers.mic488.kind import MIC488_DRIVER, RUNS_ON, of_mic488, unit_of
from steptwin.drivers.mic488.sync import Mic488
from steptwin.errors import LineFailure, Misuse, Refusal
from steptwin.files.world import World
from steptwin.mic488.configtext import config_text
from steptwin.mic488.registers import FIRMWARES
from steptwin.subject.devicetwin import DeviceTwin
from steptwin.wire.frameline import FrameLine
from steptwin.wire.rtu import encode_frame
from steptwin.wire.slave import FrameDirection

ADDRESS = DeviceAddress("memory", "mic488", None, 38400, 0.3, "1.70")


def nothing() -> None:
    """No reason not to move."""


def begin(mic: Mic488, moves: WantedMoves) -> list[EndedMotion]:
    begun: set[int] = set()
    checks: list[set[int]] = []
    motion = MIC488_DRIVER.move(moves)
    assert list(motion.axes) == list(moves.targets)
    motion.begin(mic, begun, lambda: checks.append(set(begun)))
    assert begun == set(moves.targets)
    assert checks == [set(), set()]  # before the velocity is set, and before the motion begins
    return list(MIC488_DRIVER.wait(mic, motion.axes, None))


def enabled(wire: Wire, *axes: int) -> Mic488:
    mic = driver(wire)
    MIC488_DRIVER.enable(mic, axes or (1,), True)
    return mic


def test_a_move_of_one_axis() -> None:
    wire = Wire()
    mic = enabled(wire, 2)
    (end,) = begin(mic, WantedMoves({2: 5.0}, False, None))
    assert (end.axis, end.name, end.ok, end.reason, end.position, end.unit) == (2, "M2", True, "target reached", 5.0, "mm")
    assert str(end) == "M2: target reached at 5 mm"
    assert not end.is_overdue
    (end,) = begin(mic, WantedMoves({2: 5.0}, True, 10.0))
    assert end.position == 10.0
    assert mic.get("M2_VMAX") == {"M2_VMAX": 10.0}
    # 5 mm at 10 mm/s with ramps of 50 mm/s²: 0.5 s, and 0.2 s for the ramps.
    assert end.after_s == pytest.approx(0.7, abs=0.1)


def test_moves_of_several_axes_begin_together() -> None:
    wire = Wire()
    mic = enabled(wire, 1, 2)
    assert [end.position for end in begin(mic, WantedMoves({1: 2.0, 2: 4.0}, False, 20.0))] == [2.0, 4.0]
    assert [end.position for end in begin(mic, WantedMoves({1: 2.0, 2: 4.0}, True, None))] == [4.0, 8.0]
    assert list(mic.get("M1_VMAX", "M2_VMAX", "M3_VMAX").values()) == [20.0, 20.0, 25.0]


def test_a_refusal_before_the_motion_begins_nothing() -> None:
    wire = Wire()
    mic = enabled(wire)
    begun: set[int] = set()

    def refuse() -> None:
        raise Misuse("not now")

    with pytest.raises(Misuse, match="not now"):
        MIC488_DRIVER.move(WantedMoves({1: 5.0}, False, 10.0)).begin(mic, begun, refuse)
    assert begun == set()
    assert mic.get("M1_VMAX") == {"M1_VMAX": 25.0}
    wire.rest(1.0)
    assert wire.position(1) == 0


def test_homing_of_axes_one_after_the_other() -> None:
    wire = Wire()
    mic = enabled(wire, 1, 3)
    motion = MIC488_DRIVER.home(["1=-5", "M3=-4"])
    assert tuple(motion.axes) == (1, 3)
    begun: set[int] = set()
    checks: list[set[int]] = []
    motion.begin(mic, begun, lambda: checks.append(set(begun)))
    assert (begun, checks) == ({1, 3}, [set(), {1}])
    ends = MIC488_DRIVER.wait(mic, motion.axes, 60.0)
    assert [(end.name, end.ok, end.position) for end in ends] == [("M1", True, 0.0), ("M3", True, 0.0)]
    with pytest.raises(Misuse, match="'5' is not an axis: permitted are 1 to 4, or M1 to M4"):
        MIC488_DRIVER.home(["5=1"])


def test_an_end_that_does_not_come_in_time_is_overdue() -> None:
    wire = Wire()
    mic = enabled(wire)
    MIC488_DRIVER.move(WantedMoves({1: 200.0}, False, None)).begin(mic, set(), nothing)
    (end,) = MIC488_DRIVER.wait(mic, (1,), 0.5)
    assert (end.ok, end.is_overdue) == (False, True)
    MIC488_DRIVER.halt(mic, (1,))
    assert not wire.moving(1)


def test_a_dead_man_jog() -> None:
    wire = Wire()
    mic = enabled(wire, 2)
    jog = MIC488_DRIVER.jog(mic, 2, 10.0, 0.4)
    assert (jog.unit, jog.ahead_s) == ("mm", 0.0)
    with jog:
        assert jog.hold()
        assert wire.moving(2)
        assert not wire.moving(1)
    assert mic.get("M2_VMAX") == {"M2_VMAX": 25.0}, "that of the jog was another"
    end = jog.ended()
    assert not wire.moving(2)
    assert (end.name, end.unit) == ("M2", "mm")
    assert end.position == pytest.approx(wire.position(2) / 100.0)
    assert wire.position(2) > 0


def test_a_jog_that_was_not_let_go_says_why_it_ended() -> None:
    wire = Wire()
    mic = enabled(wire)
    jog = MIC488_DRIVER.jog(mic, 1, -20.0, 0.4)
    with jog:
        while jog.hold():
            pass
    end = jog.ended()
    assert (end.ok, end.reason) == (False, "stopped at limit L")
    assert end.position == pytest.approx(wire.position(1) / 100.0)


def test_a_jog_that_another_master_has_taken_over_says_so() -> None:
    """The axis runs on without end, so that nothing is waited for."""
    wire = Wire()
    mic = enabled(wire)
    jog = MIC488_DRIVER.jog(mic, 1, 5.0, 0.4)
    with jog:
        driver(wire).set("M1_VEL_ABS", 5.0)
        assert not jog.hold()
    end = jog.ended()
    assert (end.ok, end.reason, end.position) == (False, "redirected by another command", None)
    assert wire.moving(1)


def test_drives_are_switched_on_and_off() -> None:
    wire = Wire()
    mic = enabled(wire, 1, 3)
    assert mic.status().axes == (1, 0, 1, 0)
    MIC488_DRIVER.enable(mic, (1,), False)
    assert mic.status().axes == (0, 0, 1, 0)


def test_a_stop_opens_the_line_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = Wire()
    mic = enabled(wire, 1, 2)
    MIC488_DRIVER.move(WantedMoves({1: 200.0, 2: 200.0}, False, None)).begin(mic, set(), nothing)
    wire.sleep(1.0)
    at_every_address(monkeypatch, wire)
    before = wire.opened
    assert MIC488_DRIVER.stop(ADDRESS, None, (2,), False) is None
    assert wire.opened == before + 1
    assert (wire.moving(1), wire.moving(2)) == (True, False)
    MIC488_DRIVER.stop(ADDRESS, None, (), False)
    assert not wire.moving(1)


def test_a_stop_warns_of_a_program_that_runs_on(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = Wire()
    wire.twin.load_program(0, loaded("WHILE 1 = 1\nDELAY 1\nENDWHILE\n")[0])
    at_every_address(monkeypatch, wire)
    mic = driver(wire)
    mic.program.start()
    assert MIC488_DRIVER.stop(ADDRESS, None, (), False) == RUNS_ON
    assert MIC488_DRIVER.stop(ADDRESS, None, (), True) is None
    assert mic.program.state() == 0
    assert MIC488_DRIVER.stop(ADDRESS, None, (), False) is None


def test_who_only_observes_leaves_the_data_type(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = Wire()
    driver(wire).set("DATA_TYPE", 1)
    at_every_address(monkeypatch, wire)
    log: list[str] = []
    with MIC488_DRIVER.opened(ADDRESS, True, log.append) as mic:
        assert (mic.unit, mic.firmware) == (1, "1.70")
        assert mic.get("DATA_TYPE") == {"DATA_TYPE": 1}
    assert log
    with MIC488_DRIVER.opened(ADDRESS, False, None) as mic:
        assert mic.get("DATA_TYPE") == {"DATA_TYPE": 0}


def test_controllers_on_a_line_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = Wire(units=(2, 5))
    begin = wire.now
    at_every_address(monkeypatch, wire)
    asked: list[int] = []
    assert MIC488_DRIVER.search is not None
    found = MIC488_DRIVER.search.find("memory", 38400, [1, 2, 5], 0.2, asked.append)
    assert found == [FoundDevice(2, "1.70", "MIC488, firmware 1.70"), FoundDevice(5, "1.70", "MIC488, firmware 1.70")]
    assert asked == [1, 2, 5]
    assert 200 * MILLISECOND < wire.now - begin < 400 * MILLISECOND, "one unit does not answer"
    assert (MIC488_DRIVER.search.disturbs, MIC488_DRIVER.search.numbers) == (True, None)


def test_a_controller_as_a_subject(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """What the studio connects: it observes, and a twin beside it begins in the state in which the controller is."""
    wire = Wire(units=(2,))
    mic = driver(wire, 2)
    mic.enable(2, 4)
    mic.axis(2).set_ramp(velocity=12.5)
    mic.user.words.write(7, 99)
    mic.set("DATA_TYPE", 1)
    at_every_address(monkeypatch, wire)
    config = tmp_path / "table.cfg"
    config.write_text(config_text(wire.config, FIRMWARES["1.70"]))
    address = DeviceAddress("memory", "mic488", 2, 38400, 0.25, "1.70", str(config))
    connect, part_of = MIC488_DRIVER.line, MIC488_DRIVER.part

    async def twin_of(address: DeviceAddress) -> DeviceTwin:
        line = connect("memory", 38400)
        await line.open()
        try:
            part = await part_of(address, line)
            assert part.address == 2
            assert part.unit_of("M2.position") == "mm"
            return await part.twin("beside")
        finally:
            await line.close()

    twin = run_virtual(wire, twin_of(address))
    assert mic.get("DATA_TYPE") == {"DATA_TYPE": 1}
    assert twin.enabled == [2, 4]
    assert twin.values[0] == ("DATA_TYPE", 1.0)
    assert dict(twin.values)["M2_VMAX"] == 12.5
    assert dict(twin.values)["USER_REGISTER[7]"] == 99.0
    assert not [name for name in dict(twin.values) if name.startswith("USER") and name != "USER_REGISTER[7]"]
    assert set(twin.compared) < set(dict(twin.values))
    assert "M2_VMAX" in twin.compared
    assert "M2_POS_ACT" not in twin.compared
    world = World.from_toml(twin.text, twin.files)
    assert list(world.mic488) == ["beside"]
    assert world.lines[twin.line].units == (2,)
    assert world.mic488["beside"].device.config.axes == wire.config.axes
    assert 'firmware = "1.40"' in run_virtual(wire, twin_of(replace(address, variant="1.40"))).text
    # No configuration, and a motion.
    scaled = replace(address, config=None, scales=(("mm", 100.0),) * 4)
    for changed, message in ((scaled, "connect it with config=FILE"), (address, "M2 runs")):
        if changed is address:
            mic.axis(2).move_by(100.0)
        with pytest.raises(Refusal, match=message):
            run_virtual(wire, twin_of(changed))
    wire.severed = True
    with pytest.raises(LineFailure, match=r"within 0\.25 s"):
        run_virtual(wire, twin_of(address))


def test_the_slave_address_is_1_if_none_is_given() -> None:
    assert unit_of(ADDRESS) == 1
    assert unit_of(DeviceAddress("memory", "mic488", 7, 38400, 0.3)) == 7
    assert MIC488_DRIVER.selection.usual == 1


def test_what_only_a_mic488_has() -> None:
    assert of_mic488(ADDRESS, "record") is ADDRESS
    with pytest.raises(Misuse, match="record is for a MIC488; memory is of kind m1486"):
        of_mic488(DeviceAddress("memory", "m1486", None, 4800, 0.3), "record")


def test_axes_that_it_has() -> None:
    assert [MIC488_DRIVER.check_axis(axis) for axis in (1, 4)] == [1, 4]
    for axis in (0, 5):
        with pytest.raises(Misuse, match=rf"axis {axis} is not one of a MIC488: permitted are 1 to 4$"):
            MIC488_DRIVER.check_axis(axis)


def test_what_it_takes() -> None:
    assert set(MIC488_DRIVER.programs) == {".prg", ".wbc"}
    assert not MIC488_DRIVER.offers(DriverKind.send)
    assert "not documented" in MIC488_DRIVER.cannot_send
    assert MIC488_DRIVER.selection.options == {"unit", "firmware", "config"}
    assert (MIC488_DRIVER.axes, MIC488_DRIVER.baud) == (4, 38400)


@pytest.mark.parametrize(("firmware", "name"), [(None, "M_STATUS"), ("1.70", "M_STATUS"), ("1.40", "M_ALL_STATUS")])
def test_a_listener_names_registers_of_the_firmware_by_default_the_latest(firmware: str | None, name: str) -> None:
    """Register 10009 has another name since 1.70."""
    heard: list[FrameLine] = []
    assert MIC488_DRIVER.decoding is not None
    decoder = MIC488_DRIVER.decoding.make(heard.append, firmware, False)
    decoder.feed(encode_frame(1, bytes.fromhex("03 2719 0001")), 5, FrameDirection.IN)
    decoder.feed(encode_frame(1, bytes.fromhex("03 02 0000")), 10**9, FrameDirection.OUT)
    decoder.expire(2 * 10**9)
    assert any(f" {name}" in line.meaning for line in heard), [line.meaning for line in heard]
