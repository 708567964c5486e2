"""Courses against a simulation that goes pulse by pulse."""

from __future__ import annotations

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from steptwin.machine import SECOND, Nanos
from steptwin.motion import MotionState, Profile, plan_position, plan_velocity
from steptwin.motion.divisions import Microstepping, step_train
from steptwin.world.course import Build, Course, Plan, Standing, plan_of
from steptwin.world.kernel import Kernel
from steptwin.world.mechanics import Mechanism

END = 20 * SECOND


def changes(plan: Plan, after: Nanos, until: Nanos) -> list[tuple[Nanos, int]]:
    """(moment, count) of every pulse, found by asking for the next one."""
    found = []
    now = after
    while True:
        here = plan.count(now)
        ahead = [t for c in (here - 1, here + 1) if (t := plan.pulse_time(c, now)) is not None]
        if not ahead or min(ahead) > until:
            return found
        now = min(ahead)
        found.append((now, plan.count(now)))


def pulse_by_pulse(build: Build, plan: Plan, standing: Standing, begin: Nanos, until: Nanos) -> list[tuple[Nanos, int, int]]:
    """(moment, rotor, load) after every pulse: each pushes the rotor, stops hold it, it pushes the load."""
    rotor, load = standing[:2]
    count = plan.count(begin)
    low = None if build.low is None else build.low - build.play
    way = [(begin, rotor, load)]
    for moment, new in changes(plan, begin, until):
        rotor += (new - count) * build.sign
        count = new
        if low is not None:
            rotor = max(rotor, low)
        if build.high is not None:
            rotor = min(rotor, build.high)
        load = min(max(load, rotor), rotor + build.play)
        way.append((moment, rotor, load))
    return way


def pressed(build: Build, profile: Profile, until: Nanos) -> list[tuple[Nanos, int, int]]:
    """(moment, rotor, behind) after every pulse, and at its turns and its end, for an axis with stops and no play.

    The field draws the rotor to its own place, less what was lost. A rotor that a stop keeps from there springs to the nearest
    place with the same electrical angle when the field turns or stands.
    """
    period = build.period_p

    def spring(rotor: int, behind: int, field: int) -> tuple[int, int]:
        places = [behind + n * period for n in range(-300, 301)]
        behind = min(places, key=lambda lost: (abs(field - lost - rotor), -lost))
        return held(field - behind), behind

    def held(place: int) -> int:
        return min(max(place, build.low or 0), build.high or 0)

    ends = [profile.start + int(end) for end in profile.ends if end != float("inf")]
    directions = [s.direction for s in profile.segments]
    turns = [end for end, one, other in zip(ends, directions, directions[1:], strict=False) if one != other]
    moments = [
        *((moment, True) for moment in [*turns, *ends[-1:]]),
        *((moment, False) for moment, _ in changes(profile, profile.start, until)),
    ]
    rotor, behind = 0, build.sign * profile.count(profile.start)
    way = {}
    for moment, is_turn in sorted(moments):
        field = build.sign * profile.count(moment)
        if not is_turn:
            rotor = held(field - behind)
        elif field - behind != rotor:
            rotor, behind = spring(rotor, behind, field)
        way[moment] = moment, rotor, behind
    return list(way.values())


@settings(max_examples=100, deadline=None)
@given(
    first=st.integers(-120, 120),
    second=st.integers(-120, 120),
    stops=st.tuples(st.integers(-60, -1), st.integers(1, 60)),
    period=st.sampled_from([1, 4, 16, 64]),
    sign=st.sampled_from([1, -1]),
)
@example(first=100, second=20, stops=(-10, 30), period=16, sign=1)
def test_what_is_lost_at_a_stop_is_a_whole_number_of_electrical_periods(
    first: int, second: int, stops: tuple[int, int], period: int, sign: int
) -> None:
    plan = there_and_back(first, second)
    build = Build(sign=sign, low=stops[0], high=stops[1], period_p=period)
    behind = sign * plan.count(plan.start)
    course = Course(build, plan, plan.start, Standing(0, 0, behind=behind))
    found = []
    way = pressed(build, plan, END)
    for moment, _, _ in way:
        standing = course.at(moment)
        found.append((moment, standing.rotor, standing.behind))
        assert (standing.behind - behind) % period == 0
        assert stops[0] <= standing.rotor <= stops[1]
    assert found == way
    # What comes after it is the same whether the way is taken in one course or begun again in the middle.
    middle = SECOND + (END - SECOND) // 40
    again = Course(build, plan, middle, course.at(middle))
    assert again.at(END) == course.at(END)


def test_homing_against_a_stop_ends_up_to_two_full_steps_from_it() -> None:
    """16 pulses a full step: pressed with 0 to 63 pulses more, then back by 200. Where it ends goes over a whole period."""
    ends = set()
    for more in range(64):
        build = Build(high=60, period_p=64)
        out = plan_position(MotionState(0, 0, 0.0, 0.0), 1000 + more, 4000.0, 4000.0, 1000.0)
        course = Course(build, out, 0, Standing(0, 0))
        pressed_at = course.at(10 * SECOND)
        assert 60 - 32 <= pressed_at.rotor <= 60
        back = plan_position(MotionState(10 * SECOND, 1000 + more, 0.0, 0.0), 800 + more, 4000.0, 4000.0, 1000.0)
        end = Course(build, back, 10 * SECOND, pressed_at).at(30 * SECOND)
        assert (800 + more - end.rotor) % 64 == 0
        ends.add(end.rotor)
    assert ends == set(range(60 - 200 - 32, 60 - 200 + 32))


def there_and_back(first: int, second: int) -> Profile:
    """Runs towards ``first`` and is told on the way to go to ``second``: the profile turns."""
    out = plan_position(MotionState(0, 0, 0.0, 0.0), first, 400.0, 400.0, 150.0)
    now = SECOND
    return plan_position(MotionState.of(out, now), second, 400.0, 400.0, 150.0)


@settings(max_examples=60, deadline=None)
@given(
    first=st.integers(-120, 120),
    second=st.integers(-120, 120),
    stops=st.one_of(st.none(), st.tuples(st.integers(-60, -1), st.integers(1, 60))),
    play=st.integers(0, 12),
    sign=st.sampled_from([1, -1]),
    looks=st.lists(st.integers(SECOND, END), min_size=1, max_size=8),
)
def test_rotor_and_load_are_where_a_simulation_has_them(  # noqa: PLR0917
    first: int, second: int, stops: tuple[int, int] | None, play: int, sign: int, looks: list[Nanos]
) -> None:
    plan = there_and_back(first, second)
    low, high = stops or (None, None)
    build = Build(sign=sign, zero=0, low=low, high=high, play=play)
    standing = Standing(0, 0)
    course = Course(build, plan, plan.start, standing)
    way = pulse_by_pulse(build, plan, standing, plan.start, END)
    for now in sorted(looks):
        _, rotor, load = [step for step in way if step[0] <= now][-1]
        assert course.at(now)[:2] == (rotor, load)
        # What a trace is told, in the pulses of the drive.
        _, follows, pulses = [said for said in course.carried() if said.begin <= now][-1]
        assert (pulses + (plan.count(now) if follows else 0)) * sign == load


@settings(max_examples=60, deadline=None)
@given(
    first=st.integers(-120, 120),
    second=st.integers(-120, 120),
    play=st.integers(0, 12),
    position=st.integers(-100, 100),
    direction=st.sampled_from([1, -1]),
)
def test_it_reaches_a_position_when_a_simulation_does(first: int, second: int, play: int, position: int, direction: int) -> None:
    plan = there_and_back(first, second)
    build = Build(low=-80, high=70, play=play)
    standing = Standing(0, 0)
    course = Course(build, plan, plan.start, standing)
    way = pulse_by_pulse(build, plan, standing, plan.start, END)
    if (way[0][2] - position) * direction >= 0:
        return  # there already: nobody asks
    expected = next((moment for moment, _, load in way if (load - position) * direction >= 0), None)
    assert course.reaches(position, plan.start, direction) == expected


def test_an_axis_that_is_stopped_slips_and_comes_back_at_once() -> None:
    """100 pulses against a stop at 60, then back by 30: 40 pulses are lost, and the way back begins at the stop."""
    out = plan_position(MotionState(0, 0, 0.0, 0.0), 100, 1000.0, 1000.0, 1000.0)
    build = Build(high=60)
    course = Course(build, out, 0, Standing(0, 0))
    assert course.at(10 * SECOND) == Standing(60, 60, behind=40)
    back = plan_position(MotionState(10 * SECOND, 100, 0.0, 0.0), 70, 1000.0, 1000.0, 1000.0)
    course = Course(build, back, 10 * SECOND, course.at(10 * SECOND))
    assert course.at(20 * SECOND) == Standing(30, 30, behind=40)


def test_the_division_of_an_m1486_is_seen() -> None:
    """Pulses of 64 units: the load stands on multiples of 64 only, and crosses 100 with the second."""
    profile = plan_position(MotionState(0, 0, 0.0, 0.0), 640, 10_000.0, 10_000.0, 1000.0)
    train = step_train(profile, 0, Microstepping(64, 64, 1e9))
    course = Course(Build(high=300), train, 0, Standing(0, 0))
    assert course.reaches(100, 0, 1) == train.pulse_time(128, 0)
    assert course.at(10 * SECOND).load == 300


class Motor:
    """A machine whose only axis goes where the test says."""

    def __init__(self) -> None:
        self.now = 0
        self.profile = plan_velocity(MotionState(0, 0, 0.0, 0.0), 0.0, 1.0, 1.0)
        self.revision = 0
        self.changed = lambda: None

    @property
    def axes(self) -> tuple[Motor, ...]:
        return (self,)

    def advance(self, now: Nanos) -> None:
        self.now = now

    def deadline(self) -> None:
        return None

    def set_pin(self, pin: str, value: float, now: Nanos) -> None:
        raise AssertionError(pin)

    def pins(self) -> dict[str, float]:
        return {}

    def take_edges(self) -> list:
        return []

    def go(self, target: int, now: Nanos) -> None:
        self.profile = plan_position(MotionState.of(self.profile, now), target, 500.0, 500.0, 200.0)
        self.revision += 1
        self.changed()


@settings(max_examples=40, deadline=None)
@given(
    moves=st.lists(st.tuples(st.integers(-200, 200), st.integers(1, 2 * SECOND)), min_size=1, max_size=6),
    play=st.integers(0, 9),
    stops=st.booleans(),
)
def test_a_mechanism_follows_replaced_plans_as_a_simulation_does(moves: list[tuple[int, Nanos]], play: int, stops: bool) -> None:
    kernel, motor = Kernel(), Motor()
    kernel.add("m", motor)
    build = Build(zero=5, low=-90 if stops else None, high=110 if stops else None, play=play)
    mechanism = Mechanism(kernel, "m", 1, build)
    kernel.add_part(mechanism)
    standing, now = Standing(5, 5), 0
    for target, pause in moves:
        motor.go(target, now)
        kernel.settle()
        way = pulse_by_pulse(build, plan_of(motor), standing, now, now + pause)
        now += pause
        kernel.advance(now)
        motor.advance(now)
        standing = Standing(*way[-1][1:])
        assert mechanism.at(now)[:2] == standing[:2]


def test_steps_taken_away_are_lost_until_the_end() -> None:
    kernel, motor = Kernel(), Motor()
    kernel.add("m", motor)
    mechanism = Mechanism(kernel, "m", 1, Build())
    kernel.add_part(mechanism)
    motor.go(100, 0)
    kernel.advance(20 * SECOND)
    mechanism.lose(7, 20 * SECOND)
    assert (mechanism.place(20 * SECOND), mechanism.lost(20 * SECOND)) == (93, 7)
    mechanism.block(True, 20 * SECOND)
    motor.go(150, 20 * SECOND)
    kernel.advance(40 * SECOND)
    assert (mechanism.place(40 * SECOND), mechanism.lost(40 * SECOND)) == (93, 57)
    mechanism.block(False, 40 * SECOND)
    motor.go(100, 40 * SECOND)
    kernel.advance(60 * SECOND)
    assert mechanism.place(60 * SECOND) == pytest.approx(43)
