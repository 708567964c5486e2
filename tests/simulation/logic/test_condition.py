from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from math import inf, nextafter

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.motion import MotionState, plan_position
from steptwin.simulation.logic.condition import Border, SignalCondition, crossing
from steptwin.simulation.logic.expression import parse_condition
from steptwin.simulation.logic.signal import SignalOf


class Level:
    unit = ""

    def __init__(self, value: float) -> None:
        self.level = value
        self.continuous = False

    def sync(self, now: Nanos) -> tuple[object, ...]:
        return (self,)

    def value(self, now: Nanos) -> float:
        return self.level

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        return iter(())

    def version(self) -> object:
        return None


def test_what_signals_are_is_told_of_the_first_of_many() -> None:
    levels = {f"x{n}": Level(n / 3) for n in range(8)}
    levels["x1"].unit = "mm"
    told = SignalCondition(" or ".join(f"{name} > 9" for name in levels), levels.__getitem__).told(0).partition("; ")[2]
    assert told == "x0 is 0, x1 is 0.333333333 mm, x2 is 0.666666667, x3 is 1, x4 is 1.33333333, x5 is 1.66666667 and 2 more"


class Moving:
    """The count or velocity of a profile that goes there and back."""

    continuous = True
    unit = "mm"

    def __init__(self, *, velocity: bool = False, first: int = 100, then: int = -40) -> None:
        out = plan_position(MotionState(0, 0, 0.0, 0.0), first, 200.0, 300.0, 80.0)
        self.profile = plan_position(MotionState.of(out, SECOND // 2), then, 200.0, 300.0, 80.0)
        self.velocity = velocity

    def sync(self, now: Nanos) -> tuple[object, ...]:
        return (self,)

    def value(self, now: Nanos) -> float:
        return self.profile.velocity(now) if self.velocity else float(self.profile.count(now))

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        return (self.profile.start + int(end) for end in self.profile.ends if self.profile.start + end > now)

    def version(self) -> object:
        return self.profile


SIGNALS = {
    "a": Level(1.0),
    "b": Level(0.0),
    "m.M1.position": Level(42.0),
    "not_in_any_unit": Level(0.0),
    "x.position": Moving(),
    "x.velocity": Moving(velocity=True),
}


@pytest.mark.parametrize(
    ("text", "truth"),
    [
        ("a", True),
        ("b", False),
        ("not b", True),
        ("a and b", False),
        ("a or b and b", True),
        ("(a or b) and b", False),
        ("m.M1.position == 42", True),
        ("m.M1.position >= 42.0 and m.M1.position<=42", True),
        ("-1 < b", True),
        ("m.M1.position > -4.2e1", True),
        ("a != b", True),
        ("NOT b AND a", True),
        ("b < .5 and " + "(" * 64 + "a" + ")" * 64, True),
        (" and ".join(["not not (a)"] * 100), True),
    ],
)
def test_conditions(text: str, truth: bool) -> None:
    assert SignalCondition(text, SIGNALS.__getitem__).holds(0) is truth


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "ends too early: expected a signal or a number"),
        ("a and", "ends too early: expected a signal or a number"),
        ("a b", "column 3: found 'b', expected the end, 'and' or 'or'"),
        ("(a", r"ends too early: expected '\)'"),
        ("3", "expected one of == != <= >= < >"),
        ("a = = 3", "column 5: found '=', expected a signal or a number"),
        ("(a > 0) + 1", "ends too early: expected one of == != <= >= < >"),
        ("a" * 20_001, "has 20001 characters: permitted are 20000"),
        (" " * 20_000, "ends too early: expected a signal or a number"),
        ("a-" * 10_000, r"there are more than 200 of \+ - \* /"),
        ("a + 3", "ends too early: expected one of == != <= >= < >"),
        ("a + 3 and b", "found 'and', expected one of == != <= >= < >"),
        ("a > 3 +", "ends too early: expected a signal or a number"),
        ("abs(a > 3", "found '>', expected '\\)'"),
        ("__import__('os')", r"found '\(', expected"),
        ("not", "ends too early"),
        ("a < and", "found 'and', expected a signal or a number"),
        ("- a", "ends too early: expected one of"),
        ("not " * 3000 + "a", "'not' and parentheses are nested more than 64 deep"),
        ("(" * 3000 + "a" + ")" * 3000, "'not' and parentheses are nested more than 64 deep"),
        ("a > 1" + "+1" * 201, r"there are more than 200 of \+ - \* /"),
        ("a > 1" + "*1" * 3000, r"there are more than 200 of \+ - \* /"),
        ("a > 1e999 mm", r"column 5: found '1e999', expected a number up to 1e\+200"),
        ("a > 1e308 m", r"column 5: found '1e308', expected a number up to 1e\+200"),
    ],
)
def test_what_is_no_condition_is_misuse(text: str, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        parse_condition(text)


@pytest.mark.parametrize(
    ("text", "truth"),
    [
        ("a + b == 1", True),
        ("2 * a - 3 * (b - 1) > 4.5", True),
        ("-a < -0.5 and abs(b - a) == 1", True),
        ("(a + 1) / 4 == 0.5", True),
        ("a / b > 1e200", True),
        ("b / b == 1", False),
        ("(a > 0.5) and (b + 1 > 0.5)", True),
        ("x.position == 2.4 cm and x.position < 25 mm", True),
        ("m.M1.position - 2 * 21 == 0", True),
        ("m.M1.position % 5 = 2 && -m.M1.position % 5 = -2 && a <> b", True),
        ("b || m.M1.position % b >= 0", False),
        ("(a > 0.5) + (b > 0.5) + not_in_any_unit == 1", True),
    ],
)
def test_conditions_calculate(text: str, truth: bool) -> None:
    assert SignalCondition(text, SIGNALS.__getitem__).holds(SECOND // 2) is truth


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x.position > 3 s", "condition 'x.position > 3 s': 3 s is compared with 'mm'"),
        ("a > 3 mm", "3 mm is compared with what has no unit"),
    ],
)
def test_units_have_to_fit(text: str, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        SignalCondition(text, SIGNALS.__getitem__)


def test_units_are_converted() -> None:
    condition = SignalCondition("x.position >= 3 cm", SIGNALS.__getitem__)
    due = condition.due(SECOND // 2)
    assert due is not None
    assert [Moving().value(due - 1), Moving().value(due)] == [29, 30]


@settings(deadline=None)
@given(
    st.sampled_from(
        [
            "{x} - {y} > {n}",
            "abs({x} - {y}) >= {n}",
            "{x} + 2 * {y} < {n}",
            "{x} * {y} == {n}",
            "{x} / 3 > {y} + {n}",
            "{x} % 7 > {n} / 10",
            "{y} % ({x} + 50) == {n}",
            "({x} > {n}) + ({y} < {n} and not {x} = 3) == 1",
        ]
    ),
    st.integers(-60, 60),
    st.integers(SECOND // 2, 3 * SECOND),
    st.booleans(),
)
def test_a_comparison_of_moving_signals_changes_at_the_first_moment(form: str, n: int, now: Nanos, same: bool) -> None:
    text = form.format(x="x.position", y="x.velocity" if same else "y.position", n=n)
    signals = {**SIGNALS, "y.position": Moving(first=40, then=90)}
    condition = SignalCondition(text, signals.__getitem__)
    before, due = condition.holds(now), condition.due(now)
    if before:
        assert due == now
        return
    end = due if due is not None else 4 * SECOND
    assert due is None or due > now
    assert not any(condition.holds(now + (end - 1 - now) * step // 400) for step in range(401) if end > now)
    # The moment is one at which a side of the comparison changes, so it may hold there.
    if due is not None:
        found = next_true(condition, now)
        assert found is None or not condition.holds(found - 1)


class Rising:
    """From 0 on by one for each millisecond, without steps, for a second."""

    continuous = True
    unit = "mm"

    def __init__(self, later: Nanos = 0) -> None:
        self.later = later
        self.reads = 0

    def sync(self, now: Nanos) -> tuple[object, ...]:
        return (self,)

    def value(self, now: Nanos) -> float:
        self.reads += 1
        return min(max(now - self.later, 0), SECOND) / 1e6

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        return iter([moment for moment in (self.later, self.later + SECOND) if moment > now])

    def version(self) -> object:
        return self


@pytest.mark.parametrize("text", ["x > y", "x - y != 0", "x - x > 0"])
def test_signals_that_stay_equal_are_not_searched_without_end(text: str) -> None:
    signals = {"x": Rising(), "y": Rising()}
    assert SignalCondition(text, signals.__getitem__).due(0) is None
    assert signals["x"].reads < 400_000


def test_signals_that_part_late_are_found() -> None:
    signals = {"x": Rising(), "y": Rising(), "z": Rising(SECOND // 2)}
    due = next_true(SignalCondition("x - y + z > 1.5", signals.__getitem__), 0)
    assert due == SECOND // 2 + 1_500_001


@pytest.mark.parametrize(
    ("text", "due"),
    [
        ("x / b > 2", 1),  # 0/0 is not a number, anything above it by 0 is infinite
        ("(x + a) / b < 2", None),
        ("b / x == 0", 1),
        ("a / x < 0.5", 2_000_001),
        ("x * 1e200 * 1e200 > a", 1),
    ],
)
def test_quotients_by_zero_are_not_searched_without_end(text: str, due: Nanos | None) -> None:
    x = Rising()
    assert next_true(SignalCondition(text, {**SIGNALS, "x": x}.__getitem__), 0) == due
    assert x.reads < 2000


def next_true(condition: SignalCondition, now: Nanos) -> Nanos | None:
    """The moment at which it holds, looking again at each moment at which it may."""
    for _ in range(1000):
        due = condition.due(now)
        if due is None or condition.holds(due):
            return due
        now = due
    return None


def test_the_signals_of_a_condition_are_known() -> None:
    assert list(parse_condition("a and not (b or x.position > 3)").names()) == ["a", "b", "x.position"]


@given(level=st.integers(-60, 110), now=st.integers(SECOND // 2, 4 * SECOND), velocity=st.booleans())
def test_a_crossing_is_the_first_moment_on_another_side(level: int, now: Nanos, velocity: bool) -> None:
    signal = Moving(velocity=velocity)

    def side(moment: Nanos) -> int:
        value = signal.value(moment)
        return (value > level) - (value < level)

    found = crossing(signal, float(level), now)
    if found is None:
        assert {side(now + n * SECOND // 200) for n in range(1, 1000)} == {side(now)}
    else:
        assert side(found) != side(now)
        assert side(found - 1) == side(now)
        earlier = range(now, found, max(1, (found - now) // 300))
        assert {side(moment) for moment in earlier} == {side(now)}


@given(slope=st.fractions(-(10**6), 10**6), level=st.fractions(-(10**6), 10**6))
def test_a_crossing_on_a_straight_line_takes_a_few_looks(slope: Fraction, level: Fraction) -> None:
    looks: list[Nanos] = []

    def value(now: Nanos) -> float:
        looks.append(now)
        return float(slope * Fraction(now, SECOND))

    end = 100 * SECOND
    signal = SignalOf((), value, turning=lambda now: iter((end,) if now < end else ()))
    found = crossing(signal, level, 0)
    if found is not None and found <= end:
        assert len(looks) <= 8
        border = Border.of(level)
        assert border.side(value(found)) != border.side(value(found - 1)) == border.side(value(0))


def test_a_condition_says_when_it_may_come_true() -> None:
    moving = SignalCondition("x.position < 0 and a", SIGNALS.__getitem__)
    profile = Moving().profile
    at_zero = moving.due(SECOND // 2)
    assert at_zero == profile.pulse_time(0, 0)
    assert at_zero is not None
    below = moving.due(at_zero)
    assert below is not None
    assert below == profile.pulse_time(-1, 0)
    assert moving.due(below) == below
    assert SignalCondition("b", SIGNALS.__getitem__).due(5) is None


class Replanned(Moving):
    """A profile that can be replaced by a slower one; counts how often its turns are looked for."""

    def __init__(self) -> None:
        super().__init__()
        self.looked = 0

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        self.looked += 1
        return super().turning_points(now)

    def replace(self) -> None:
        self.profile = plan_position(MotionState(0, 0, 0.0, 0.0), 100, 200.0, 300.0, 40.0)


def test_a_crossing_is_found_once_while_the_signal_goes_on_as_it_did() -> None:
    moving, limit = Replanned(), Level(60.0)
    condition = SignalCondition("x.position > limit or x.position < -20", {"x.position": moving, "limit": limit}.__getitem__)
    assert {condition.due(now) for now in range(SECOND // 2, SECOND * 3 // 2, SECOND // 20)} == {1_650_000_000}
    assert moving.looked == 2
    moving.replace()
    assert condition.due(0) == 1_600_000_000  # 4 pulses in 0.2 s, then 56 at 40 pulses/s
    assert moving.looked == 4
    limit.level = 50.0
    assert condition.due(0) == 1_350_000_000
    assert moving.looked == 5


def test_a_condition_depends_on_what_its_signals_depend_on_each_once() -> None:
    assert SignalCondition("b or x.position > 5 and b == 0", SIGNALS.__getitem__).sync(5) == (
        SIGNALS["b"],
        SIGNALS["x.position"],
    )


@given(
    st.one_of(st.fractions(), st.floats(allow_nan=False, allow_infinity=False).map(Fraction)),
    st.one_of(st.just(None), st.floats(allow_nan=False)),
    st.integers(-2, 2),
)
@example(Fraction(1, 10), None, 0)
@example(Fraction(10) ** 400, inf, 0)
@example(-(Fraction(10) ** 400), -inf, 0)
def test_a_number_is_on_the_side_of_the_exact_level(level: Fraction, value: float | None, steps: int) -> None:
    if value is None:  # one beside the level
        value = float(level) if abs(level) < 10**300 else 0.0
        for _ in range(abs(steps)):
            value = nextafter(value, inf if steps > 0 else -inf)
    assert Border.of(level).side(value) == (value > level) - (value < level)


@pytest.mark.parametrize(
    ("level", "border"),
    [
        (Fraction(1, 2), (0.5, 0.5)),
        (Fraction(1, 3), (1 / 3, nextafter(1 / 3, inf))),
        (Fraction(-1, 3), (nextafter(-1 / 3, -inf), -1 / 3)),
        (Fraction(2, 3), (2 / 3, nextafter(2 / 3, inf))),
        (Fraction(1, 10), (nextafter(0.1, -inf), 0.1)),
        (Fraction(10**400), (1.7976931348623157e308, inf)),
        (Fraction(-(10**400)), (-inf, -1.7976931348623157e308)),
    ],
)
def test_borders_lie_beside_numbers_that_floats_do_not_have(level: Fraction, border: tuple[float, float]) -> None:
    assert Border.of(level) == border
    below, above = border
    assert (Border.of(level).side(below), Border.of(level).side(above)) == ((0, 0) if below == above else (-1, 1))


@pytest.mark.parametrize("text", ["x.position < x.position * 2 - 10", "x.position * 2 - 10 > x.position", "x.position > 10"])
def test_a_signal_on_both_sides(text: str) -> None:
    condition = SignalCondition(text, SIGNALS.__getitem__)
    profile = Moving().profile
    moment = condition.change(profile.start)
    assert moment == profile.pulse_time(10, profile.start)
    assert moment is not None
    assert condition.holds(moment - 1)
    assert not condition.holds(moment)
