"""The controller as a whole: the time contract, power, memory, program control, snapshots."""

from __future__ import annotations

import gc
import pickle
import tracemalloc
from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mic488_rig import (
    EN,
    JOG,
    OUT,
    STOP,
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

from steptwin.errors import Misuse, Runaway, TimeReversal
from steptwin.machine import MILLISECOND, SECOND, Nanos, PinEdge
from steptwin.mic488.config import AxisConfig, ControllerConfig, InputConfig, ProgramConfig
from steptwin.mic488.device import ControllerSnapshot, Mic488Device, pause_observer
from steptwin.mic488.encoder import Coupling
from steptwin.mic488.program import ProgramControl
from steptwin.mic488.vision import VisionRecord
from steptwin.state import Stateful

BUSY = ControllerConfig(
    axes=(
        AxisConfig(gear=10.0, limit_mode=3, in_kl=0, in_kr=1, home_mode=1),
        AxisConfig(gear=0.7, limit_mode=1, in_kl=2, home_mode=2, in_kr=1),
        AxisConfig(pos_ctrl_mode=1, err_ctrl_mode=3, home_mode=3, in_kl=4),
        AxisConfig(pos_ctrl_mode=2, limit_mode=2, in_kr=0),
    ),
    inputs=(InputConfig(), InputConfig(filter=1, level=1), *(InputConfig(),) * 18),
)
"""Every mode at once, with inputs that act on several axes."""


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
    rig.kernel.deadline()
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


# ---------------------------------------------------------------------- the time contract


def test_time_cannot_go_back() -> None:
    rig = Rig()
    rig.wait(1.0)
    for call in (
        lambda: rig.device.advance(SECOND - 1),
        lambda: rig.device.execute(read_pdu(3, 0, 1), SECOND - 1),
        lambda: rig.device.set_pin("IN1", 1, SECOND - 1),
        lambda: rig.device.turn_encoder(1, 1, SECOND - 1),
        lambda: rig.device.couple_encoder(1, Coupling.FREE, SECOND - 1),
        lambda: rig.device.power_cycle(SECOND - 1),
    ):
        with pytest.raises(TimeReversal, match=r"the machine is at 1000000000 ns, asked for 999999999 ns"):
            call()
    assert rig.device.now == SECOND
    assert rig.pins()["IN1"] == 0.0


def test_a_command_at_a_moment_comes_after_what_is_due_then() -> None:
    rig = Rig()
    rig.enable(1)
    rig.set("POS_ABS", 1000.0)
    rig.kernel.advance(2 * SECOND)
    assert rig.device.execute(word_pdu(rig.address("M_STOP"), 1), 2 * SECOND)
    assert rig.device.axes[0].status == 1
    assert rig.device.axes[0].coordinate_p(2 * SECOND) == 1000
    late = Rig()
    late.enable(1)
    late.set("POS_ABS", 1000.0)
    late.now = 2 * SECOND
    assert late.status() == 4


def test_events_due_at_one_moment_without_end_are_a_runaway(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig()
    monkeypatch.setattr(ProgramControl, "deadline", lambda program: 5)
    rig.device.command(lambda now: None, 0)
    with pytest.raises(Runaway, match="more than 10000 events of one MIC488 at 5 ns"):
        rig.device.advance(10)


Action = tuple[str, tuple[object, ...]]
PDUS = st.one_of(
    st.builds(
        lambda key, value, axis: ("set", (key, value, axis)),
        st.sampled_from(["POS_ABS", "POS_REL", "VEL_ABS", "VEL_REL", "HOME", "POS_ACT", "POSLIM_L", "POSLIM_R", "ENC_XPOS"]),
        st.floats(-2000.0, 2000.0, width=32),
        st.integers(1, 4),
    ),
    st.builds(
        lambda key, value, axis: ("set", (key, value, axis)),
        st.sampled_from(["ACC", "DEC", "VMAX"]),
        st.floats(1.0, 50_000.0, width=32),
        st.integers(1, 4),
    ),
    st.builds(
        lambda key, value: ("word", (key, value)),
        st.sampled_from(["AXIS_VEL_ABS_TRIG", "AXIS_POS_ABS_TRIG", "AXIS_POS_REL_TRIG", "M_ENABLE", "M_DISABLE", "M_STOP"]),
        st.integers(0, 15),
    ),
    st.builds(
        lambda key, value: ("word", (key, value)),
        st.sampled_from(["AXIS_CTR_MODE", "DATA_TYPE", "PROGRAM_CTRL"]),
        st.integers(0, 1),
    ),
    st.builds(
        lambda address, on: ("coil", (address, on)),
        st.one_of(
            st.integers(JOG, JOG + 7),
            st.integers(EN, EN + 3),
            st.integers(STOP, STOP + 3),
            st.integers(OUT, OUT + 7),
            st.integers(USER_REG_READ, USER_REG_ZERO),
        ),
        st.booleans(),
    ),
    st.builds(lambda number, on: ("pin", (f"IN{number}", float(on))), st.integers(1, 9), st.booleans()),
    st.builds(lambda axis, counts: ("turn", (axis, counts)), st.integers(1, 4), st.integers(-500, 500)),
    st.builds(lambda axis, coupling: ("couple", (axis, coupling)), st.integers(1, 4), st.sampled_from(Coupling)),
    st.just(("power_cycle", ())),
)
SCRIPTS = st.lists(st.tuples(PDUS, st.integers(0, 3 * SECOND)), min_size=2, max_size=20)


class Played:
    """A controller to which a script is played without a kernel between."""

    def __init__(self, config: ControllerConfig = BUSY) -> None:
        self.rig = Rig(config)
        self.device = self.rig.device
        self.device.execute(word_pdu(10014, 15), 0)

    def act(self, action: Action, now: Nanos) -> None:
        name, arguments = action
        device, rig = self.device, self.rig
        if name == "set":
            key, value, axis = arguments
            rig.dint = device.data_type == 1
            device.execute(rig.set_pdu(key, value, axis), now)  # type: ignore[arg-type]
        elif name == "word":
            key, value = arguments
            device.execute(word_pdu(rig.address(key), value), now)  # type: ignore[arg-type]
        elif name == "coil":
            device.execute(coil_pdu(*arguments), now)  # type: ignore[arg-type]
        elif name == "pin":
            device.set_pin(*arguments, now)  # type: ignore[arg-type]
        elif name == "turn":
            device.turn_encoder(*arguments, now)  # type: ignore[arg-type]
        elif name == "couple":
            device.couple_encoder(*arguments, now)  # type: ignore[arg-type]
        else:
            device.power_cycle(now)

    def look(self) -> list[bytes]:
        """Everything registers and inputs show at the present moment."""
        requests = [read_pdu(3, 10000, 14), read_pdu(3, 10020, 40), read_pdu(3, 10100, 16), read_pdu(3, 10120, 16)]
        requests += [read_pdu(1, 6000, 8), read_pdu(2, 5000, 20), read_pdu(3, 1000, 125)]
        return [self.device.execute(request, self.device.now) for request in requests]

    def everything(self) -> tuple[object, ...]:
        device = self.device
        return self.look(), dict(device.pins()), list(device.events), device.deadline(), device.copy_state()


@settings(max_examples=150)
@given(script=SCRIPTS, looks=st.lists(st.integers(0, 10**6), max_size=30))
def test_advancing_in_steps_and_looking_change_nothing(script: list[tuple[Action, Nanos]], looks: list[int]) -> None:
    one, other = Played(), Played()
    now = 0
    for action, pause in script:
        for part in sorted(looks):
            at = now + pause * part // 10**6
            if at >= other.device.now:
                other.device.advance(at)
                other.look()
                other.device.pins()
        now += pause
        one.act(action, now)
        other.act(action, now)
        assert one.everything() == other.everything()
    assert one.device.take_edges() == other.device.take_edges()


@settings(max_examples=150)
@given(script=SCRIPTS)
def test_from_event_to_event_the_deadline_is_always_later_and_the_end_is_the_same(script: list[tuple[Action, Nanos]]) -> None:
    one, other = Played(), Played()
    now = 0
    for action, pause in script:
        while (due := other.device.deadline()) is not None and due <= now + pause:
            assert due > other.device.now or other.device.now == now
            other.device.advance(due)
            following = other.device.deadline()
            assert following is None or following > due
        now += pause
        one.act(action, now)
        other.act(action, now)
    one.device.advance(now + SECOND)
    other.device.advance(now + SECOND)
    assert one.everything() == other.everything()
    edges = one.device.take_edges()
    assert edges == other.device.take_edges()
    assert all(before.time <= after.time for before, after in pairwise(edges))


@settings(max_examples=30)
@given(script=SCRIPTS)
def test_edges_lead_from_the_first_pins_to_the_last(script: list[tuple[Action, Nanos]]) -> None:
    played = Played()
    levels = {pin: 0.0 for pin in played.device.pins() if not pin.startswith(("IN", "AIN"))}
    now = 0
    for action, pause in script:
        now += pause
        played.act(action, now)
    for edge in played.device.take_edges():
        assert levels[edge.pin] != edge.value
        levels[edge.pin] = edge.value
    pins = played.device.pins()
    assert levels == {pin: pins[pin] for pin in levels}


# ---------------------------------------------------------------------- snapshots


@settings(max_examples=150)
@given(script=SCRIPTS, cut=st.integers(0, 14))
def test_a_snapshot_put_back_changes_nothing_and_goes_on_alike(script: list[tuple[Action, Nanos]], cut: int) -> None:
    one, other = Played(), Played(BUSY)
    now = 0
    for action, pause in script[:cut]:
        now += pause
        one.act(action, now)
    snapshot = one.device.snapshot()
    before = one.everything()
    other.device.restore(pickle.loads(pickle.dumps(snapshot)))
    assert other.everything() == before
    middle = now
    for action, pause in script[cut:]:
        now += pause
        one.act(action, now)
        other.act(action, now)
    assert one.everything() == other.everything()
    assert one.device.take_edges() == other.device.take_edges()
    one.device.restore(snapshot)  # what happened since has not touched it
    assert one.everything() == before
    assert one.device.now == middle


def test_a_snapshot_takes_a_moving_controller_back_in_time() -> None:
    rig = Rig()
    rig.enable(1)
    rig.set("POS_ABS", 2000.0)
    rig.wait(1.0)
    snapshot = rig.device.snapshot()
    changed: list[int] = []
    rig.wait(5.0)
    assert rig.position() == 2000.0
    rig.device.changed = lambda: changed.append(1)
    rig.device.restore(snapshot)
    assert changed
    assert rig.device.now == SECOND
    assert rig.device.deadline() == 3 * SECOND
    assert rig.device.axes[0].coordinate_p(SECOND) == 500


def test_mechanics_notice_a_profile_that_was_put_back() -> None:
    rig = Rig()
    rig.switch(1, 400, None, "IN1")
    rig.enable(1)
    rig.set("POS_ABS", 1000.0)
    snapshot = rig.device.snapshot()
    before = rig.device.axes[0].revision
    rig.stop()
    rig.device.restore(snapshot)
    assert rig.device.axes[0].revision > before + 1
    rig.wait(1.0)
    assert rig.pins()["IN1"] == 1.0


def test_hooks_are_no_part_of_a_snapshot() -> None:
    saved: list[bytes] = []
    rig = Rig()
    snapshot = rig.device.snapshot()
    rig.device.store = saved.append
    rig.device.restore(snapshot)
    rig.coil(USER_REG_SAVE, True)
    assert len(saved) == 1


def test_a_snapshot_belongs_to_its_firmware_and_configuration() -> None:
    snapshot = Rig(firmware="1.40").device.snapshot()
    assert isinstance(snapshot, ControllerSnapshot)
    with pytest.raises(Misuse, match=r"the snapshot is of firmware 1\.40, this controller has 1\.70"):
        Rig().device.restore(snapshot)
    with pytest.raises(Misuse, match="another configuration"):
        Rig(controller(AxisConfig(gear=2.0)), "1.40").device.restore(snapshot)


def parts_of(device: Mic488Device) -> list[Stateful]:
    axis = device.axes[0]
    return [device, device.inputs, device.program, axis, axis.homing, axis.encoder, axis.control]


@pytest.mark.parametrize("part", parts_of(Rig().device), ids=lambda part: type(part).__name__)
def test_parts_keep_all_they_have_in_slots_so_that_nothing_is_forgotten(part: Stateful) -> None:
    assert not hasattr(part, "__dict__")
    slots = {name for base in type(part).__mro__ for name in getattr(base, "__slots__", ())}
    assert slots >= part.FIXED
    assert len(part.copy_state()) == len(slots - part.FIXED)


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


def test_a_controller_at_rest_has_nothing_to_do() -> None:
    rig = Rig(BUSY)
    rig.enable(1, 2, 3, 4)
    rig.pin("IN8", 1)
    assert rig.device.deadline() == 10 * MILLISECOND
    rig.wait(0.01)
    assert rig.device.deadline() is None


@pytest.mark.parametrize(("unit", "told"), [(0, [3, 7]), (3, [3]), (7, [7])])
def test_mic_15_a_pause_inside_a_request_is_an_event_of_those_it_was_for(unit: int, told: list[int]) -> None:
    devices = {3: Mic488Device(ControllerConfig()), 7: Mic488Device(ControllerConfig())}
    pause_observer(devices)(unit, 1_250_000)
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
