"""Worlds as people use them: from TOML and Python, in virtual time."""

from __future__ import annotations

import re
from pathlib import Path
from textwrap import dedent
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from steptwin.errors import Misuse, Runaway
from steptwin.files.session import session_of
from steptwin.files.world import World
from steptwin.machine import SECOND
from steptwin.mic488.status import Status
from steptwin.wbc.check import check
from steptwin.wbc.image import build
from steptwin.wbc.positions import parse_positions
from steptwin.world import script as do
from steptwin.world.expression import Condition
from steptwin.world.kernel import Kernel
from steptwin.world.script import Steps

EXAMPLES = sorted((Path(__file__).parents[2] / "examples" / "worlds").glob("*.toml"))

SMALL = """
    [world]
    seed = 3
    [[mic488]]
    name = "a"
    [mic488.M1]
    unit = "mm"
    gear = 100.0
    acc = 100.0
    dec = 100.0
    vel = 40.0
    in_kl = "IN1"
    home_mode = "HOME1"
    limit_mode = "KL"
    [[mic488]]
    name = "b"
    [[mic488]]
    name = "c"
    [[axis]]
    name = "x"
    drive = "a.M1"
    travel = [-1.0, 101.0]
    start = 50.0
    [[axis.switch]]
    below = 0.0
    to = "a.IN1"
    hysteresis = 0.2
    [[wire]]
    from = "a.OUT1"
    to = "b.IN3"
    delay = "20 ms"
    [[button]]
    name = "go"
    to = "b.IN4"
"""


def small(more: str = "") -> World:
    return World.from_toml(dedent(SMALL) + dedent(more))


def moved(world: World, position: float) -> World:
    axis = world.mic488["a"].axis[1]
    axis.enable()
    axis.move_to(position)
    return world


# ---------------------------------------------------------------------- the interface


def test_positions_are_those_of_register_and_mechanics() -> None:
    world = moved(small(), 25.0)
    assert world.run(until="a.M1.status == 4") == "a.M1.status == 4"
    axis = world.mic488["a"].axis[1]
    assert (axis.position, axis.velocity, axis.status, axis.unit) == (25.0, 0.0, Status.REACHED, "mm")
    assert (world.axis["x"].position, world.axis["x"].lost) == (75.0, 0)


def test_a_move_into_a_stop_loses_what_the_stop_holds() -> None:
    world = moved(small(), 60.0)
    world.run(for_="10 s")
    assert world.mic488["a"].axis[1].position == 60.0
    assert (world.axis["x"].position, world.axis["x"].lost) == (101.0, 900)
    assert world.mic488["a"].axis[1].encoder < 60 * 100 * 400 // 3200  # the default encoder sits on the motor


def test_homing_finds_the_switch() -> None:
    world = small()
    world.mic488["a"].axis[1].enable()
    world.mic488["a"].axis[1].home(-20.0)
    world.run(until="a.M1.status == 4 or a.M1.status == 5", for_="20 s")
    assert world.mic488["a"].axis[1].position == 0.0
    assert world.axis["x"].position == pytest.approx(0.21)


def test_a_run_ends_at_a_moment_a_duration_or_a_condition() -> None:
    world = small()
    assert world.run(until=2.5) is None
    assert world.run(for_="1 min") is None
    assert world.time == 62.5
    moved(world, 10.0)
    assert world.run(until="x.position >= 55", for_=30) == "x.position >= 55"
    assert world.axis["x"].position == 55.0
    assert world.run(until="idle") == "idle"
    assert world.axis["x"].position == 60.0
    assert world.run(until="b.IN3", for_=5) is None
    assert world.run(until=90, for_=1) is None
    assert world.run(until=90.5, for_=60) is None
    assert world.time == 90.5
    for moment, message in ((90, r"until 90 s: this world is at 90\.5 s already"), (float("nan"), "nan is no time")):
        with pytest.raises(Misuse, match=message):
            world.run(until=moment)
    with pytest.raises(Misuse, match="run needs until or for_"):
        world.run()


def test_until_the_moment_is_exact() -> None:
    world = moved(small(), 10.0)
    world.run(until="x.position >= 55")
    profile = world.mic488["a"].device.axes[0].profile
    assert world.now == profile.pulse_time(500, 0)


def test_a_delayed_wire_and_a_button() -> None:
    world = small()
    world.mic488["a"].write("OUT1", 1)
    world.run(for_="19 ms")
    assert world.mic488["b"].pins["IN3"] == 0.0
    world.run(for_="1 ms")
    assert world.mic488["b"].pins["IN3"] == 1.0
    world.press("go", "50 ms")
    assert world.mic488["b"].pins["IN4"] == 1.0
    world.run(for_="1 s")
    assert world.mic488["b"].pins["IN4"] == 0.0


def test_the_last_hand_on_a_button_says_when_it_is_released() -> None:
    world = small()
    levels = []
    world.at("0.5 s", lambda: world.press("go", 1))
    world.at("2 s", lambda: world.press("go", 1))
    world.at("2.4 s", lambda: world.release("go"))
    world.at("2.7 s", lambda: world.press("go"))
    world.press("go", 1)
    for _ in range(20):
        levels.append(int(world.mic488["b"].pins["IN4"]))
        world.run(for_=0.2)
    assert levels == [1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 1, 1, 1, 1]
    assert session_of(world).replay().trace.digest() == world.trace.digest()


def test_an_edge_of_an_input_is_told_once() -> None:
    world = World.from_toml("""
        [[m1486]]
        name = "d"
        [[mic488]]
        name = "t"
        [[wire]]
        from = "t.OUT1"
        to = "d.B2"
    """)
    world.run(for_=1)
    begin = world.now
    world.m1486["d"].set_pin("B1", 0)
    world.m1486["d"].set_pin("BR0", 0)
    world.mic488["t"].write("OUT1", 1)
    world.run(for_=1)
    world.mic488["t"].write("OUT1", 0)
    world.m1486["d"].set_pin("B1", 1)
    world.m1486["d"].set_pin("LIMIT", 0)
    world.run(for_=1)
    edges = [(edge.subject, edge.value, edge.time - begin) for edge in world.trace.edges("d") if edge.time >= begin]
    assert sorted(edges) == [
        ("B1", 0.0, 0), ("B1", 1.0, SECOND), ("B2", 0.0, SECOND), ("B2", 1.0, 0), ("B5", 0.0, 0), ("LIMIT", 0.0, SECOND)
    ]  # fmt: skip


def test_names_that_are_not_there_are_misuse_with_those_that_are() -> None:
    world = small()
    with pytest.raises(Misuse, match="no axis 5: axes are 1, 2, 3, 4"):
        _ = world.mic488["a"].axis[5]
    with pytest.raises(Misuse, match="no MIC488 is called 'd'; there are a, b, c"):
        world.mic488["d"]
    with pytest.raises(Misuse, match=r"nothing is called 'z'.* there are a, b, c, x, go, time, idle"):
        world.run(until="z.position > 1")
    with pytest.raises(Misuse, match=r"no signal 'x\.speed'; there are position, lost, stalled$"):
        world.read("x.speed")
    with pytest.raises(Misuse, match="no button is called 'stop'; there are go"):
        world.press("stop")
    with pytest.raises(Misuse, match="M1_POS_AB"):
        world.mic488["a"].write("M1_POS_AB", 1.0)
    assert "d" not in world.mic488
    assert world.mic488.get("d") is None
    assert [*world.mic488] == ["a", "b", "c"]


# ---------------------------------------------------------------------- islands


def test_machines_that_share_nothing_are_advanced_when_somebody_looks() -> None:
    world = small()
    assert [list(kernel.machines) for kernel in world.kernels] == [["a", "b"], ["c"]]
    world.at(3.0, do.Set((("a", "IN5", 1.0),)))
    world.advance(5 * SECOND)
    assert [kernel.now for kernel in world.kernels] == [3 * SECOND, 0]
    assert world.mic488["c"].status == 0
    assert [kernel.now for kernel in world.kernels] == [3 * SECOND, 5 * SECOND]


# ---------------------------------------------------------------------- scripts


def test_events_act_once_again_and_again_or_when_a_condition_comes_true() -> None:
    world = small(
        """
        [[event]]
        at = "1 s"
        steps = [{ write = { "a.M1_EN" = 1, "a.M1_POS_ABS" = 20.0 } }]
        [[event]]
        name = "clock"
        every = "2 s"
        steps = [{ note = "tick" }]
        [[event]]
        when = "x.position > 60"
        steps = [{ set = { "b.IN9" = 1 } }, { stop = "far enough" }]
        """
    )
    assert world.run(for_="1 min") == "far enough"
    assert world.axis["x"].position == 60.01
    assert world.mic488["b"].pins["IN9"] == 1.0
    assert world.run(until=9.0) is None
    assert [r.time // SECOND for r in world.trace.events("world")] == [2, 4, 6, 8]


def test_a_condition_that_comes_true_again_acts_again() -> None:
    world = small('[[event]]\nwhen = "b.IN4"\nsteps = [{ note = "pressed" }]\n')
    for _ in range(3):
        world.press("go", 0.1)
        world.run(for_=1)
    assert len(list(world.trace.events("world"))) == 3


def test_expectations_that_do_not_hold_are_told() -> None:
    world = small(
        '[[script]]\nname = "s"\nsteps = [{ expect = "x.position > 49" }, { wait = "1 s" }, { expect = "x.position < 49" }]\n'
    )
    world.run(for_=2)
    assert [(f.time, f.value) for f in world.failures] == [(SECOND, "x.position < 49")]


def test_what_a_script_waits_for_in_vain_is_told_and_goes_on() -> None:
    world = small(
        """
        [[script]]
        name = "s"
        steps = [
          { until = "x.position > 60", within = "2 s" },
          { until = "time >= 3", within = "2 s" },
          { note = "on" },
        ]
        """
    )
    world.run(for_=1)
    snapshot = world.snapshot()
    world.run(for_=4)
    told = [(r.time // SECOND, r.subject, r.value) for r in world.trace.events("world")]
    assert told == [(2, "overdue", "s waited in vain for x.position > 60"), (3, "note", "on")]
    assert [record.time for record in world.overdue] == [2 * SECOND]
    assert not world.failures
    digest = world.trace.digest()
    world.restore(snapshot)
    assert list(world.overdue) == []
    world.run(for_=4)
    assert world.trace.digest() == digest


def test_operators_in_python_yield_steps_and_are_sent_what_they_give() -> None:
    seen: list[object] = []

    def operator() -> Steps:
        yield do.Wait(SECOND)
        yield do.Write((("a", "M1_EN", 1.0), ("a", "M1_POS_ABS", 10.0)))
        seen.append((yield do.Until("x.position > 70", within=5 * SECOND)))
        seen.append((yield do.Until("idle")))
        seen.append((yield do.Read("x.position")))
        yield do.Stop("done")

    world = small()
    world.script(operator)
    assert world.run(for_=60) == "done"
    assert seen == [False, True, 60.0]
    assert list(world.overdue) == []  # code is sent that it was in vain, and decides


def test_at_and_when_call_functions() -> None:
    world = small()
    seen: list[tuple[float, float]] = []
    world.at(2, lambda: moved(world, 5.0))
    world.when("x.position >= 52", lambda: seen.append((world.time, world.axis["x"].position)), once=True)
    world.run(for_=10)
    assert [position for _, position in seen] == [52.0]


def test_a_moment_that_has_passed_is_refused() -> None:
    world = small()
    world.run(for_=3)
    with pytest.raises(Misuse, match=r"at 2\.5 s: this world is at 3 s already"):
        world.at(2.5, do.Note("late"))
    with pytest.raises(Misuse, match=r"at 0 s: this world is at 3 s already"):
        world.at("0 s", lambda: None)
    world.at(3, do.Note("now"))
    world.run(for_=1)
    assert [(r.time, r.value) for r in world.trace.events("world")] == [(3 * SECOND, "now")]


def test_scripts_that_take_no_time_for_ever_are_a_runaway() -> None:
    def forever() -> Steps:
        while True:
            yield do.Note("again")

    world = small()
    world.script(forever)
    with pytest.raises(Runaway, match="script 'forever': more than 10000 steps at 0 ns"):
        world.run(for_=1)


def test_a_request_gives_its_answer_in_the_time_of_the_line() -> None:
    world = World.from_toml('[[line]]\nname = "bus"\ntiming = "real"\n[[mic488]]\nname = "a"\nline = "bus"\nunit = 5\n')
    seen: list[Any] = []

    def master() -> Steps:
        seen.append((yield do.Request("bus", 5, bytes.fromhex("03 2719 0001"), SECOND)))
        seen.append((yield do.Read("time")))
        seen.append((yield do.Request("bus", 6, bytes.fromhex("03 2719 0001"), SECOND)))
        seen.append((yield do.Read("time")))

    world.script(master)
    world.run(for_=5)
    assert seen[0] == bytes.fromhex("03 02 0000")
    assert seen[1] == pytest.approx(15 * 10 / 38400 + 0.00075, abs=1e-6)
    assert seen[2] == b""
    assert seen[3] == pytest.approx(seen[1] + 4 * 10 / 38400 + 1.0)  # a master is silent for 4 characters after an answer


# ---------------------------------------------------------------------- snapshots and branches


@pytest.mark.parametrize(
    ("step", "values"),
    [
        (do.Wait, [0.5]),
        (do.Wait, [-1]),
        (do.At, [1.0]),
        (do.Until, ["idle", 2.0]),
        (do.Press, ["go", 0.1]),
        (do.Request, ["bus", 1, b"", 0.5]),
    ],
)
def test_steps_take_whole_nanoseconds(step: Any, values: list[Any]) -> None:
    with pytest.raises(Misuse, match="steps take whole nanoseconds"):
        step(*values)


def test_a_snapshot_of_another_world_is_refused() -> None:
    snapshot = small().snapshot()
    small().restore(snapshot)
    other = small('[[axis.switch]]\nabove = 100.0\nto = "a.IN2"\n')
    with pytest.raises(Misuse, match="the snapshot is of another world"):
        other.restore(snapshot)
    with pytest.raises(Misuse, match="the snapshot is of another world"):
        World.from_toml("[[mic488]]\nname = 'a'\n").restore(World.from_toml("[[m1486]]\nname = 'a'\n").snapshot())


def test_a_snapshot_is_gone_back_to_with_its_scripts() -> None:
    world = small(
        '[[script]]\nname = "s"\nsteps = [{ write = { "a.M1_EN" = 1 } }, { repeat = 9, steps = ['
        '{ write = { "a.M1_POS_REL" = 7.0 } }, { until = "idle" }, { wait = "300 ms" }, { write = { "a.M1_POS_REL" = -6.0 } }, '
        '{ until = "idle" }] }]\n'
    )
    world.run(for_=2.9)
    snapshot = world.snapshot()
    before = (world.trace.digest(), world.axis["x"].position)
    world.run(for_=10)
    after = (world.trace.digest(), world.axis["x"].position)
    world.restore(snapshot)
    assert (world.trace.digest(), world.axis["x"].position) == before
    world.run(for_=10)
    assert (world.trace.digest(), world.axis["x"].position) == after


def test_a_branch_goes_its_own_way() -> None:
    world = moved(small(), 30.0)
    world.run(for_=0.5)
    other = world.branch()
    other.mic488["a"].axis[1].stop()
    assert other.run(until="idle") == world.run(until="idle") == "idle"
    assert world.axis["x"].position == 80.0
    assert 50.0 < other.axis["x"].position < 80.0
    assert world.trace.digest() != other.trace.digest()


def test_python_operators_are_brought_back_by_what_they_were_sent() -> None:
    def operator() -> Steps:
        for target in (5.0, 15.0, 25.0):
            position = yield do.Read("x.position")
            yield do.Write((("a", "M1_EN", 1.0), ("a", "M1_POS_ABS", target + position / 100)))
            yield do.Until("idle")

    world = small()
    world.script(operator)
    world.run(for_=1.0)
    snapshot = world.snapshot()
    world.run(for_=20)
    digest = world.trace.digest()
    other = world.branch()
    world.restore(snapshot)
    world.run(for_=20)
    assert world.trace.digest() == other.trace.digest() == digest


# ---------------------------------------------------------------------- random worlds

MOVES = st.lists(
    st.tuples(
        st.sampled_from("abc"), st.sampled_from(["POS_ABS", "POS_REL", "VEL_ABS"]), st.integers(-80, 80), st.integers(0, 2000)
    ),
    max_size=8,
)
PARTS = st.lists(
    st.sampled_from(
        [
            '[[wire]]\nfrom = "a.OUT2"\nto = "c.IN7"\ninverted = true\n',
            '[[wire]]\nfrom = "c.M1_EN"\nto = "b.IN5"\ndelay = "3 ms"\n',
            '[[axis]]\nname = "y"\ndrive = "b.M1"\nbacklash = 3.0\ntravel = [-50.0, 60.0]\npulses_per_unit = 1.0\n',
            (
                '[[axis]]\nname = "z"\ndrive = "c.M1"\npulses_per_unit = 1.0\ninverted = true\n'
                '[[axis.switch]]\nposition = 10.0\nwidth = 5.0\nto = "c.IN2"\nbounce = "4 ms"\n'
            ),
            '[[source]]\nto = "b.AIN1"\nkind = "sine"\nvalue = 5.0\namplitude = 3.0\n',
            '[[event]]\nwhen = "x.position > 60"\nsteps = [{ press = "go", for = "100 ms" }, { write = { "a.OUT1" = 1 } }]\n',
            '[[event]]\nevery = "700 ms"\nsteps = [{ write = { "b.M1_EN" = 1, "b.M1_POS_REL" = 13.0 } }]\n',
        ]
    ),
    unique=True,
)


def acted(world: World, moves: list) -> World:
    for name, register, value, pause in moves:
        world.mic488[name].write("M1_EN", 1)
        world.mic488[name].write(f"M1_{register}", float(value))
        world.run(for_=pause / 1000)
    return world


@settings(max_examples=15, deadline=None)
@given(parts=PARTS, moves=MOVES, cuts=st.lists(st.integers(1, 3000), max_size=4))
def test_random_worlds_do_the_same_again_in_pieces_and_from_a_snapshot(parts: list[str], moves: list, cuts: list[int]) -> None:
    text = dedent(SMALL) + "".join(parts)
    first = acted(World.from_toml(text), moves)
    snapshot = first.snapshot()
    first.run(for_=12)
    second = acted(World.from_toml(text), moves)
    for cut in cuts:
        second.run(for_=cut / 1000)
        second.restore(second.snapshot())
        second.settle_all()
    second.run(until=first.time)
    assert second.trace.digest() == first.trace.digest()
    third = first.branch(snapshot)
    third.run(for_=12)
    assert third.trace.digest() == first.trace.digest()
    assert list(third.trace) == list(first.trace)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_run_as_their_scripts_expect(path: Path) -> None:
    world = World.load(path)
    world.run(for_="30 s")
    assert list(world.failures) == []


def test_the_page_about_worlds_does_what_it_says(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    root = Path(__file__).parents[2]
    page = (root / "docs" / "worlds.md").read_text()
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    (toml,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    monkeypatch.chdir(root)
    exec(compile(code, "worlds.md", "exec"), {})
    *_, gentle, hasty = capsys.readouterr().out.split("\n")[:-1]
    assert gentle.endswith(" 0")
    assert int(hasty.split()[1]) < -10_000
    world = World.from_toml(toml)
    world.run(for_=60)
    assert list(world.failures) == []


# ---------------------------------------------------------------------- what scripts cost


LOOKED_AT = """
    [[mic488]]
    name = "c{n}"
    [mic488.M1]
    acc = 20000.0
    dec = 20000.0
    vel = 8000.0
    [[script]]
    name = "s{n}"
    repeat = 3
    steps = [
      {{ write = {{ "c{n}.M1_EN" = 1, "c{n}.M1_POS_ABS" = 500 }} }},
      {{ until = "c{n}.M1.status == 4" }},
      {{ wait = "{n} ms" }},
      {{ write = {{ "c{n}.M1_POS_ABS" = 0 }} }},
      {{ until = "c{n}.M1.position <= 0 and not c{n}.IN3" }},
    ]
"""


@pytest.mark.parametrize("until", [None, "idle and time > 30"])
def test_scripts_that_watch_are_looked_at_for_what_they_watch_alone(until: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    counted: dict[str, int] = {}

    def counting(owner: type, name: str) -> None:
        inner = getattr(owner, name)

        def call(*args: Any) -> Any:
            counted[name] = counted.get(name, 0) + 1
            return inner(*args)

        monkeypatch.setattr(owner, name, call)

    counting(Condition, "holds")
    counting(Condition, "__init__")
    counting(Kernel, "advance")
    found = []
    for controllers in (5, 20):
        world = World.from_toml("".join(dedent(LOOKED_AT).format(n=n) for n in range(1, controllers + 1)))
        counted.clear()
        world.run(for_=20, until=until)
        ended = [script for script in world.scripts if not script.ended]
        assert ended == [], "scripts have not come to their end"
        found.append({name: count / controllers for name, count in counted.items()})
    few, many = found
    for name in few:
        assert many[name] <= 1.5 * few[name], f"{name} is called {few[name]:g} times a controller with 5, {many[name]:g} with 20"


def test_idle_is_found_whichever_machine_comes_to_rest_last() -> None:
    for order in ((20.0, 5.0), (5.0, 20.0)):
        world = small()
        for name, distance in zip("ab", order, strict=True):
            world.mic488[name].axis[1].enable()
            world.mic488[name].axis[1].move_to(distance)
        world.run(until="idle")
        ends = [world.mic488[name].device.axes[0].profile.end for name in "ab"]
        assert world.now == max(end for end in ends if end is not None)
        world.mic488["b"].axis[1].move_by(1.0)
        assert world.run(until="not idle", for_=1) == "not idle"
        assert world.run(until="idle") == "idle"


# ---------------------------------------------------------------------- writes on lines

TIMED = """
    [[line]]
    name = "bus"
    timing = "real"
    [[mic488]]
    name = "a"
    line = "bus"
    [[mic488]]
    name = "b"
    line = "bus"
    unit = 2
"""


def timed(steps: str, more: str = "") -> World:
    return World.from_toml(dedent(TIMED) + f'[[script]]\nname = "operator"\nsteps = [{steps}]\n' + dedent(more))


def test_a_write_waits_for_its_answer_so_that_what_follows_sees_what_it_did() -> None:
    move = '{{ write = {{ "a.M1_EN" = 1, "a.M1_POS_ABS" = {} }} }}, {{ until = "a.M1.status == 4" }}'
    there = '{{ expect = "a.M1.position == {}" }}'
    world = timed(", ".join(f"{move}, {there}".format(target, target) for target in (5, 10, 2)))
    world.run(for_=30)
    assert list(world.failures) == []
    assert world.scripts == []


def test_requests_of_scripts_go_one_after_the_other() -> None:
    world = timed(
        '{ write = { "a.M1_EN" = 1, "b.M1_EN" = 1, "a.OUT1" = 1 } }, { note = "done" }',
        """
        [[script]]
        name = "other"
        steps = [{ write = { "b.OUT1" = 1 } }, { note = "other" }]
        """,
    )
    world.run(for_=1)
    frames = [(record.subject, record.time) for record in world.trace.frames("bus")]
    assert [subject for subject, _ in frames] == ["script/in", "script/out"] * 4
    silence = [after - before for (_, before), (_, after) in zip(frames[1::2], frames[2::2], strict=False)]
    assert min(silence) >= 35 * SECOND // 38400, "less than 3.5 characters between an answer and the next request"
    notes = {record.value: record.time for record in world.trace.events("world")}
    assert notes["done"] == frames[5][1]
    assert notes["other"] == frames[7][1]


def test_a_write_without_an_answer_is_told_and_the_script_goes_on() -> None:
    world = timed(
        '{ write = { "a.M1_EN" = 1 } }, { note = "after" }',
        """
        [[fault]]
        kind = "no-answer"
        """,
    )
    world.run(for_=5)
    assert [record.value for record in world.overdue] == ["operator waited in vain for an answer on bus"]
    assert [record.value for record in world.trace.events("world")] == ["operator waited in vain for an answer on bus", "after"]
    assert world.overdue[0].time == SECOND


@pytest.mark.parametrize("moment", [0.0, 0.001, 0.004, 0.0123, 0.02, 0.0301])
def test_a_snapshot_between_requests_and_answers_changes_nothing(moment: float) -> None:
    steps = '{ write = { "a.M1_EN" = 1, "b.M1_EN" = 1, "a.M1_POS_ABS" = 3 } }, { until = "a.M1.status == 4" }'
    whole, cut = timed(steps), timed(steps)
    whole.run(for_=5)
    cut.run(for_=moment)
    branch = cut.branch()
    for world in (cut, branch):
        world.run(until=5)
        assert world.trace.digest() == whole.trace.digest()


def test_a_request_needs_a_line_of_controllers() -> None:
    world = World.from_toml('[[line]]\nname = "chips"\nkind = "m1486"\n[[m1486]]\nname = "a"\nline = "chips"\n')
    with pytest.raises(Misuse, match="line 'chips' is of kind m1486: requests need one of kind modbus"):
        world.outside(do.Request("chips", 1, b"\x03\x27\x19\x00\x01", SECOND))


# ---------------------------------------------------------------------- what is kept


def test_scripts_that_have_ended_are_forgotten() -> None:
    world = small('[[event]]\nevery = "100 ms"\nsteps = [{ press = "go", for = "10 ms" }]\n')
    world.run(for_=10.05)
    assert [script.name for script in world.scripts] == ["event-1"]
    world.run(until=10.105)
    branch = world.branch()
    assert [script.name for script in branch.scripts] == ["event-1", "release go"]
    branch.press("go", 1)
    assert [script.name for script in branch.scripts] == ["event-1", "release go"]
    branch.run(for_=0.05)
    assert branch.mic488["b"].pins["IN4"] == 1.0


def test_a_compiled_image_runs_like_a_program_with_its_own_table(tmp_path: Path) -> None:
    table, _ = parse_positions("A;1;x;x;x\nB;7;x;x;x\n")
    executable = check("M1 = ON\nMOVEPTP 1\nWAITPOS\nOUT1 = ON\nWAIT IN1 = ON\n", table).executable
    assert executable is not None
    data, refused = build(executable, table)
    assert (data is None, refused) == (False, [])
    (tmp_path / "a.wbc").write_bytes(data or b"")
    (tmp_path / "w.toml").write_text('[[mic488]]\nname = "a"\nprogram = "a.wbc"\nstart = true\n')
    world = World.load(tmp_path / "w.toml")
    world.run(for_="20 s")
    assert world.mic488["a"].axis[1].position == 7.0


def test_a_step_that_goes_back_in_time_goes_on_from_there() -> None:
    """What a script does after it has restored a snapshot is what the restored script does."""
    world = small()
    went_back: list[float] = []

    def go_back() -> None:
        if not went_back:
            went_back.append(world.time)
            world.restore(before)

    def operator() -> Steps:
        yield do.Wait(SECOND)
        yield do.Call(go_back)
        yield do.Note("after it")

    world.script(operator)
    world.run(until=0.5)
    before = world.snapshot()
    world.run(until=1)
    assert went_back == [1.0]
    world.run(until=3)
    assert [(record.time, record.value) for record in world.trace.events("world")] == [(SECOND, "after it")]
    assert world.scripts == []
