"""The controller as a whole: the time contract and snapshots."""

from __future__ import annotations

import pickle
from collections.abc import Callable
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
    programmed,
    read_pdu,
    word_pdu,
)

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.errors import Misuse, Runaway, TimeReversal
from steptwin.mic488.config import AxisConfig, ControllerConfig, InputConfig
from steptwin.mic488.device import ControllerSnapshot, Mic488Device
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


CALLS: dict[str, Callable[[Mic488Device, Nanos], object]] = {
    "advance": lambda device, now: device.advance(now),
    "request": lambda device, now: device.execute(read_pdu(3, 0, 1), now),
    "command": lambda device, now: device.command(lambda _: None, now),
    "pin": lambda device, now: device.set_pin("IN1", 1, now),
    "record": lambda device, now: device.see(VisionRecord(1, 2, 3, 4), now),
    "turn": lambda device, now: device.turn_encoder(1, 5, now),
    "couple": lambda device, now: device.couple_encoder(1, Coupling.FREE, now),
    "follow": lambda device, now: device.follow_shaft(1, None, now),
    "gear": lambda device, now: device.gear_encoder(1, 5, 3, now),
    "master error": lambda device, now: device.set_master_error(True, now),
    "power off": lambda device, now: device.power_off(now),
    "power cycle": lambda device, now: device.power_cycle(now),
}


@pytest.mark.parametrize("name", CALLS)
def test_whatever_is_done_at_a_moment_finds_the_controller_there(name: str) -> None:
    """What was due before has been done before."""
    rig = programmed("DELAY 0.5\nOUT1 = ON\n$I0 = Status\n$I1 = VisionNo\n$I2 = ENC1\nWAIT 1 = 2\n")
    rig.start()
    device = rig.device
    CALLS[name](device, SECOND)
    assert device.now == SECOND
    edges = [edge for edge in device.take_edges() if edge.pin == "OUT1"]
    assert edges[0].time == 501 * MILLISECOND
    assert list(device.user[:3]) == [0, 0, 0]


def test_a_command_at_a_moment_comes_after_what_is_due_then() -> None:
    rig = Rig()
    rig.enable(1)
    rig.set("POS_ABS", 1000.0)
    rig.scheduler.advance(2 * SECOND)
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
    """A controller to which a script is played without a scheduler between."""

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


@settings(max_examples=60)
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


@settings(max_examples=60)
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


@settings(max_examples=60)
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
    fixed = {name for base in type(part).__mro__ for name in vars(base).get("FIXED", ())}
    assert len(part.copy_state()) == len(slots - fixed)


def test_from_event_to_event_a_controller_goes_no_further_than_it_is_asked() -> None:
    rig = programmed("DELAY 0.5\nOUT1 = ON\nDELAY 0.5\nWAIT 1 = 2\n")
    rig.start()
    device = rig.device
    due = device.deadline()
    assert due is not None
    for moment in (due - 1, due - 1, due):
        assert (device.advance_to_change(moment), device.now) == (moment, moment)
    while device.deadline() is not None:
        device.advance_to_change(2 * SECOND)
    assert (device.advance_to_change(2 * SECOND), device.now) == (2 * SECOND, 2 * SECOND)


def test_a_controller_at_rest_has_nothing_to_do() -> None:
    rig = Rig(BUSY)
    rig.enable(1, 2, 3, 4)
    rig.pin("IN8", 1)
    assert rig.device.deadline() == 10 * MILLISECOND
    rig.wait(0.01)
    assert rig.device.deadline() is None
