"""Start/stop motion against numerical integration of the speed-time curve as M-6 states it."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from decimal import Decimal, localcontext
from math import inf, nan
from typing import Any

import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.motion import MotionState, Profile
from steptwin.motion.ramps import SpeedCurve, plan_distance, plan_endless, plan_forced_stop

FULL_STEP = 64


class Rise:
    """The speed-time curve from rest, in exact arithmetic, and its integral by Simpson's rule (exact for parabolas)."""

    def __init__(self, curve: SpeedCurve) -> None:
        self.s, self.a, self.p, self.v = (Decimal(x) for x in curve)
        self.linear_s = max(Decimal(0), (min(self.p, self.v) - self.s) / self.a)
        # Seconds on the parabola of M-6, counted from the speed P, where this motion enters it, and where it ends.
        self.entry_s = self.top_s = Decimal(0)
        if self.p < self.v:
            self.top_s = 2 * (self.v - self.p) / self.a
            if self.s > self.p:
                self.entry_s = self.search(self.parabola, self.s, self.top_s)
        self.seconds = Decimal(0) if self.v <= self.s else self.linear_s + self.top_s - self.entry_s

    def parabola(self, t: Decimal) -> Decimal:
        """M-6: v(t) = P + A t − A² t² / (4 (V − P))."""
        return self.p + self.a * t - self.a**2 * t**2 / (4 * (self.v - self.p))

    def speed(self, t: Decimal) -> Decimal:
        if t >= self.seconds:
            return self.v
        if t < self.linear_s:
            return self.s + self.a * t
        return self.parabola(t - self.linear_s + self.entry_s)

    def way(self, t: Decimal) -> Decimal:
        total = Decimal(0)
        seams = [Decimal(0), min(self.linear_s, self.seconds), self.seconds]
        for begin, seam in itertools.pairwise([*seams, t]):
            end = min(seam, t)
            if end > begin:
                inside = (end - begin) * Decimal("1e-40")
                first, last = self.speed(begin + inside), self.speed(end - inside)
                total += (end - begin) / 6 * (first + 4 * self.speed((begin + end) / 2) + last)
        return total

    @staticmethod
    def search(function: Callable[[Decimal], Decimal], value: Decimal, high: Decimal) -> Decimal:
        low = Decimal(0)
        for _ in range(150):
            middle = (low + high) / 2
            if function(middle) < value:
                low = middle
            else:
                high = middle
        return low


@pytest.fixture(autouse=True, scope="module")
def _digits() -> Iterator[None]:
    with localcontext() as context:
        context.prec = 60
        yield


def curve_of(start: float, acc: float, knee: float, top: float) -> SpeedCurve:
    """From the arguments of S, A, P, V, in full steps."""
    return SpeedCurve(start * FULL_STEP, acc * FULL_STEP, knee * FULL_STEP, top * FULL_STEP)


curves = st.builds(
    curve_of,
    st.integers(16, 1950),
    st.one_of(st.integers(1, 65_000), st.integers(1000, 65_000)),
    st.one_of(st.integers(20, 7000), st.just(25_000)),
    st.one_of(st.integers(16, 20_000), st.integers(16, 3000)),
)
# The chip's defaults; the manual's curve; slowest and fastest; start above the knee; P at V; V at and below S.
CURVES = [
    curve_of(200, 5000, 25_000, 1000),
    curve_of(200, 20_000, 2500, 12_500),
    curve_of(16, 65_000, 20, 40_000),
    curve_of(16, 1, 20, 100),
    curve_of(1950, 3000, 100, 4000),
    curve_of(100, 3000, 2000, 2000),
    curve_of(500, 3000, 100, 500),
    curve_of(500, 3000, 100, 300),
]


def with_curves(**others: tuple[Any, st.SearchStrategy[Any]]) -> Callable[[Callable[..., None]], Callable[[], None]]:
    """Each of `CURVES` with the example of every other parameter, then anything."""

    def decorate(test: Callable[..., None]) -> Callable[[], None]:
        for curve in CURVES:
            test = example(curve=curve, **{name: values[0] for name, values in others.items()})(test)
        return given(curve=curves, **{name: values[1] for name, values in others.items()})(test)

    return decorate


directions = (1, st.sampled_from([1, -1]))
shares = (0.3, st.floats(0.0, 1.0))


def agree(profile: Profile, now: int, way: Decimal, speed: Decimal, direction: int) -> None:
    moved = direction * (profile.position(now) - profile.base)
    slack = 1e-7 + 2**-48 * (abs(float(way)) + abs(profile.base))
    assert moved == pytest.approx(float(way), abs=slack)
    assert direction * profile.velocity(now) == pytest.approx(float(speed), rel=1e-9)


@with_curves(direction=directions, share=shares)
@settings(max_examples=60)
def test_m_6_m_8_an_endless_motion_follows_the_integrated_curve(curve: SpeedCurve, direction: int, share: float) -> None:
    rise = Rise(curve)
    profile = plan_endless(7, -300, direction, curve)
    assert profile.end is None
    for part in (0.0, share, 0.5 * share, 1.0 - 1e-6, 1.5):
        n = int(float(rise.seconds) * part * 1e9) + int(part * 1e6)
        t = Decimal(n) / 10**9
        agree(profile, 7 + n, rise.way(t), rise.speed(t), direction)
    if curve.top <= curve.start:
        assert profile.velocity(7) == direction * curve.top


@with_curves(direction=directions, share=shares, ways=((0.01, 1.0), st.tuples(st.floats(0.0, 1.0), st.floats(0.5, 3.0))))
@settings(max_examples=80)
def test_m_7_a_move_is_its_rise_and_the_mirror_image(
    curve: SpeedCurve, direction: int, share: float, ways: tuple[float, float]
) -> None:
    """Every short move, too: left half-way, where what remains is what was needed to get here."""
    rise = Rise(curve)
    for part in ways:
        way = max(1, int(part * float(2 * rise.way(rise.seconds))), int(part * 1000))
        profile = plan_distance(0, 50, 50 + direction * way, curve)
        assert profile.end is not None
        seconds = Decimal(profile.end) / 10**9
        n = int((profile.end - 1) * share / 2)
        t = Decimal(n) / 10**9
        agree(profile, n, rise.way(t), rise.speed(t), direction)
        # Mirrored in time about the middle (the end is a whole nanosecond, so up to one is uncertain) and in position.
        late = profile.end - n
        blur_u = 2e-9 * curve.top + 1e-7
        if n > 1:
            assert direction * (profile.position(n) + profile.position(late) - 100) == pytest.approx(way, abs=blur_u)
            blur_v = 2e-9 * curve.acc + 1e-9 * curve.top
            assert profile.velocity(late) == pytest.approx(profile.velocity(n), abs=blur_v)
        assert rise.way(seconds / 2) * 2 == pytest.approx(way, abs=blur_u)


@with_curves(direction=directions, share=shares, way=(777, st.integers(1, 10**6)))
@settings(max_examples=80)
def test_a_move_ends_on_its_target_with_every_pulse(curve: SpeedCurve, direction: int, share: float, way: int) -> None:
    begin = int(share * 2**24)
    target = begin + direction * way
    profile = plan_distance(3, begin, target, curve)
    assert profile.end is not None
    assert (profile.count(3), profile.count(profile.end)) == (begin, target)
    assert profile.position(profile.end) == target
    assert profile.velocity(profile.end) == 0.0
    # The last pulse is where the motion ends, at the start speed (or the constant one).
    assert profile.pulse_time(target, 3) == profile.end
    assert abs(profile.velocity(profile.end - 1)) == pytest.approx(min(curve.start, curve.top), abs=3e-9 * curve.acc + 1e-9)
    assert profile.pulse_time(target + direction, 3) is None
    assert len(profile.segments) <= 5


@with_curves(k=(100_000, st.integers(1, 10**6)))
@settings(max_examples=60)
def test_pulses_are_the_first_nanosecond_after_the_integrated_position(curve: SpeedCurve, k: int) -> None:
    rise = Rise(curve)
    profile = plan_endless(0, 0, 1, curve)
    time = profile.pulse_time(k, 0)
    assert time is not None
    blur = Decimal(2) ** -48 * k
    assert rise.way(Decimal(time) / 10**9) >= k - blur
    assert rise.way(Decimal(time - 1) / 10**9) < k + blur


landings = (16, st.sampled_from([1, 2, 16, 64, 256]))


@with_curves(
    direction=directions, share=shares, landing=landings, way=(40_000, st.integers(1, 10**5)), begin=(7, st.integers(-300, 300))
)
@settings(max_examples=100)
def test_a_forced_stop_is_the_mirror_image_of_the_rise_to_its_speed(
    *, curve: SpeedCurve, direction: int, share: float, landing: int, way: int, begin: int
) -> None:
    """From anywhere: within the ramps of a move, at its cruise, and at once where there is no ramp."""
    rise = Rise(curve)
    move = plan_distance(0, begin, begin + direction * way * landing, curve)
    assert move.end is not None
    now = int(share * move.end)
    assume(0 < now < move.end)
    origin = begin % landing
    stop = plan_forced_stop(MotionState.of(move, now), curve, landing, origin)
    assert stop.end is not None
    v = abs(move.velocity(now))
    assert abs(stop.velocity(now)) == pytest.approx(v, rel=1e-9) or (stop.end == now and v <= curve.start)
    assert stop.position(now) == pytest.approx(move.position(now), abs=1.1e-3)
    assert stop.count(now) == move.count(now)
    # Seconds and way of the ramp.
    rise_s = rise.search(rise.speed, Decimal(v), rise.seconds) if v > curve.start else Decimal(0)
    ramp_u = float(rise.way(rise_s))
    low = min(v, curve.start)
    first_landing = direction * (move.position(now) - origin) + ramp_u
    blur = 1e-3 + 1e-7 * ramp_u
    # Ends at the first landing position after the ramp.
    rest = stop.position(stop.end)
    assert rest == stop.count(stop.end)
    assert (rest - origin) % landing == 0
    assert -blur <= direction * (rest - origin) - first_landing < landing + blur
    for part in (0.25, 0.9) if rise_s else ():
        n = int(part * float(rise_s) * 1e9)
        back = rise_s - Decimal(n) / 10**9
        assert abs(stop.velocity(now + n)) == pytest.approx(float(rise.speed(max(back, Decimal(0)))), rel=1e-6)
    rest_s = (direction * (rest - move.position(now)) - ramp_u) / low
    assert (stop.end - now) / 1e9 == pytest.approx(float(rise_s) + max(rest_s, 0.0), abs=1e-8 + 1e-7 * float(rise_s) + blur / low)


@with_curves(direction=directions, share=shares, way=(4000, st.integers(1, 10**4)))
@settings(max_examples=80)
def test_a_stop_forced_in_the_last_ramp_ends_where_the_move_would_have_ended(
    curve: SpeedCurve, direction: int, share: float, way: int
) -> None:
    assume(curve.top > curve.start)
    target = 64 * direction * way
    move = plan_distance(0, 0, target, curve)
    assert move.end is not None
    # The beginning of the fall to the end, but for the first microseconds near the top, where the speed hardly tells.
    begin = move.end - move.end // 2
    for s in move.segments:
        if s.c2 * direction < 0.0:
            break
        begin = max(begin, int(s.end_s * 1e9) + 10_000)
    now = begin + int(share * (move.end - begin))
    assume(now < move.end)
    state = MotionState.of(move, now)
    assume(abs(state.velocity) > curve.start)
    stop = plan_forced_stop(state, curve, 64)
    assert stop.end is not None
    assert stop.count(stop.end) == target
    assert stop.end == pytest.approx(move.end, abs=2 + 2e-3 / curve.start * 1e9)


def test_a_forced_stop_at_rest_is_rest() -> None:
    stop = plan_forced_stop(MotionState(5, 9, 0.0, 0.0), CURVES[0], 64)
    assert (stop.end, stop.count(5)) == (5, 9)


def test_no_distance_is_no_motion() -> None:
    assert plan_distance(5, 9, 9, CURVES[0]).end == 5


@pytest.mark.parametrize("name", ["start", "acc", "knee", "top"])
@pytest.mark.parametrize("value", [0.0, -1.0, nan, inf])
def test_speeds_and_accelerations_that_are_not_finite_and_positive_are_refused(name: str, value: float) -> None:
    curve = CURVES[0]._replace(**{name: value})
    unit = "u/s²" if name == "acc" else "u/s"
    message = f"{name} = {value} {unit}: must be finite and greater than 0"
    for plan in (
        lambda: plan_distance(0, 0, 64, curve),
        lambda: plan_endless(0, 0, 1, curve),
        lambda: plan_forced_stop(MotionState(0, 0, 0.0, 100.0), curve, 64),
    ):
        with pytest.raises(Misuse, match=message):
            plan()


@pytest.mark.parametrize(
    ("curve", "ramps"),
    [
        (SpeedCurve(100.0, 1e3, 500.0, 900.0), 2),  # linear, then parabolic
        (SpeedCurve(500.0, 1e3, 500.0, 900.0), 1),  # it begins where the parabola does
        (SpeedCurve(100.0, 1e3, 900.0, 900.0), 1),
        (SpeedCurve(500.0, 1e3, 900.0, 500.0), 0),  # it begins at its highest speed
    ],
)
def test_a_ramp_has_no_parts_that_take_no_time(curve: SpeedCurve, ramps: int) -> None:
    assert len(plan_endless(0, 0, 1, curve).segments) == ramps + 1


def test_the_manuals_curve() -> None:
    """P2500 with V12500: linear to 2500 full steps/s, then parabolic."""
    profile = plan_endless(0, 0, 1, curve_of(200, 20_000, 2500, 12_500))
    linear_ns = int((2500 - 200) / 20_000 * 1e9)
    assert profile.velocity(linear_ns) / 64 == pytest.approx(2500)
    # From there 2 (V − P) / A = 1 s to the top, three quarters of the speed gained in the first half.
    assert profile.velocity(linear_ns + 5 * 10**8) / 64 == pytest.approx(2500 + 7500)
    assert profile.velocity(linear_ns + 10**9) / 64 == pytest.approx(12_500)


@pytest.mark.parametrize("direction", [1, -1])
def test_distances_too_far_to_be_exact_are_refused(direction: int) -> None:
    fast = SpeedCurve(1e9, 1e12, 1e12, 1e12)
    profile = plan_distance(0, 5, 5 + direction * 2**48, fast)
    assert profile.end is not None
    assert profile.count(profile.end) == 5 + direction * 2**48
    with pytest.raises(Misuse) as caught:
        plan_distance(0, 5, 5 + direction * (2**48 + 1), fast)
    assert str(caught.value) == f"distance = {direction * (2**48 + 1)} u: must be within ±{2**48}"
