"""Models of motors that can be switched on: what their rotors do, against Runge and Kutta on the differential equation of a rotor

J·θ″ = −T·sin(50·(θ − field)) − detent·sin(200·θ) − friction·sign(θ′) − load.
"""

from __future__ import annotations

from collections.abc import Callable
from math import asin, cos, pi, sin

import pytest

from steptwin.controller import SECOND
from steptwin.files.recording import load, recording_of, save
from steptwin.files.world import World
from steptwin.simulation.mechanics.potential import PeriodicPotential
from steptwin.simulation.toml.reader import WorldError

TORQUE, INERTIA, POLES = 1.0, 5e-5, 50
TURN_P, PERIOD_P, STEP_P = 3200, 64, 16
TEXT = """
[[mic488]]
name = "c"
[mic488.M1]
acc = 100000.0
dec = 100000.0
vel = {speed}
mot_resol = 3200
[[axis]]
name = "x"
drive = "c.M1"
pulses_per_rev = 3200
{axis}
[axis.motor]
torque = [[0, 1.0], [3000, 1.0]]
inertia = 0.00005
friction = {friction}
{motor}
"""

Place = Callable[[float, float], float]


def world(motor: str, *, friction: float = 0.1, rpm: float = 600.0, axis: str = "") -> World:
    text = TEXT.format(speed=rpm / 60 * TURN_P, motor=motor, friction=friction, axis=axis)
    return World.from_toml(text, name="w.toml")


def start(found: World, to: float = 1e6) -> None:
    found.mic488["c"].write("M1_EN", 1)
    found.mic488["c"].write("M1_POS_ABS", to)


def events(found: World, subject: str) -> list[tuple[float, str]]:
    """But for what happens before it has current for the first time."""
    records = [record for record in found.trace.of("event") if record.subject == subject]
    return [(record.time / SECOND, str(record.value)) for record in records if record.time]


def integrated(
    acceleration: Place, x: float, v: float, until: Callable[[float, float, float], bool], h: float = 4e-6
) -> tuple[float, float, float]:
    """(time, angle, speed) at the first step at which ``until`` holds, in radians."""
    t = 0.0
    while not until(t, x, v):
        a = v, acceleration(x, v)
        b = v + h / 2 * a[1], acceleration(x + h / 2 * a[0], v + h / 2 * a[1])
        c = v + h / 2 * b[1], acceleration(x + h / 2 * b[0], v + h / 2 * b[1])
        d = v + h * c[1], acceleration(x + h * c[0], v + h * c[1])
        x += h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
        v += h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])
        t += h
    return t, x, v


def sign(v: float) -> int:
    return (v > 0) - (v < 0)


# ---------------------------------------------------------------------- stops without ramp


@pytest.mark.parametrize(
    ("rpm", "friction", "load"),
    [(300, 0.05, 0.0), (400, 0.05, 0.0), (500, 0.1, 0.0), (700, 0.3, 0.0), (1000, 0.1, 0.0), (700, 0.1, 0.2), (650, 0.3, -0.2)],
)
def test_after_a_stop_without_ramp_it_runs_on_by_as_many_periods_as_its_energy_takes(
    rpm: float, friction: float, load: float
) -> None:
    def acceleration(x: float, v: float) -> float:
        return (-TORQUE * sin(POLES * x) - friction * sign(v) - load) / INERTIA

    lag = asin((friction + load) / TORQUE) / POLES
    time, x, _ = integrated(acceleration, -lag, rpm / 60 * 2 * pi, lambda t, x, v: v <= 0)
    periods = round((x - lag) * POLES / (2 * pi))  # what is between two edges, where the field pulls as much as the rest
    found = world(f"load = {load}\noverruns = true", friction=friction, rpm=rpm)
    start(found)
    found.run(until=1.0)
    assert found.read("x.lost") == 0.0
    found.mic488["c"].write("M_STOP", 1)
    found.run(until=3.0)
    assert found.read("x.lost") == -periods * PERIOD_P
    assert found.axis["x"].position == found.read("c.M1.position") + periods * PERIOD_P
    if periods == 0:
        assert events(found, "fall") == []
        return
    (begin, words), (end, rest) = events(found, "fall")
    assert (words, rest) == ("x runs on after a stop without ramp", f"x stands, {-periods * PERIOD_P} pulses behind")
    assert 0.4 * time < end - begin < time, "faster, on the mean, to the middle of the last period"


@pytest.mark.parametrize("speed", [700, 1200, 1900])
def test_a_move_of_an_m1486_ends_without_ramp(speed: int) -> None:
    """At start/stop speed, full steps/s. A rotor that its energy keeps in its period stays there."""

    def acceleration(x: float, v: float) -> float:
        return (-TORQUE * sin(POLES * x) - 0.2 * sign(v)) / INERTIA

    lag = asin(0.2 / TORQUE) / POLES
    _, x, _ = integrated(acceleration, -lag, speed / 200 * 2 * pi, lambda t, x, v: v <= 0)
    periods = round((x - lag) * POLES / (2 * pi))
    motor = TEXT[TEXT.index("[axis.motor]") :].format(friction=0.2, motor="overruns = true")
    text = f'[[m1486]]\nname = "c"\nprogram = "p"\n[[axis]]\nname = "x"\ndrive = "c.M1"\n{motor}'
    found = World.from_toml(text, {"p": f"[\rs{speed}\rv1950\rf12800\rr\rw500\r]\r".encode()})
    found.run(for_=2.0)
    assert found.read("c.position") == 12800
    assert found.read("x.lost") == -periods * 4 * 64
    ends = [record.time / SECOND for record in found.trace.of("event") if record.value == "stands at 12800"]
    assert [moment for moment, _ in events(found, "fall")[:1]] == (ends if periods else [])


def test_a_ramp_is_no_stop() -> None:
    found = world("overruns = true", rpm=1000)
    start(found, 40_000)
    found.run(until="idle")
    assert (found.read("x.lost"), events(found, "fall")) == (0.0, [])


def test_it_runs_on_to_its_hard_stop_at_most() -> None:
    def stopped(low: float) -> World:
        found = world("overruns = true", rpm=1000, axis=f"travel = [{low}, 1000]")
        start(found, -100_000)
        found.run(until=0.8)
        found.mic488["c"].write("M_STOP", 1)
        found.run(until=2.0)
        return found

    free = stopped(-90_000)
    lost, place = free.read("x.lost"), free.axis["x"].position
    assert lost > 10 * PERIOD_P
    assert lost % PERIOD_P == 0
    held = stopped(place + 70)
    # The place of the nearest period is 6 pulses beyond the stop.
    assert (held.axis["x"].position, held.read("x.lost")) == (place + 70, lost - 70)


def test_what_the_load_drives_on_is_never_held_again() -> None:
    found = world("load = 0.5\noverruns = true", rpm=700, axis="travel = [-3000000, 0]")
    start(found, -1e6)
    found.run(until=1.0)
    found.mic488["c"].write("M_STOP", 1)
    found.run(until=1.5)
    assert [text for _, text in events(found, "fall")] == ["x runs on after a stop without ramp"]
    fast = 700 / 60 * 2 * pi
    fallen = fast * 0.5 + 0.5 * 0.4 / INERTIA * 0.25  # 0.4 N·m are left of the load
    gone = -found.read("x.position") + found.read("c.M1.position")
    assert gone / TURN_P * 2 * pi == pytest.approx(fallen, rel=0.01)


def test_without_the_model_the_field_holds_it() -> None:
    found = world("", rpm=1000)
    start(found)
    found.run(until=1.0)
    found.mic488["c"].write("M_STOP", 1)
    found.run(until=2.0)
    assert (found.read("x.lost"), events(found, "fall")) == (0.0, [])


@pytest.mark.parametrize("resisting", [-0.9, -0.3, 0.0, 0.2, 0.7, 0.999])
def test_the_energy_that_leaves_a_well_is_the_work_on_the_way_out(resisting: float) -> None:
    wells, steps = PeriodicPotential(1.0, 64.0), 40_000
    low, high = -asin(resisting), pi + asin(resisting)
    width = (high - low) / steps
    work = sum(sin(low + (n + 0.5) * width) + resisting for n in range(steps)) * width * 64 / (2 * pi)
    assert wells.to_leave(resisting) == pytest.approx(work, rel=1e-6)


# ---------------------------------------------------------------------- resonance


def escaped(growth: float, use: float, vibration: float) -> float:
    """Seconds after which a rotor on a field of constant speed is out of its period, with a damping that is negative."""
    edge = pi - asin(use), pi + asin(use)

    def acceleration(x: float, v: float) -> float:
        return (-TORQUE * sin(POLES * x) - use * TORQUE) / INERTIA + 2 * growth * v

    begin = (-asin(use) + vibration * pi / 2) / POLES
    return integrated(acceleration, begin, 0.0, lambda t, x, v: x * POLES < -edge[0] or x * POLES > edge[1])[0]


@pytest.mark.parametrize("growth", [10.0, 30.0])
@pytest.mark.parametrize("use", [0.0, 0.2, 0.5, 0.8])
def test_in_the_band_it_loses_the_field_when_the_differential_equation_does(growth: float, use: float) -> None:
    found = world(f"resonance = [500, 700]\nresonance_growth = {growth}\nvibration = 0.05", friction=use)
    start(found)
    begin = 500 / 60 * TURN_P / 100_000  # the ramp comes into the band
    found.run(until="x.stalled", for_=2)
    ((moment, words),) = events(found, "stall")
    assert words == "x stalls by resonance"
    expected = escaped(growth, use, 0.05)
    # On the ramp it needs 0.0098 N·m more. The linear vibration grows somewhat faster than the true one.
    assert 0.84 * expected < moment - begin < 1.0 * expected


def test_through_the_band_it_has_to_be_fast() -> None:
    """100 rev/min in 0.053 s, growing by e in 0.02 s: from 0.05 to 0.7 full steps, 1.27 lose the field. Slower ramps do."""
    fast = world("resonance = [400, 500]\nresonance_growth = 50\nvibration = 0.05")
    start(fast)
    fast.run(until=2.0)
    assert events(fast, "stall") == []
    slow = world("resonance = [400, 500]\nresonance_growth = 50\nvibration = 0.05")
    slow.mic488["c"].write("M1_ACC", 60_000)
    start(slow)
    slow.run(until=2.0)
    (moment, words), *_ = events(slow, "stall")
    assert words == "x stalls by resonance"
    assert 400 / 60 * TURN_P / 60_000 < moment < 500 / 60 * TURN_P / 60_000


def test_the_vibration_is_carried_through_later_motions_and_fades() -> None:
    """0.04 s in the band, twice: the second time it begins with what has not faded."""

    def passes(pause_s: float) -> list[tuple[float, str]]:
        found = world("resonance = [400, 500]\nresonance_growth = 60\nresonance_fading = 1\nvibration = 0.05")
        start(found)
        found.run(until=0.225)  # within the band, 472 rev/min; 0.013 s
        for _ in range(4):
            found.mic488["c"].write("M1_STOP", 1)
            found.run(for_=pause_s)
            start(found)
            found.run(for_=0.25)
        return events(found, "stall")

    assert passes(0.3) != []
    assert passes(3.0) == []


# ---------------------------------------------------------------------- current reduction


LIFT = "load = 0.5\nwhen_off = 'free'\nhold_current = {hold}\nhold_delay = '200 ms'"


def test_with_reduced_current_a_load_that_is_too_heavy_falls() -> None:
    found = world(LIFT.format(hold=0.3), axis="travel = [-100000, 100000]")
    start(found, 10_000)
    found.run(until="idle")
    stopped = found.time
    found.run(for_=0.19)
    assert found.read("x.lost") == 0.0
    found.run(until=stopped + 0.3)
    (moment, words), *_ = events(found, "fall")
    assert (moment, words) == (pytest.approx(stopped + 0.2, abs=1e-8), "x moves with too little current")

    def acceleration(x: float, v: float) -> float:
        return (-0.3 * TORQUE * sin(POLES * x) - 0.1 * sign(v) - 0.5) / INERTIA

    _, x, _ = integrated(acceleration, -asin(0.5) / POLES, -1e-9, lambda t, x, v: t >= 0.1)
    assert found.read("x.position") - 10_000 == pytest.approx(x / (2 * pi) * TURN_P, rel=0.06)  # it begins slowly


@pytest.mark.parametrize(("hold", "falls"), [(0.39, True), (0.41, False), (1.0, False)])
def test_the_share_that_holds_it_is_that_of_the_torques(hold: float, falls: bool) -> None:
    """0.5 N·m less 0.1 of friction, of 1 N·m."""
    found = world(LIFT.format(hold=hold))
    start(found, 3200)
    found.run(until="idle")
    found.run(for_=1)
    assert bool(events(found, "fall")) is falls


def test_detent_is_not_added_to_the_current_that_is_left() -> None:
    """Without current it would hold what is left of the load, 0.4 N·m."""
    places = []
    for detent in ("", "\ndetent = 0.45"):
        found = world(LIFT.format(hold=0.3) + detent)
        start(found, 3200)
        found.run(for_=1.0)
        places.append(found.read("x.position"))
    assert places[0] == places[1] < 3000


def test_the_next_motion_takes_what_stands_and_loses_what_falls() -> None:
    found = world(LIFT.format(hold=0.41))
    for target in (3200, 0, 6400):
        start(found, target)
        found.run(until="idle")
        found.run(for_=0.5)
        assert found.axis["x"].position == target
    falling = world(LIFT.format(hold=0.3) + "\nstart_speed = 60")
    start(falling, 3200)
    falling.run(until="idle")
    falling.run(for_=0.5)
    start(falling, 6400)
    falling.run(for_=0.5)
    assert falling.read("x.lost") > 10_000


def test_looking_ahead_changes_nothing() -> None:
    """A sensor and a condition look at later moments, at which the current is reduced."""
    sensor = '[[transducer]]\nname = "v"\nof = "x.position"\nto = "c.AIN1"\npoints = [[0, 0], [20000, 10]]\n'
    text = TEXT.format(speed=32_000, motor=LIFT.format(hold=0.3), friction=0.1, axis="travel = [-100, 99999]")
    plain, watched = World.from_toml(text), World.from_toml(text + sensor)
    for found in (plain, watched):
        start(found, 10_000)
    watched.run(until="x.position < 5000 and time > 0.8", for_=2)
    assert watched.read("x.position") == 4999.0
    plain.run(until=watched.time)
    assert plain.read("x.position") == 4999.0
    assert events(plain, "fall") == events(watched, "fall") != []


# ---------------------------------------------------------------------- detent


def test_detent_holds_a_load_without_current() -> None:
    for detent, stands in ((0.05, True), (0.03, False)):
        found = world(f"load = 0.045\nwhen_off = 'free'\ndetent = {detent}", friction=0.01)
        start(found, 3200)
        found.run(until="idle")
        found.mic488["c"].write("M1_EN", 0)
        found.run(for_=1)
        assert (found.axis["x"].position == 3200) is stands


@pytest.mark.parametrize("place", [3207, 3210, 3200, 3193])
def test_without_current_it_goes_to_the_nearest_full_step_and_back(place: int) -> None:
    found = world("when_off = 'free'\ndetent = 0.05", friction=0.01)
    start(found, place)
    found.run(until="idle")
    found.mic488["c"].write("M1_EN", 0)
    found.run(for_=0.1)
    assert found.axis["x"].position == round(place / STEP_P) * STEP_P
    found.mic488["c"].write("M1_EN", 1)
    found.run(for_=0.1)
    assert (found.axis["x"].position, found.read("x.lost")) == (place, 0)


@pytest.mark.parametrize(
    ("rpm", "detent", "friction"), [(600, 0.05, 0.02), (600, 0.03, 0.02), (300, 0.08, 0.01), (60, 0.05, 0.02)]
)
def test_it_coasts_until_a_full_step_catches_it(rpm: float, detent: float, friction: float) -> None:
    found = world(f"when_off = 'free'\ndetent = {detent}", friction=friction, rpm=rpm)
    start(found)
    found.run(until=1.0)
    begin = found.axis["x"].position
    found.mic488["c"].write("M1_EN", 0)
    found.run(for_=5.0)
    gone = found.axis["x"].position - begin
    assert found.axis["x"].position % STEP_P == 0

    def acceleration(x: float, v: float) -> float:
        return (-detent * sin(4 * POLES * x) - friction * sign(v)) / INERTIA

    # Its energy is that of the mean of the detent's.
    ways = []
    for phase in (0.0, 0.25, 0.5, 0.75):
        angle = phase * 2 * pi / 200
        more = detent / 200 * cos(4 * POLES * angle)
        v = max((rpm / 60 * 2 * pi) ** 2 + 2 * more / INERTIA, 0.0) ** 0.5
        ways.append((integrated(acceleration, angle, v, lambda t, x, v: v <= 0)[1] - angle) / (2 * pi) * TURN_P)
    assert min(ways) - 2 * STEP_P <= gone <= max(ways) + 2 * STEP_P


# ---------------------------------------------------------------------- all of them


ALL = """
load = 0.3
when_off = "free"
start_speed = 120
detent = 0.05
hold_current = 0.15
hold_delay = "50 ms"
overruns = true
resonance = [350, 450]
resonance_growth = 40
"""


@pytest.mark.parametrize("moment_s", [0.0, 0.19, 0.25, 0.601, 0.66, 0.8, 1.3, 1.9])
def test_it_can_be_restored_anywhere(moment_s: float, tmp_path: object) -> None:
    def script() -> World:
        found = world(ALL, axis="travel = [-50000, 50000]\nbacklash = 3")
        at = found.at
        at(0.0, lambda: start(found, 30_000))
        at(0.6, lambda: found.mic488["c"].write("M_STOP", 1))
        at(0.9, lambda: start(found, 0))
        at(1.25, lambda: found.mic488["c"].write("M1_EN", 0))
        at(1.6, lambda: start(found, 9000))
        return found

    found = script()
    found.run(until=3.0)
    texts = [text for _, text in events(found, "fall")] + [text for _, text in events(found, "stall")]
    assert len(texts) >= 4
    place = f"{tmp_path}/s.json"
    save(recording_of(found), place)
    part = load(place).replay(round(moment_s * SECOND))
    snapshot = part.snapshot()
    again = load(place).replay(0)
    again.restore(snapshot)
    for one in (part, again):
        one.run(until=3.0)
    assert again.trace.digest() == part.trace.digest()
    assert load(place).replay().trace.digest() == found.trace.digest()


@pytest.mark.parametrize(
    ("motor", "message"),
    [
        ("detent = 0.1", "detent acts on a rotor that may move: it needs when_off = 'free'"),
        ("hold_current = 0.5", "hold_current acts on a rotor that may move: it needs when_off = 'free'"),
        ("when_off = 'free'\nhold_current = 1.5", "permitted are numbers from 0 to 1"),
        ("hold_delay = '1 s'", "hold_delay.*hold_current"),
        ("resonance = [500, 400]", "the first must be below the second"),
        ("resonance = [-5, 400]", "permitted are speeds of 0 and more"),
        ("resonance_growth = 3", "resonance_growth.*resonance"),
        ("resonance = [1, 2]\nresonance_growth = 0", "permitted are numbers from 0.001 to 10000"),
        ("resonance = [1, 2]\nvibration = 0", "permitted are numbers from 1e-06 to 1"),
        ("overrun = true", r"has no 'overrun' \(did you mean 'overruns'\?\)"),
        ("overruns = 1", "overruns"),
    ],
)
def test_mistakes_have_their_places(motor: str, message: str) -> None:
    with pytest.raises(WorldError, match=f"(?s)w.toml:.*{message}"):
        world(motor)


def test_what_runs_on_needs_an_inertia() -> None:
    text = TEXT.format(speed=1000, motor="overruns = true", friction=0.1, axis="").replace("inertia = 0.00005\n", "")
    with pytest.raises(WorldError, match="what runs on needs an inertia or a mass"):
        World.from_toml(text)


@pytest.mark.parametrize(
    ("when_off", "inertia", "accepted"), [("holds", 0.0, True), ("holds", 1e-30, True), ("free", 1e-30, False)]
)
def test_only_what_moves_without_current_needs_an_inertia(when_off: str, inertia: float, accepted: bool) -> None:
    text = (
        '[[mic488]]\nname = "c"\n[[axis]]\nname = "x"\ndrive = "c.M1"\npitch = 5\n[axis.motor]\ntorque = [[0, 1.0]]\n'
        f'load = 0.9\ninertia = {inertia}\nwhen_off = "{when_off}"\n'
    )
    if accepted:
        assert World.from_toml(text).axis["x"].position == 0.0
    else:
        with pytest.raises(WorldError, match="on so small an inertia accelerates"):
            World.from_toml(text)
