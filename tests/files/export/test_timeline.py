from __future__ import annotations

import io
import json
import random
import re
import subprocess
from itertools import pairwise
from math import cos, pi
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from world_rig import Run

from steptwin.controller import SECOND, Nanos
from steptwin.files.export import axis_views, write_trace
from steptwin.files.export.progress import silent
from steptwin.files.export.timeline import write_timeline
from steptwin.files.export.tracetracks import sort_out
from steptwin.files.world import World
from steptwin.motion import MotionState, plan_position
from steptwin.motion.divisions import StepTrain, profile_of
from steptwin.motion.paths import Circular, circle
from steptwin.motion.pulses import step_times
from steptwin.simulation.scheduler.trace import Trace, TraceRecord

WORLDS = Path(__file__).parents[3] / "examples" / "worlds"


def page_of(trace: Trace, views: Any = None, until: Nanos | None = None, begin: Nanos = 0) -> str:
    file = io.StringIO()
    write_timeline(sort_out(trace, views or {}, begin, until), file, silent)
    return file.getvalue()


def data_of(page: str) -> dict[str, Any]:
    (text,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    return json.loads(text)


class Piece(NamedTuple):
    begin: int
    plan: int
    segment: int
    count: int
    direction: int
    grid: int


class Motion:
    """The motion of an axis as the page takes it, with the formulas of docs/control.md."""

    def __init__(self, axis: dict[str, Any], begin: Nanos = 0) -> None:
        self._plans = axis["plans"]
        self._begin = begin
        numbers = axis["pieces"]
        self.pieces = [Piece(*numbers[i : i + 6]) for i in range(0, len(numbers), 6)]

    def position(self, now: Nanos) -> float:
        piece = [piece for piece in self.pieces if self._begin + piece.begin <= now][-1]
        plan = self._plans[piece.plan]
        if piece.segment < 0:
            return plan["base"] + plan["final"]
        segment, t = plan["segments"][piece.segment], (now - int(plan["start_ns"])) / SECOND
        if isinstance(segment, list):
            return plan["base"] + polynomial(segment, t)
        centre, radius, angle, turn = segment["course"]
        return plan["base"] + centre + radius * cos((angle + turn * polynomial(segment["way"], t)) * pi / 2)


def polynomial(segment: list[float], t: float) -> float:
    _, anchor, c0, c1, c2, c3, _ = segment
    u = t - anchor
    return c0 + c1 * u + c2 * u**2 + c3 * u**3


@pytest.mark.parametrize(("name", "begin"), [("mic488", 0), ("mic488", 9_060_000_000), ("m1486", 0), ("m1486", 412_345_678)])
def test_the_plans_of_a_page_are_the_motion(name: str, begin: Nanos, request: pytest.FixtureRequest) -> None:
    run: Run = request.getfixturevalue(name)
    data = data_of(page_of(run.trace, run.views, run.until, begin))
    assert data["span"] == run.until - begin
    chance = random.Random(3)
    tracks = sort_out(run.trace, run.views, begin, run.until).axes
    assert len(data["axes"]) == len(tracks) > 0
    for axis, track in zip(data["axes"], tracks, strict=True):
        (number,) = (number for (_, number), view in run.views.items() if view is track.view)
        motion = Motion(axis, begin)
        for now in [chance.randrange(begin, run.until) for _ in range(300)] + [t for t in track.times if t >= begin]:
            plan = track.plan(now)
            profile = profile_of(plan)
            position = profile.position(max(now, profile.start)) + run.origin_p(number, now)
            assert motion.position(now) == pytest.approx(position, abs=2e-5)
        for piece in motion.pieces:
            now = begin + piece.begin
            plan = track.plan(now)
            assert piece.count == plan.count(max(now, profile_of(plan).start)) + run.origin_p(number, now)
            if isinstance(plan, StepTrain) and piece.direction:
                assert piece.grid == plan.division(now).grid


def test_pulses_can_be_found_from_the_pieces(m1486: Run) -> None:
    """What the page does: pulse k of a piece is where its segment is k grids beyond its count."""
    (axis,) = data_of(page_of(m1486.trace, m1486.views, m1486.until + SECOND))["axes"]
    given = 0
    for piece, following in pairwise(Motion(axis).pieces):
        ways = (following.count - piece.count) * piece.direction / piece.grid
        assert ways == round(ways) >= 0
        given += round(ways)
    plans = [(record.time, record.value) for record in m1486.trace.plans()]
    ends = [time for time, _ in plans[1:]] + [m1486.until]
    pulses = [step_times(plan, a, b) for (a, plan), b in zip(plans, ends, strict=True) if isinstance(plan, StepTrain)]
    assert given == sum(map(len, pulses)) > 10_000


def test_arcs_are_exact() -> None:
    arc = circle(5000.0, 0.0, 5000.0, 4.0)
    curve = Circular(arc.centre_x, arc.radius, arc.begin_q, arc.sweep_q / arc.length)
    profile = curve.profile(plan_position(MotionState(0, 0, 0.0, 0.0), round(arc.length), 1e4, 1e4, 4e3), 0, None)
    trace = Trace()
    trace.add(TraceRecord(0, "a", "plan", "1", profile))
    (axis,) = data_of(page_of(trace))["axes"]
    motion = Motion(axis)
    assert profile.end is not None
    for n in range(1000):
        now = profile.end * n // 1000
        assert motion.position(now) == pytest.approx(profile.position(now), abs=1e-6)


def test_a_page_of_many_machines_stays_small() -> None:
    trace = Trace()
    moves = 20
    for n in range(100):
        for move in range(moves):
            for axis in "1234":
                plan = plan_position(MotionState(move * SECOND, 0, 0.0, 0.0), 100 * move, 5000.0, 5000.0, 1000.0)
                trace.add(TraceRecord(move * SECOND, f"m{n}", "plan", axis, plan))
    page = page_of(trace)
    data = data_of(page)
    assert (len(data["controllers"]), len(data["axes"])) == (100, 400)
    empty = len(page_of(Trace(), until=SECOND))
    # A move is a plan of three segments, and with the rest four pieces of six numbers.
    assert (len(page) - empty) / (400 * moves) < 5 * 60


def test_the_page_needs_nothing_from_outside(mic488: Run) -> None:
    page = page_of(mic488.trace, mic488.views, mic488.until)
    assert not re.search(r"https?:|//[\w-]+\.\w|src=|@import|url\(|<link|<iframe", page)
    assert "default-src 'none'" in page
    assert not re.search(r"/\*\w+\*/", page)


def test_texts_cannot_break_out_of_the_page() -> None:
    trace = Trace(["</title><b>"])
    evil = "</script><script>alert(1)</script><!-- /*data*/ \u2028"
    trace.add(TraceRecord(1, "</title><b>", "event", "x", evil))
    page = page_of(trace, until=SECOND)
    assert page.count("</script>") == 3
    assert "<b>" not in page
    assert data_of(page)["marks"] == [[1, "</title><b>", "event", "x", evil]]


def test_every_record_that_is_no_track_is_a_mark(mic488: Run) -> None:
    marks = data_of(page_of(mic488.trace, mic488.views, mic488.until))["marks"]
    assert len(marks) == len(list(mic488.trace.of("frame", "event", "input", "statement", "fault")))
    assert [text for _, _, kind, _, text in marks if kind == "event"][-1] == "M3 stopped by KR"
    trace = Trace()
    trace.add(TraceRecord(1, "a", "statement", "main", 12))
    trace.add(TraceRecord(2, "a", "frame", "tcp-1/in", bytes(100)))
    statement, frame = data_of(page_of(trace))["marks"]
    assert statement == [1, "a", "statement", "main", "line 12"]
    assert frame[4].endswith("00 … 100 bytes")


def shown(browser: str, page: Path) -> str:
    """The page as a browser has it after its scripts have run."""
    options = ["--headless", "--disable-gpu", "--no-sandbox", "--virtual-time-budget=3000", "--window-size=1300,1000"]
    profile = f"--user-data-dir={page.parent / 'browser'}"
    ran = subprocess.run(
        [browser, *options, profile, "--dump-dom", page.as_uri()], capture_output=True, text=True, check=True, timeout=100
    )
    return ran.stdout


def test_channels_in_a_browser(chromium: str, tmp_path: Path) -> None:
    """Axes that never move share a row; commanded and true position share a channel; an axis that has homed shows its count
    too."""
    world = World.load(WORLDS / "feeder.toml")
    world.run(for_=8)
    page = tmp_path / "t.html"
    write_trace(world.trace, page, views=axis_views(world))
    channels = re.findall(r'class="name"[^>]*>([^<]*)<', shown(chromium, page))
    assert channels[:3] == ["table", "M1 position, x true", "M1 since power-on"]
    assert channels[3:6] == ["M1 velocity", "M1 pulses", "no motion: M2, M3, M4"]
    assert not [name for name in channels if name.startswith("M2 ")]


def test_the_page_computes_the_motion_in_a_browser(chromium: str, tmp_path: Path) -> None:
    """Position, velocity and count of a move along an arc, and the range of its channel, as the scripts of the page have them."""
    arc = circle(5000.0, 0.0, 5000.0, 4.0)
    curve = Circular(arc.centre_x, arc.radius, arc.begin_q, arc.sweep_q / arc.length)
    profile = curve.profile(plan_position(MotionState(0, 0, 0.0, 0.0), round(arc.length), 1e4, 1e4, 4e3), 0, None)
    trace = Trace()
    trace.add(TraceRecord(0, "a", "plan", "1", profile))
    assert profile.end is not None
    moments = [profile.end * n // 101 for n in range(101)]
    script = """
      const asked = new Motion(DATA.axes[0]);
      const looks = %s.map((t) => [asked.pulses(asked.at(t), t), asked.velocity(asked.at(t), t), asked.count(t)]);
      document.body.append(Object.assign(document.createElement("output"), {
        textContent: JSON.stringify({ looks, range: asked.range(false, 0, SPAN) }),
      }));
    """
    page = tmp_path / "t.html"
    page.write_text(page_of(trace).replace("</script>\n</body>", script % moments + "</script></body>"), "utf-8")
    (shown_output,) = re.findall(r"<output>(.*?)</output>", shown(chromium, page))
    found = json.loads(shown_output)
    for now, (position, velocity, count) in zip(moments, found["looks"], strict=True):
        assert position == pytest.approx(profile.position(now), abs=1e-6)
        assert velocity == pytest.approx(profile.velocity(now), abs=1e-6)
        assert count == profile.count(now)
    assert found["range"] == pytest.approx([0.0, 10_000.0], abs=50.0)
