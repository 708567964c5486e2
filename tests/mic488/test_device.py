"""The controller as a whole: power, memory, program control, events."""

from __future__ import annotations

import gc
import tracemalloc
from collections.abc import Callable, Iterable
from dataclasses import replace

import pytest
from mic488_rig import (
    OUT,
    USER_REG_READ,
    USER_REG_SAVE,
    USER_REG_ZERO,
    Rig,
    coil_pdu,
    controller,
    read_pdu,
    word_pdu,
    words_pdu,
)

from steptwin.controller import SECOND, PinEdge
from steptwin.errors import Misuse
from steptwin.mic488.config import AxisConfig, ControllerConfig, InputConfig, ProgramConfig
from steptwin.mic488.device import Mic488Device, pause_callback
from steptwin.mic488.encoder import Coupling
from steptwin.mic488.vision import VisionRecord

# ---------------------------------------------------------------------- power-on


@pytest.mark.parametrize("firmware", ["1.23", "1.40", "1.70"])
def test_mic_27_power_on_without_a_configuration(firmware: str) -> None:
    rig = Rig(firmware=firmware)
    assert rig.read_words(rig.base, 14) == [0] * 14
    assert [rig.get(key, axis) for key in ("POS_ACT", "VEL_ACT", "ENC_IMP", "ENC_XPOS") for axis in (1, 2, 3, 4)] == [0.0] * 16
    assert [rig.get(key, axis) for key in ("ACC", "DEC", "VMAX") for axis in (1, 2, 3, 4)] == [1000.0] * 12
    assert rig.bits(1, OUT, 8) == [0] * 8
    assert rig.bits(2, 5000, 20) == [0] * 20
    for first in range(0, rig.device.firmware.user_registers, 100):
        assert rig.read_words(first, 100) == [0] * 100
    assert set(rig.pins().values()) == {0.0}
    assert rig.device.deadline() is None


def test_mic_27_parameters_come_from_the_configuration() -> None:
    rig = Rig(controller(AxisConfig(gear=100.0, acc=5.0, dec=6.0, vel=7.5, enc_offset=-9), AxisConfig(gear=2.0, vel=3.0)))
    assert [rig.get(key) for key in ("ACC", "DEC", "VMAX", "ENC_IMP")] == [5.0, 6.0, 7.5, -9]
    assert rig.get("VMAX", 2) == 3.0
    rig.use_dint()
    assert [rig.get(key) for key in ("ACC", "DEC", "VMAX")] == [500, 600, 750]


def test_unknown_firmware_is_misuse() -> None:
    with pytest.raises(Misuse, match=r"unknown firmware '1\.71'; permitted: 1\.23, 1\.40, 1\.70"):
        Mic488Device(ControllerConfig(), "1.71")


def test_mic_27_power_cycle_forgets_everything_but_terminals_shafts_and_stored_registers() -> None:
    rig = Rig(controller(AxisConfig(gear=10.0, enc_offset=5), AxisConfig(), inputs=(InputConfig(filter=4),) * 20))
    rig.write_words(1000, 11, 22)
    rig.coil(USER_REG_SAVE, True)
    rig.enable(1, 2)
    rig.set("ACC", 1.0)
    rig.set("POSLIM_R", 50.0)
    rig.coil(OUT + 4, True)
    rig.word("PROGRAM_CTRL", 1)
    rig.word("PROG_BANK_SEL", 3)
    rig.pin("IN7", 1)
    rig.pin("AIN1", 2.5)
    rig.set("VEL_ABS", 100.0, 2)
    rig.word("AXIS_CTR_MODE", 1)
    rig.set("POS_ABS", 5.0)
    rig.use_dint()
    rig.wait(1.0)
    rig.edges.clear()
    turned = rig.device.axes[1].profile.count(rig.now)
    assert turned > 0
    revision = rig.device.axes[1].revision

    rig.device.power_cycle(rig.now)
    rig.scheduler.deadline()
    rig.dint = False
    fresh = Rig(rig.device.config)
    for block, count in ((10000, 14), (10020, 40), (10100, 16), (10120, 16), (0, 125), (1000, 125)):
        assert rig.read_words(block, count) == fresh.read_words(block, count), block
    assert set(rig.edges) == {PinEdge(SECOND, pin, 0.0) for pin in ("OUT5", "M1_EN", "M2_EN", "ERR")}
    assert len(rig.edges) == 4
    assert (rig.pins()["IN7"], rig.pins()["AIN1"]) == (1.0, 2.5)
    assert rig.bits(2, 5006, 1) == [1]  # as it lies there, without waiting
    assert rig.device.axes[1].profile.count(rig.now) == turned
    assert rig.device.axes[1].revision > revision
    assert rig.device.now == SECOND
    rig.coil(USER_REG_READ, True)
    assert rig.read_words(1000, 2) == [11, 22]
    rig.enable(1)
    rig.word("AXIS_POS_ABS_TRIG", 1)
    assert rig.status() == 1  # the stored value is gone


# ---------------------------------------------------------------------- user registers and their stored copy


def test_user_registers_are_saved_read_back_and_set_to_zero() -> None:
    saved: list[bytes] = []
    rig = Rig()
    rig.device.store = saved.append
    rig.write_words(998, 1, 2, 0x1234, 4)
    rig.write_words(1999, 0xFFFE)
    rig.coil(USER_REG_SAVE, True)
    assert len(saved) == 1
    assert (len(saved[0]), saved[0][:4], saved[0][-2:]) == (2000, bytes.fromhex("1234 0004"), bytes.fromhex("FFFE"))
    rig.coil(USER_REG_ZERO, True)
    assert rig.read_words(998, 4) == [1, 2, 0, 0]
    assert rig.read_words(1999, 1) == [0]
    rig.coil(USER_REG_READ, True)
    assert rig.read_words(998, 4) == [1, 2, 0x1234, 4]
    assert rig.read_words(1999, 1) == [0xFFFE]


def test_stored_registers_come_back_only_by_coil_2100() -> None:
    memory = bytes.fromhex("ABCD") + bytes(1998)
    rig = Rig(memory=memory)
    assert rig.read_words(1000, 1) == [0]
    rig.coil(USER_REG_READ, True)
    assert rig.read_words(1000, 2) == [0xABCD, 0]


def test_off_written_to_a_memory_coil_does_nothing() -> None:
    rig = Rig(memory=b"\x01" * 2000)
    rig.write_words(1000, 7)
    for coil in (USER_REG_READ, USER_REG_SAVE, USER_REG_ZERO):
        rig.coil(coil, False)
    assert rig.read_words(1000, 1) == [7]
    rig.coil(USER_REG_READ, True)
    assert rig.read_words(1000, 1) == [0x0101]


def test_a_store_that_fails_is_answered_with_exception_04_and_keeps_the_old_copy() -> None:
    def full(memory: bytes) -> None:
        raise OSError(28, "No space left on device")

    rig = Rig()
    rig.write_words(1000, 1)
    rig.coil(USER_REG_SAVE, True)
    rig.device.store = full
    rig.write_words(1000, 2)
    assert rig.exception(coil_pdu(USER_REG_SAVE, True)) == 4
    assert "No space left" in rig.events("memory-failure")[0].text
    rig.coil(USER_REG_READ, True)
    assert rig.read_words(1000, 1) == [1]


@pytest.mark.parametrize(("firmware", "memory", "permitted"), [("1.70", bytes(1999), 2000), ("1.23", bytes(2), 0)])
def test_memory_of_the_wrong_size_is_misuse(firmware: str, memory: bytes, permitted: int) -> None:
    with pytest.raises(Misuse, match=f"firmware {firmware} take {permitted} bytes, not {len(memory)}"):
        Mic488Device(ControllerConfig(), firmware, memory=memory)


# ---------------------------------------------------------------------- program control


def test_an_empty_bank_lights_err_and_mic_22_reads_stopped() -> None:
    rig = Rig()
    rig.word("PROG_BANK_SEL", 4)
    rig.wait(1.0)
    rig.word("PROGRAM_CTRL", 1)
    assert (rig.word("PROGRAM_CTRL"), rig.word("M_STATUS"), rig.pins()["ERR"]) == (0, 2, 1.0)
    assert rig.edges == [PinEdge(SECOND, "ERR", 1.0)]
    assert [event.text for event in rig.events("program-error")] == ["program bank 4 is empty"]


def test_mic_26_a_program_error_is_cleared_by_the_next_stop() -> None:
    rig = Rig()
    rig.word("PROGRAM_CTRL", 1)
    rig.word("PROGRAM_CTRL", 2)
    assert rig.word("M_STATUS") == 2
    rig.word("PROGRAM_CTRL", 0)
    assert (rig.word("M_STATUS"), rig.pins()["ERR"]) == (0, 0.0)


def test_mic_31_program_control_0_without_a_program_does_nothing() -> None:
    """A master that zeroes the control registers when it starts switches no machine off."""
    rig = Rig()
    rig.enable(1, 3)
    rig.set("VEL_ABS", 100.0)
    rig.coil(OUT + 2, True)
    rig.write_words(rig.base, 0, 0, 0, 0, 0)
    rig.word("PROGRAM_CTRL", 0)
    assert [rig.status(axis) for axis in (1, 2, 3, 4)] == [2, 0, 1, 0]
    assert rig.bits(1, OUT, 8) == [0, 0, 1, 0, 0, 0, 0, 0]


def test_an_unexpected_failure_of_a_request_is_answered_and_told() -> None:
    rig = Rig()

    def fail(memory: bytes) -> None:
        raise ZeroDivisionError("of the store")

    rig.device.store = fail
    assert rig.ask(coil_pdu(USER_REG_SAVE, True)) == b"\x85\x04"
    (event,) = rig.events("internal-error")
    assert event.text.startswith("request 05 08 35 ff 00 failed, please report it: ZeroDivisionError: of the store (")
    assert event.text.endswith(f"test_device.py:{fail.__code__.co_firstlineno + 1})")
    assert rig.exception(read_pdu(3, rig.base, 1)) == 0


@pytest.mark.parametrize(("firmware", "status"), [("1.70", 3), ("1.40", 0)])
def test_wbc_13_an_error_of_the_modbus_master_is_shown_after_all_others(firmware: str, status: int) -> None:
    rig = Rig(firmware=firmware)
    rig.device.set_master_error(True, rig.now)
    assert rig.word("M_STATUS") == status
    rig.word("PROGRAM_CTRL", 1)
    assert rig.word("M_STATUS") == (2 if status else 0)
    rig.word("PROGRAM_CTRL", 0)
    rig.device.set_master_error(False, rig.now)
    assert rig.word("M_STATUS") == 0


def test_a_position_error_is_shown_before_a_program_error() -> None:
    rig = Rig(controller(AxisConfig(pos_ctrl_mode=1, err_ctrl_mode=1)))
    rig.word("PROGRAM_CTRL", 1)
    rig.enable(1)
    rig.device.couple_encoder(1, Coupling.BLOCKED, 0)
    rig.set("VEL_ABS", 100.0)
    rig.until(1, 5)
    assert rig.word("M_STATUS") == 1
    rig.word("M_DISABLE", 1)
    assert rig.word("M_STATUS") == 2
    assert [edge.value for edge in rig.edges if edge.pin == "ERR"] == [1.0]


def test_a_program_to_run_at_power_on() -> None:
    rig = Rig(replace(ControllerConfig(), program=ProgramConfig(activate=1, prog_bank=2, pos_bank=3)))
    assert (rig.word("PROG_BANK_SEL"), rig.word("POS_BANK_SEL"), rig.word("M_STATUS")) == (2, 3, 2)
    rig.word("PROGRAM_CTRL", 0)
    rig.device.power_cycle(SECOND)
    rig.now = SECOND
    assert rig.word("M_STATUS") == 2


# ---------------------------------------------------------------------- events and size


def test_events_are_told_and_the_last_ones_kept() -> None:
    rig = Rig()
    told: list[str] = []
    rig.device.on_event = lambda event: told.append(event.code)
    for _ in range(1200):
        rig.set("VEL_ABS", 1.0)
    assert told == ["drive-off"] * 1200
    assert len(rig.device.events) == 1000


def test_an_idle_controller_is_small() -> None:
    def some(number: int) -> Iterable[Mic488Device]:
        return [Mic488Device(config) for _ in range(number)]

    config = ControllerConfig()
    some(1)
    gc.collect()
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        controllers = some(100)
        gc.collect()
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(list(controllers)) == 100
    assert (after - before) / 100 < 16_000


@pytest.mark.parametrize(("unit", "told"), [(0, [3, 7]), (3, [3]), (7, [7])])
def test_mic_15_a_pause_inside_a_request_is_an_event_of_those_it_was_for(unit: int, told: list[int]) -> None:
    devices = {3: Mic488Device(ControllerConfig()), 7: Mic488Device(ControllerConfig())}
    pause_callback(devices)(unit, 1_250_000)
    text = "a request had a pause of 1.2 ms inside: the controller drops a frame at 0.75 ms (MIC-15)"
    assert {n: [(e.code, e.text) for e in d.events] for n, d in devices.items()} == {
        n: [("frame-pause", text)] if n in told else [] for n in devices
    }


@pytest.mark.parametrize(
    "act",
    [
        lambda device, now: device.set_pin("IN1", 1.0, now),
        lambda device, now: device.set_pin("AIN1", 5.0, now),
        lambda device, now: device.see(VisionRecord(1.0, 2.0, 3.0, 4.0), now),
        lambda device, now: device.turn_encoder(1, 30, now),
        lambda device, now: device.couple_encoder(1, Coupling.BLOCKED, now),
        lambda device, now: device.follow_shaft(1, None, now),
        lambda device, now: device.gear_encoder(1, -7, 3, now),
        lambda device, now: device.execute(word_pdu(10014, 2), now),
        lambda device, now: device.power_cycle(now),
        lambda device, now: device.power_off(now),
    ],
)
def test_an_input_comes_after_all_that_is_due_at_its_moment(act: Callable[[Mic488Device, int], object]) -> None:
    """Rule 1 of the time contract: nobody need advance the controller before."""
    states = []
    for advanced in (True, False):
        device = Mic488Device(controller(AxisConfig(pos_ctrl_mode=1, enc_settle_ms=20)))
        device.execute(word_pdu(10014, 1), 0)
        device.execute(words_pdu(10092, 0, 0x447A), 0)  # M1_POS_REL 1000
        device.turn_encoder(1, -50, SECOND)
        # At rest from 2 s on, corrected a little later.
        for now in (1_500_000_000, 2_100_000_000):
            if advanced:
                device.advance(now)
            act(device, now)
        states.append((device.now, device.copy_state(), device.take_edges(), list(device.events)))
    assert states[0] == states[1]
