"""Machines connected by wires and position switches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mic488_rig import Rig, controller
from toy import Bare, ToyAxis

from steptwin.controller import MILLISECOND, SECOND, Nanos, PinEdge
from steptwin.errors import Misuse, Runaway, TimeReversal
from steptwin.mic488.config import AxisConfig, ControllerConfig
from steptwin.mic488.device import Mic488Device
from steptwin.motion import MotionState, Profile, at_rest, plan_position, plan_velocity
from steptwin.simulation.logic.contacts import PositionSwitch, place
from steptwin.simulation.scheduler.scheduler import MAX_ROUNDS_PER_INSTANT, Scheduler
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.scheduler.wires import PinName, Wire

ENABLE_M1 = bytes.fromhex("06 271E 0001")
REAL_1000 = "0000 447A"
RUN_M1 = bytes.fromhex("10 2754 0002 04" + REAL_1000)
"""VEL_ABS = 1000 imp/s; with ACC 1000 the axis is at 500 after a second."""


class Relay(Bare):
    """Gives the inverse of its input A on its output B after a time, which may be 0. It has one axis."""

    FIXED: ClassVar[tuple[str, ...]] = ("delay",)
    __slots__ = (*FIXED, "axis", "coming", "levels")

    def __init__(self, delay: Nanos = 0) -> None:
        super().__init__()
        self.delay = delay
        self.levels = {"A": 0.0, "B": 1.0}
        self.coming: list[tuple[Nanos, float]] = []
        self.axis = ToyAxis()

    @property
    def axes(self) -> tuple[ToyAxis]:
        return (self.axis,)

    def advance(self, now: Nanos) -> None:
        super().advance(now)
        while self.coming and self.coming[0][0] <= now:
            self._put(*self.coming.pop(0))

    def deadline(self) -> Nanos | None:
        return self.coming[0][0] if self.coming else None

    def set_pin(self, pin: str, value: float, now: Nanos) -> None:
        self.advance(now)
        if pin != "A":
            raise Misuse(f"{pin} is no input")
        self.levels["A"] = value
        if self.delay:
            self.coming.append((now + self.delay, 1.0 - value))
        else:
            self._put(now, 1.0 - value)
        self.changed()

    def _put(self, now: Nanos, value: float) -> None:
        if self.levels["B"] != value:
            self.levels["B"] = value
            self.edges.append(PinEdge(now, "B", value))
            self.changed()

    def pins(self) -> Mapping[str, float]:
        return dict(self.levels)

    def pin(self, name: str) -> float:
        return self.levels[name]

    def follow(self, profile: Profile) -> None:
        self.axis.follow(profile)
        self.changed()


def wire(source: str, target: str, *, inverted: bool = False) -> Wire:
    (one, output), (other, input_) = source.split("."), target.split(".")
    return Wire(PinName(one, output), PinName(other, input_), inverted)


def two_controllers() -> tuple[Scheduler, Mic488Device, Mic488Device]:
    scheduler = Scheduler()
    one, other = Mic488Device(ControllerConfig()), Mic488Device(controller(AxisConfig(limit_mode=2, in_kr=0)))
    scheduler.add("one", one)
    scheduler.add("other", other)
    return scheduler, one, other


# ---------------------------------------------------------------------- wires


def test_an_output_drives_an_input_at_the_same_moment() -> None:
    scheduler, one, other = two_controllers()
    scheduler.connect(wire("one.OUT3", "other.IN1"))
    other.execute(ENABLE_M1, 0)
    other.execute(RUN_M1, 0)
    scheduler.advance(SECOND)
    one.execute(bytes.fromhex("05 1772 FF00"), SECOND)
    scheduler.advance(SECOND)
    assert other.pins()["IN1"] == 1.0
    assert other.axes[0].status == 10  # its limit switch, before the filter
    assert other.axes[0].coordinate_p(SECOND) == 500
    scheduler.advance(SECOND + 10 * MILLISECOND)
    assert other.inputs.filtered[0] is True


def test_a_wire_carries_the_level_there_is_when_it_is_connected() -> None:
    scheduler, one, other = two_controllers()
    one.execute(bytes.fromhex("05 1770 FF00"), 0)
    scheduler.connect(wire("one.OUT1", "other.IN5"))
    scheduler.connect(wire("one.OUT2", "other.IN6", inverted=True))
    assert (other.pins()["IN5"], other.pins()["IN6"]) == (1.0, 1.0)
    one.execute(bytes.fromhex("05 1771 FF00"), 0)
    scheduler.propagate()
    assert other.pins()["IN6"] == 0.0


def test_an_output_may_drive_several_inputs_and_its_own_controller() -> None:
    scheduler, one, other = two_controllers()
    for target in ("other.IN1", "other.IN2", "one.IN7"):
        scheduler.connect(wire("one.M1_EN", target))
    one.execute(ENABLE_M1, 0)
    scheduler.advance(0)
    assert (other.pins()["IN1"], other.pins()["IN2"], one.pins()["IN7"]) == (1.0, 1.0, 1.0)


def test_edges_travel_along_a_chain_with_the_delays_of_its_controllers() -> None:
    scheduler = Scheduler()
    relays = [Relay(3 * MILLISECOND), Relay(), Relay(4 * MILLISECOND)]
    seen: list[tuple[str, PinEdge]] = []
    for number, relay in enumerate(relays):
        scheduler.add(f"r{number}", relay)
    scheduler.connect(wire("r0.B", "r1.A"))
    scheduler.connect(wire("r1.B", "r2.A"))
    scheduler.advance(10 * MILLISECOND)
    scheduler.edge_subscribers.append(lambda name, edge: seen.append((name, edge)))
    relays[0].set_pin("A", 1.0, 10 * MILLISECOND)
    assert scheduler.deadline() == 13 * MILLISECOND
    scheduler.advance(SECOND)
    assert seen == [
        ("r0", PinEdge(13 * MILLISECOND, "B", 0.0)),
        ("r1", PinEdge(13 * MILLISECOND, "B", 1.0)),
        ("r2", PinEdge(17 * MILLISECOND, "B", 0.0)),
    ]
    assert scheduler.deadline() is None


def test_a_loop_of_wires_that_never_settles_is_a_runaway() -> None:
    scheduler = Scheduler()
    scheduler.add("r", Relay())
    scheduler.advance(5)
    scheduler.connect(wire("r.B", "r.A"))
    with pytest.raises(Runaway, match=f"did not settle after {MAX_ROUNDS_PER_INSTANT} rounds at 5 ns: a loop of wires"):
        scheduler.advance(6)


def test_a_loop_with_a_delay_oscillates() -> None:
    scheduler = Scheduler()
    scheduler.add("r", Relay(MILLISECOND))
    seen: list[Nanos] = []
    scheduler.edge_subscribers.append(lambda name, edge: seen.append(edge.time))
    scheduler.connect(wire("r.B", "r.A"))
    scheduler.advance(5 * MILLISECOND)
    assert seen == [n * MILLISECOND for n in range(1, 6)]


# ---------------------------------------------------------------------- time


def test_time_cannot_go_back() -> None:
    scheduler = Scheduler(100)
    with pytest.raises(TimeReversal) as caught:
        scheduler.advance(99)
    assert caught.value.args == TimeReversal(100, 99).args


def test_a_controller_joins_at_the_time_of_the_scheduler() -> None:
    scheduler = Scheduler(SECOND)
    late, early = Mic488Device(ControllerConfig()), Mic488Device(ControllerConfig())
    scheduler.add("late", late)
    assert late.now == SECOND
    early.advance(2 * SECOND)
    with pytest.raises(TimeReversal):
        scheduler.add("early", early)
    assert list(scheduler.controllers) == ["late"]


def test_the_deadline_is_the_earliest_of_all() -> None:
    scheduler = Scheduler()
    relays = [Relay(5), Relay(3), Relay(9)]
    for number, relay in enumerate(relays):
        scheduler.add(str(number), relay)
    assert scheduler.deadline() is None
    for relay in relays:
        relay.set_pin("A", 1.0, 0)
    assert scheduler.is_dirty
    deadlines = []
    while (due := scheduler.deadline()) is not None:
        assert not scheduler.is_dirty
        deadlines.append(due)
        scheduler.advance(due)
    assert deadlines == [3, 5, 9]


def test_a_controller_takes_the_place_of_another_with_what_it_has_to_do() -> None:
    scheduler = Scheduler()
    scheduler.add("a", Relay())
    scheduler.add("b", Relay())
    assert scheduler.deadline() is None
    relay = Relay(5)
    relay.set_pin("A", 1.0, 0)
    scheduler.replace("a", relay)
    assert scheduler.deadline() == 5
    scheduler.advance(5)
    relay.set_pin("A", 0.0, 5)
    assert scheduler.deadline() == 10


def test_ties_are_broken_by_the_order_of_joining() -> None:
    scheduler = Scheduler()
    seen: list[str] = []
    scheduler.edge_subscribers.append(lambda name, edge: seen.append(name))
    relays = {name: Relay(7) for name in ("b", "c", "a")}
    for name, relay in relays.items():
        scheduler.add(name, relay)
    for name in ("a", "b", "c"):
        relays[name].set_pin("A", 1.0, 0)
    scheduler.advance(7)
    assert seen == ["b", "c", "a"]


# ---------------------------------------------------------------------- switches


def on_axis(low: int | None, high: int | None, *, normally_closed: bool = False) -> tuple[Scheduler, Relay]:
    scheduler = Scheduler()
    relay = Relay()
    scheduler.add("r", relay)
    place(scheduler, PositionSwitch("r", 1, low, high, PinName("r", "A"), normally_closed))
    return scheduler, relay


@pytest.mark.parametrize(
    ("low", "high", "on"),
    [(None, 0, True), (0, None, True), (-1, 1, True), (0, 0, True), (1, None, False), (None, -1, False), (None, None, True)],
)
@pytest.mark.parametrize("normally_closed", [False, True])
def test_a_switch_has_its_state_at_once(low: int | None, high: int | None, on: bool, normally_closed: bool) -> None:
    _, relay = on_axis(low, high, normally_closed=normally_closed)
    assert relay.levels["A"] == float(on is not normally_closed)


def test_a_switch_is_crossed_at_the_moment_of_the_pulse_in_both_directions() -> None:
    """1000 p/s² to 1000 p/s and back: pulse 100 comes √0.2 s after the start."""
    scheduler, relay = on_axis(100, 200)
    seen: list[PinEdge] = []
    scheduler.edge_subscribers.append(lambda name, edge: seen.append(edge))
    relay.follow(plan_position(MotionState(0, 0, 0.0, 0.0), 1000, 1000.0, 1000.0, 1000.0))
    scheduler.advance(3 * SECOND)
    back = plan_position(MotionState(3 * SECOND, 1000, 0.0, 0.0), 150, 1000.0, 1000.0, 1000.0)
    relay.follow(back)
    scheduler.advance(10 * SECOND)
    first = plan_position(MotionState(0, 0, 0.0, 0.0), 1000, 1000.0, 1000.0, 1000.0)
    on, off, again = first.pulse_time(100, 0), first.pulse_time(201, 0), back.pulse_time(200, 0)
    assert on == pytest.approx(0.2**0.5 * SECOND, abs=1)
    assert [(edge.time, edge.value) for edge in seen] == [(on, 0.0), (off, 1.0), (again, 0.0)]


def test_a_switch_follows_a_profile_that_is_replaced_before_it_gets_there() -> None:
    scheduler, relay = on_axis(500, None)
    relay.follow(plan_velocity(MotionState(0, 0, 0.0, 0.0), 1000.0, 1000.0, 1000.0))
    assert scheduler.deadline() == SECOND
    scheduler.advance(SECOND - 1)
    relay.follow(at_rest(SECOND - 1, 499))
    assert scheduler.deadline() is None
    scheduler.advance(5 * SECOND)
    assert relay.levels["A"] == 0.0


def test_a_turn_on_the_edge_of_a_switch_is_seen() -> None:
    scheduler, relay = on_axis(100, None)
    relay.follow(plan_position(MotionState(0, 0, 0.0, 0.0), 100, 1000.0, 1000.0, 1000.0))
    scheduler.advance(SECOND)
    assert relay.levels["A"] == 1.0
    relay.follow(plan_position(MotionState(SECOND, 100, 0.0, 0.0), 99, 1000.0, 1000.0, 1000.0))
    scheduler.advance(2 * SECOND)
    assert relay.levels["A"] == 0.0


def test_a_switch_stays_with_its_axis_through_a_power_cycle() -> None:
    rig = Rig()
    rig.switch(1, 400, None, "IN4")
    rig.enable(1)
    rig.set("POS_ABS", 300.0)
    rig.until(1, 4)
    rig.device.power_cycle(rig.now)
    rig.enable(1)
    assert rig.position() == 0.0
    rig.set("POS_ABS", 99.0)
    rig.until(1, 4)
    assert rig.pins()["IN4"] == 0.0
    rig.set("POS_ABS", 100.0)
    rig.until(1, 4)
    assert rig.pins()["IN4"] == 1.0


@settings(max_examples=60)
@given(
    switches=st.lists(st.tuples(st.integers(-300, 300), st.integers(0, 200)), min_size=1, max_size=3),
    moves=st.lists(st.tuples(st.integers(-500, 500), st.lists(st.integers(0, SECOND // 2), max_size=4)), max_size=8),
)
def test_switches_show_where_the_axis_is_at_any_moment(
    switches: list[tuple[int, int]], moves: list[tuple[int, list[Nanos]]]
) -> None:
    rig = Rig()
    for number, (low, width) in enumerate(switches, start=1):
        rig.switch(1, low, low + width, f"IN{number}")
    rig.enable(1)
    axis = rig.device.axes[0]
    for target, pauses in moves:
        rig.set("POS_ABS", target)
        for pause in pauses:
            rig.wait_ns(pause)
            count = axis.profile.count(rig.now)
            for number, (low, width) in enumerate(switches, start=1):
                assert rig.pins()[f"IN{number}"] == float(low <= count <= low + width)


# ---------------------------------------------------------------------- misuse


@pytest.mark.parametrize(
    ("source", "target", "message"),
    [
        ("one.OUT9", "other.IN1", "'one' has no pin 'OUT9': pins are IN1, IN2"),
        ("one.OUT1", "third.IN1", "no controller 'third': there are one, other"),
        ("one.OUT1", "other.OUT1", "no input pin 'OUT1': inputs are IN1 to IN20"),
    ],
)
def test_wires_between_what_is_not_there_are_misuse(source: str, target: str, message: str) -> None:
    scheduler, one, other = two_controllers()
    with pytest.raises(Misuse, match=message):
        scheduler.connect(wire(source, target))
    one.execute(bytes.fromhex("05 1770 FF00"), 0)
    scheduler.advance(SECOND)
    assert other.pins()["IN1"] == 0.0


@pytest.mark.parametrize(
    ("controller", "axis", "pin", "message"),
    [
        ("one", 5, "IN1", "no axis 5 of 'one', which has 4 axes"),
        ("one", 0, "IN1", "no axis 0 of 'one', which has 4 axes"),
        ("third", 1, "IN1", "no axis 1 of 'third', which has 0 axes"),
        ("one", 1, "IN21", "'one' has no pin 'IN21'"),
        ("one", 1, "OUT1", "no input pin 'OUT1'"),
    ],
)
def test_switches_where_nothing_is_are_misuse(controller: str, axis: int, pin: str, message: str) -> None:
    scheduler, _, _ = two_controllers()
    with pytest.raises(Misuse, match=message):
        place(scheduler, PositionSwitch(controller, axis, None, 10, PinName("one", pin)))
    scheduler.advance(SECOND)


def test_a_switch_turned_inside_out_is_misuse() -> None:
    with pytest.raises(Misuse, match=r"switch on m\.IN1: low 5 imp is above high 4 imp"):
        PositionSwitch("m", 1, 5, 4, PinName("m", "IN1"))


def test_names_are_given_once() -> None:
    scheduler, one, _ = two_controllers()
    with pytest.raises(Misuse, match="there is a controller 'one' already"):
        scheduler.add("one", one)


def test_a_scheduler_in_which_nothing_has_changed_is_settled() -> None:
    scheduler = Scheduler()
    assert not scheduler.is_dirty
    assert scheduler.deadline() is None
    with pytest.raises(Misuse, match="no controller 'x': there are none"):
        scheduler.replace("x", Relay())
    scheduler.add("a", Relay())
    with pytest.raises(Misuse, match="no controller 'x': there are a"):
        scheduler.replace("x", Relay())
    with pytest.raises(Misuse, match=r"wire to a\.A: a delay of -1 ns is negative"):
        Wire(PinName("a", "B"), PinName("a", "A"), delay=-1)


def test_each_event_is_told_with_its_scheduler() -> None:
    """Of a machine alone, of joined ones, and changes from outside."""
    told: list[tuple[Scheduler, Nanos]] = []
    alone, joined = Scheduler(), Scheduler()
    alone.add("a", Relay(10))
    for name in ("a", "b"):
        joined.add(name, Relay(10))
    joined.connect(wire("a.B", "b.A"))
    for scheduler in (alone, joined):
        scheduler.propagate()
        scheduler.on_change = lambda one: told.append((one, one.now))
        scheduler.controllers["a"].set_pin("A", 1.0, scheduler.now)
        assert told == [(scheduler, scheduler.now)]
        told.clear()
        scheduler.propagate()
        assert told == [(scheduler, 0)]
        told.clear()
        scheduler.advance(15)
        assert (scheduler, 10) in told
        told.clear()
        scheduler.advance(16)
        assert told == []
        scheduler.advance(40)
        assert bool(told) is (scheduler is joined)
        told.clear()


def test_a_controller_that_says_nothing_of_its_edges_is_looked_at() -> None:
    class Silent(Relay):
        """Its hook is not called by itself."""

        __slots__ = ()

        def advance(self, now: Nanos) -> None:
            hook, self.changed = self.changed, lambda: None
            super().advance(now)
            self.changed = hook

    scheduler = Scheduler()
    scheduler.add("loud", Relay(10))
    scheduler.add("a", Silent(10))
    scheduler.add("b", Relay(5))
    scheduler.connect(wire("a.B", "b.A"))
    scheduler.propagate()
    for name in ("loud", "a"):
        scheduler.controllers[name].set_pin("A", 1.0, 0)
    scheduler.advance(30)
    assert [scheduler.controllers[name].pin("B") for name in ("a", "b")] == [0.0, 1.0]


def test_an_input_that_its_controller_changes_is_recorded_once_and_so_is_what_drives_it_then() -> None:
    found: list[TraceRecord] = []
    scheduler, relay, target = Scheduler(record=found.append), Relay(), PinName("a", "A")
    scheduler.add("a", relay)
    scheduler.drive(target, 1.0)
    scheduler.advance(5)
    relay.levels["A"] = 0.0
    relay.edges.append(PinEdge(5, "A", 0.0))
    relay.changed()
    scheduler.advance(7)
    for level in (0.0, 1.0):
        scheduler.drive(target, level)
        scheduler.advance(7)
    assert [(record.time, record.value) for record in found if record.subject == "A"] == [(0, 1.0), (5, 0.0), (7, 1.0)]


def test_a_snapshot_has_what_a_change_leads_to() -> None:
    scheduler = Scheduler()
    for name in ("a", "b"):
        scheduler.add(name, Relay())
    scheduler.connect(wire("a.B", "b.A"))
    scheduler.propagate()
    scheduler.controllers["a"].set_pin("A", 1.0, 0)
    assert scheduler.snapshot().levels == {PinName("b", "A"): 0.0}


def test_who_looks_at_each_event_is_told_of_each() -> None:
    """Of a machine alone, whose changes without an event matter; it does not tell of its own."""
    told: list[Nanos] = []
    scheduler, relay = Scheduler(), Relay(10)
    scheduler.add("a", relay)
    scheduler.is_step_exact = True
    for moment, level in ((0, 1.0), (5, 0.0)):
        scheduler.advance(moment)
        relay.set_pin("A", level, moment)
    scheduler.propagate()
    relay.changed = lambda: None
    scheduler.on_change = lambda one: told.append(one.now)
    scheduler.advance(40)
    assert [*dict.fromkeys(told)] == [10, 15]
