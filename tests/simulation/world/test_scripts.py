"""Scripts and events of a world: when they act, what they cost, how they talk to controllers."""

from __future__ import annotations

from functools import partial
from textwrap import dedent
from typing import Any

import pytest
from world_rig import small

from steptwin.controller import SECOND
from steptwin.errors import Misuse, Runaway
from steptwin.files.world import World
from steptwin.simulation.logic.condition import SignalCondition
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.steps import Steps
from steptwin.simulation.world import simulation


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
    assert [(f.time, f.value) for f in world.failures] == [(SECOND, "x.position < 49; x.position is 50 mm")]


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
    assert told == [(2, "overdue", "s waited in vain for x.position > 60; x.position is 50 mm"), (3, "note", "on")]
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


def test_a_signal_that_is_not_there_is_named_where_a_script_waits_for_it() -> None:
    def operator() -> Steps:
        yield do.Wait(SECOND)
        yield do.Until("x.nothing > 1")

    world = small()
    world.script(operator)
    with pytest.raises(Misuse, match=r"no signal 'x\.nothing'; there are position, lost, stalled"):
        world.run(for_=5)
    assert world.now == SECOND


def test_what_begins_in_a_restored_world_does_not_take_the_place_of_what_goes_on_there() -> None:
    world = small()
    world.press("go", 2.0)
    world.run(for_=0.5)
    snapshot = world.snapshot()
    other = small()
    other.restore(snapshot)
    other._scripts.schedule("note it", (do.Wait(SECOND // 2), do.Note("noted")))
    other.run(for_=1)
    assert [(r.time, r.value) for r in other.trace.events("world")] == [(SECOND, "noted")]
    assert other.read("go.pressed") == 1.0
    other.run(for_=1)
    assert other.read("go.pressed") == 0.0


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


JOINED = """
    [[wire]]
    from = "c{n}.OUT1"
    to = "c{next}.IN7"
"""
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


@pytest.mark.parametrize("wired", ["", JOINED], ids=["separate", "joined"])
@pytest.mark.parametrize("until", [None, "idle and time > 30"])
def test_scripts_that_watch_are_looked_at_for_what_they_watch_alone(
    until: str | None, wired: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where wires join all machines."""
    counted: dict[str, int] = {}

    def counting(owner: type, name: str) -> None:
        inner = getattr(owner, name)

        def call(*args: Any) -> Any:
            counted[name] = counted.get(name, 0) + 1
            return inner(*args)

        monkeypatch.setattr(owner, name, call)

    counting(SignalCondition, "holds")
    counting(SignalCondition, "__init__")
    counting(Scheduler, "advance")
    found = []
    for controllers in (5, 20):
        world = World.from_toml(
            "".join(dedent(LOOKED_AT + wired).format(n=n, next=n % controllers + 1) for n in range(1, controllers + 1))
        )
        counted.clear()
        world.run(for_=20, until=until)
        ended = [script for script in world.scripts if not script.ended]
        assert ended == [], "scripts have not come to their end"
        found.append({name: count / controllers for name, count in counted.items()})
    few, many = found
    for name in few:
        assert many[name] <= 1.5 * few[name], f"{name} is called {few[name]:g} times a controller with 5, {many[name]:g} with 20"


def test_idle_is_found_whichever_controller_comes_to_rest_last() -> None:
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


@pytest.mark.parametrize("line", ["", 'line = "bus"'], ids=["no line", "line"])
@pytest.mark.parametrize("timing", ["off", "real"])
def test_a_write_that_is_refused_is_told_and_the_script_goes_on(line: str, timing: str) -> None:
    """Of the values of a step those for the controllers of which one refused."""
    world = World.from_toml(
        f"""
        [[line]]
        name = "bus"
        timing = "{timing}"
        [[mic488]]
        name = "b"
        line = "bus"
        unit = 9
        [[mic488]]
        name = "a"
        {line}
        [[fault]]
        kind = "busy"
        address = "3"
        [[script]]
        name = "operator"
        steps = [
          {{ write = {{ "a.USER_REGISTER[2]" = 1, "a.USER_REGISTER[3]" = 2 }} }},
          {{ write = {{ "a.OUT1" = 1, "b.OUT1" = 1 }} }},
          {{ note = "after" }},
        ]
        """
    )
    world.run(for_=1)
    (late,) = world.overdue
    refused = "function 6 (06h) refused with exception 06 (device busy)"
    assert late.value == f"operator wrote a.USER_REGISTER[2] = 1, a.USER_REGISTER[3] = 2 in vain: {refused}"
    assert [record.value for record in world.trace.events("world")] == [late.value, "after"]


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
    with pytest.raises(Misuse, match="line 'chips' carries no Modbus: requests need a line of kind modbus"):
        world.apply_input(do.Request("chips", 1, b"\x03\x27\x19\x00\x01", SECOND))


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


def test_scripts_of_the_description_come_before_those_from_python() -> None:
    world = small('[[event]]\nat = "1 s"\nsteps = [{ note = "own" }]\n')
    world.at("1 s", do.Note("guest"))
    world.run(for_="2 s")
    assert [record.value for record in world.trace.events("world")] == ["own", "guest"]


def test_what_is_not_there_is_named() -> None:
    with pytest.raises(Misuse) as caught:
        small("").sync("nix")
    assert str(caught.value) == "no controller or line is called 'nix'; there are a, b, c"


def test_scripts_that_watch_are_resumed_in_their_order_also_where_one_makes_the_other_go_on() -> None:
    """The first comes true by a timed one, and what it does concerns the second, before the turn of the third."""
    events = (
        ("a.IN5", 'set = { "a.IN6" = 1 } }, { note = "first"'),
        ("a.IN6", 'note = "second"'),
        ("a.IN5", 'note = "third"'),
    )
    text = "".join(f"[[event]]\nwhen = '{when}'\nsteps = [{{ {steps} }}]\n" for when, steps in events)
    world = small(text + '[[event]]\nat = "1 s"\nsteps = [{ set = { "a.IN5" = 1 } }]\n')
    world.run(for_="2 s")
    assert [record.value for record in world.trace.events("world")] == ["first", "second", "third"]


@pytest.mark.parametrize("begun_before", [True, False])
def test_a_script_is_not_looked_at_that_another_one_has_called_off_at_the_same_moment(begun_before: bool) -> None:
    """When it has just begun to wait, and when what it waits for has come true."""

    def other() -> Steps:
        if not begun_before:
            yield do.Until("time >= 1")
        world._scripts.unschedule("guest")
        yield do.Note("called off")

    world = small()
    if not begun_before:
        world.start("other", other)
    world._scripts.schedule("guest", (do.Until("time >= 1"), do.Note("guest")))
    if begun_before:
        world.start("other", other)
    world.run(for_="2 s")
    moment = 0 if begun_before else SECOND
    assert [(record.time, record.value) for record in world.trace.events("world")] == [(moment, "called off")]


def test_conditions_that_are_true_at_once_for_ever_are_a_runaway(monkeypatch: pytest.MonkeyPatch) -> None:
    """After each of them others have their turn."""
    monkeypatch.setattr(simulation, "MOST_STEPS_PER_INSTANT", 20)

    def often(times: int) -> Steps:
        yield do.Wait(SECOND)
        for _ in range(times):
            yield do.Until("time >= 1")

    for times in (21, 22):
        world = small()
        world.script(partial(often, times), "often")
        if times == 21:
            world.run(for_=2)
            assert world.scripts == []
        else:
            with pytest.raises(Runaway, match="scripts loop without end at 1000000000 ns"):
                world.run(for_=2)
