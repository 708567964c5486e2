"""Zones of switches, and contacts that bounce."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from math import floor

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from mic488_rig import controller
from pulse_by_pulse import changes
from toy import ToyAxis

from steptwin.controller import MILLISECOND, SECOND, PinEdge
from steptwin.errors import Misuse
from steptwin.mic488.config import AxisConfig
from steptwin.mic488.device import Mic488Device
from steptwin.motion import MotionState, Profile, plan_position
from steptwin.motion.profile import cruise
from steptwin.simulation.logic.contacts import Button, Circuit, CountedPosition, Switch, Zone
from steptwin.simulation.scheduler.chance import Chance
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.scheduler.wires import PinName

LIMITS = st.one_of(st.none(), st.integers(-30, 30))


def zones() -> st.SearchStrategy[Zone]:
    def made(low: int | None, width: int | None, hysteresis: int, repeated: bool) -> Zone:
        high = None if width is None or low is None else low + width
        fraction = Fraction(sum(ord(c) for c in f"{low}{width}") % 7, 7)
        period = None if not repeated or low is None or high is None else high - low + 2 * hysteresis + 2 + fraction
        return Zone(low, high, hysteresis, period)

    return st.builds(made, LIMITS, st.one_of(st.none(), st.integers(0, 12)), st.integers(0, 4), st.booleans())


@given(zone=zones(), steps=st.lists(st.sampled_from([1, -1]), min_size=30, max_size=120), start=st.integers(-40, 40))
def test_the_predicted_edge_is_where_the_state_changes(zone: Zone, steps: list[int], start: int) -> None:
    """Pulse by pulse: the state changes exactly at the position that was predicted for that direction."""
    on = zone.on(start, was_on=False)
    below, above = zone.edges(start, is_on=on)
    place = start
    for step in steps:
        place += step
        now_on = zone.on(place, was_on=on)
        assert (now_on is not on) is (place == (above if step > 0 else below))
        if now_on is not on:
            on = now_on
        below, above = zone.edges(place, is_on=on)


@given(
    low=st.integers(-50, 50),
    width=st.integers(0, 5),
    period=st.fractions(10, 30, max_denominator=9),
    place=st.integers(-3000, 3000),
)
@example(low=0, width=0, period=Fraction(95, 9), place=11)  # of 10.56, and not 10
@example(low=0, width=0, period=Fraction(21, 2), place=11)  # of 10.5
@example(low=0, width=0, period=Fraction(94, 9), place=10)  # of 10.44
def test_a_repeated_zone_is_at_every_turn_to_the_nearest_pulse(low: int, width: int, period: Fraction, place: int) -> None:
    """Against every turn that can reach ``place``: nothing adds up over thousands of turns."""
    zone = Zone(low, low + width, 0, period)
    shifts = [floor(turn * period + Fraction(1, 2)) for turn in range(-400, 401)]
    assert zone.on(place, was_on=False) is any(low + shift <= place <= low + width + shift for shift in shifts)


@pytest.mark.parametrize("in_series", [False, True])
def test_contacts_of_one_input_are_joined(in_series: bool) -> None:
    """Two buttons, one of them NC: an input has what its contacts give it together, and only its changes are edges."""
    edges: list[TraceRecord] = []
    scheduler = Scheduler(record=edges.append)
    device = Mic488Device(controller())
    scheduler.add("m", device)
    circuit = Circuit(scheduler, PinName("m", "IN3"), in_series=in_series)
    buttons = [
        Button(circuit, normally_closed=closed, bounce_ns=0, bounces=0, chance=Chance(0, "b"), channel=f"b{closed:d}")
        for closed in (False, True)
    ]
    for button in buttons:
        button.rest_at(button.normally_closed)
        scheduler.add_part(button)
    circuit.close()
    for now, (which, pressed) in enumerate([(0, True), (1, True), (0, False), (1, False), (0, True), (0, False)], start=1):
        scheduler.advance(now)
        buttons[which].press(pressed, now)
        scheduler.propagate()
        closed = [buttons[0].pressed, not buttons[1].pressed]
        assert device.pins()["IN3"] == float(all(closed) if in_series else any(closed))
    levels = [record.value for record in edges if record.subject == "IN3"]
    assert all(before != after for before, after in pairwise(levels)), "an edge where nothing changes"
    assert [record.value for record in edges if record.subject == "b0"] == [0.0, 1.0, 0.0, 1.0, 0.0]


def test_hysteresis_keeps_a_switch_on() -> None:
    zone = Zone(10, 20, 3)
    assert [zone.on(p, was_on=False) for p in (9, 10, 20, 21)] == [False, True, True, False]
    assert [zone.on(p, was_on=True) for p in (6, 7, 23, 24)] == [False, True, True, False]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((5, 4), "low 5 imp is above high 4 imp"),
        ((0, 1, -1), "hysteresis of -1"),
        ((0, 9, 0, 10), "zone of 10 imp, hysteresis included, repeats every 10 imp: it must be shorter"),
        ((0, 5, 2, 10), "zone of 10 imp, hysteresis included"),
        ((0, None, 0, 10), "needs both limits"),
    ],
)
def test_zones_that_cannot_be_are_misuse(arguments: tuple, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        Zone(*arguments)


def test_a_bouncing_switch_comes_to_rest_within_its_time_and_the_same_way_again() -> None:
    def run(seed: int) -> list[tuple[int, float]]:
        edges: list[TraceRecord] = []
        scheduler = Scheduler(record=edges.append)
        device = Mic488Device(controller(AxisConfig(acc=1e4, vel=1e4)))
        scheduler.add("m", device)
        circuit = Circuit(scheduler, PinName("m", "IN1"))
        chance = Chance(seed, "x")
        scheduler.add_part(
            Switch(circuit, CountedPosition(device.axes[0]), Zone(100, None), 0, bounce_ns=MILLISECOND, bounces=3, chance=chance)
        )
        circuit.close()
        device.execute(bytes.fromhex("06 271E 0001"), 0)
        device.execute(bytes.fromhex("10 2764 0002 04 0000 4348"), 0)  # POS_ABS M1 = 200
        scheduler.advance(SECOND)
        return [(r.time, float(r.value)) for r in edges if r.subject == "IN1"][1:]  # type: ignore[arg-type]

    first = run(1)
    assert len(first) == 7
    assert [level for _, level in first] == [1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0]
    assert first[-1][0] - first[0][0] <= MILLISECOND
    assert run(1) == first
    assert run(2) != first
    assert run(2)[0] == first[0]


def test_a_normally_closed_button_opens_when_it_is_pressed() -> None:
    scheduler = Scheduler()
    device = Mic488Device(controller())
    scheduler.add("m", device)
    seen: list[PinEdge] = []
    scheduler.edge_subscribers.append(lambda name, edge: seen.append(edge))
    circuit = Circuit(scheduler, PinName("m", "IN3"))
    button = Button(circuit, normally_closed=True, bounce_ns=0, bounces=0, chance=Chance(0, "b"))
    button.rest_at(True)
    circuit.close()
    scheduler.add_part(button)
    assert (device.pins()["IN3"], button.pressed) == (1.0, False)
    button.press(True, 0)
    assert (device.pins()["IN3"], button.pressed) == (0.0, True)


@pytest.mark.parametrize(("bounces", "levels"), [(0, [1.0]), (1, [1.0, 0.0, 1.0]), (2, [1.0, 0.0, 1.0, 0.0, 1.0])])
def test_a_contact_bounces_so_often(bounces: int, levels: list[float]) -> None:
    edges: list[TraceRecord] = []
    scheduler = Scheduler(record=edges.append)
    scheduler.add("m", Mic488Device(controller()))
    circuit = Circuit(scheduler, PinName("m", "IN3"))
    button = Button(circuit, normally_closed=False, bounce_ns=MILLISECOND, bounces=bounces, chance=Chance(0, "b"))
    scheduler.add_part(button)
    circuit.close()
    scheduler.advance(SECOND)
    edges.clear()
    button.press(True, SECOND)
    scheduler.propagate()
    scheduler.advance(SECOND + MILLISECOND)
    assert [record.value for record in edges if record.subject == "IN3"] == levels


def test_the_bouncing_of_a_contact_that_changes_nothing_for_its_input_is_awaited_all_the_same() -> None:
    """Beside a closed contact: the input stays 1, and the channel of the contact shows it."""
    edges: list[TraceRecord] = []
    scheduler = Scheduler(record=edges.append)
    device = Mic488Device(controller())
    scheduler.add("m", device)
    circuit = Circuit(scheduler, PinName("m", "IN3"))
    closed, bouncing = (
        Button(circuit, normally_closed=nc, bounce_ns=MILLISECOND, bounces=2, chance=Chance(0, "b"), channel=channel)
        for nc, channel in ((True, "closed"), (False, "bouncing"))
    )
    for button in (closed, bouncing):
        scheduler.add_part(button)
    circuit.close()
    scheduler.advance(SECOND)
    assert scheduler.deadline() is None
    bouncing.press(True, SECOND)
    due = scheduler.deadline()
    assert due is not None
    assert SECOND < due <= SECOND + MILLISECOND
    scheduler.advance(SECOND + MILLISECOND)
    assert [record.value for record in edges if record.subject == "bouncing"] == [1.0, 0.0, 1.0, 0.0, 1.0]
    assert [record.value for record in edges if record.subject == "IN3"] == [1.0]
    assert (scheduler.deadline(), device.pins()["IN3"], bouncing.pressed, closed.pressed) == (None, 1.0, True, False)


def test_the_level_of_an_input_is_that_of_its_contacts_at_rest_and_of_the_switch_where_it_is() -> None:
    """A switch that is on where it is put: NO gives 1, NC 0; without a change nothing bounces."""
    scheduler = Scheduler()
    scheduler.add("m", Mic488Device(controller()))
    drive = scheduler.drive_of("m", 1)
    for pin, normally_closed, level in (("IN1", False, 1.0), ("IN2", True, 0.0)):
        circuit = Circuit(scheduler, PinName("m", pin))
        switch = Switch(
            circuit, CountedPosition(drive), Zone(-5, 5), 0, normally_closed=normally_closed, bounce_ns=MILLISECOND, bounces=2
        )
        scheduler.add_part(switch)
        circuit.close()
        scheduler.propagate()
        assert (scheduler.controllers["m"].pins()[pin], switch.on, switch.deadline()) == (level, True, None)


@given(
    targets=st.lists(st.integers(-25, 25), min_size=1, max_size=3),
    position=st.integers(-27, 27),
    direction=st.sampled_from([1, -1]),
    asked=st.floats(0.0, 1.2),
)
def test_a_counted_position_is_reached_where_its_pulses_lead(
    targets: list[int], position: int, direction: int, asked: float
) -> None:
    """Against all pulses, one after the other; a new target while it moves turns it round."""
    axis = ToyAxis()
    now = 0
    for target in targets:
        state = MotionState.of(axis.plan, now)
        axis.follow(plan_position(state, target, 500.0, 400.0, 100.0))
        now += SECOND // 7
    plan = axis.plan
    assert isinstance(plan, Profile)
    assert plan.end is not None
    after = plan.start + int((plan.end - plan.start) * asked)
    count = plan.count(after)
    expected = None
    for moment, new in changes(plan, after, plan.end):
        if new - count == direction and (new - position) * direction >= 0 and (count - position) * direction < 0:
            expected = moment
            break
        count = new
    assert CountedPosition(axis).reaches(position, after, direction) == expected


def test_a_place_where_a_way_begins_is_reached_when_it_is_come_to_again() -> None:
    """From 0 up to 10, down to -10 and up to 10: 0 is come to upwards once, at 4 s."""
    axis = ToyAxis()
    ways = ((0.0, 1.0, 0.0, 1), (1.0, 3.0, 10.0, -1), (3.0, 5.0, -10.0, 1))
    axis.follow(Profile(0, 0, tuple(cruise(begin, end, p, 10.0 * way) for begin, end, p, way in ways), 10.0))
    assert CountedPosition(axis).reaches(0, 0, 1) == pytest.approx(4 * SECOND, abs=2)
    assert CountedPosition(axis).reaches(0, 0, -1) == pytest.approx(2 * SECOND, abs=2)
    assert CountedPosition(axis).reaches(10, SECOND, 1) == pytest.approx(5 * SECOND, abs=2)


def test_a_switch_whose_carriage_does_as_before_asks_it_nothing() -> None:
    class Counted:
        """Stands; counts how often it is asked."""

        def __init__(self) -> None:
            self.asked = 0
            self.plan = 1

        def version(self) -> object:
            return self.plan

        def grid_position(self, now: int) -> int:
            self.asked += 1
            return 0

        def reaches(self, position: int, after: int, direction: int) -> None:
            return None

    scheduler, carriage = Scheduler(), Counted()
    scheduler.add("m", Mic488Device(controller()))
    switch = Switch(Circuit(scheduler, PinName("m", "IN3")), carriage, Zone(5, 9), 0)
    switch.update(0)
    asked = carriage.asked
    for now in (1, 2, 3):
        switch.update(now)
    assert carriage.asked == asked
    carriage.plan = 2
    switch.update(4)
    assert carriage.asked == asked + 1
    switch.set_state(switch.copy_state())
    switch.update(5)
    assert carriage.asked == asked + 1
    carriage.plan = 3
    switch.update(6)
    assert carriage.asked == asked + 2
