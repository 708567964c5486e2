"""The debugger of programs in worlds: breakpoints, steps, values, and going back in time."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from debug_rig import BOTH, ONE, make, started
from hypothesis import given, settings
from hypothesis import strategies as st

from steptwin.controller import MILLISECOND, SECOND
from steptwin.debug.breakpoints import Breakpoint
from steptwin.debug.debugger import Debugger
from steptwin.debug.values import DataPoint, Events, LabelPoint, LinePoint, Stopped, StopReason
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.simulation.world.simulation import Simulation


def line(debugger: Debugger, controller: str = "m") -> int:
    return debugger.stack(controller)[0].location.line


def at(number: int, **more: str) -> LinePoint:
    return LinePoint(controller="m", text="program 0", line=number, **more)


def state(world: Simulation) -> str:
    """All state of a world, as text. A controller at rest may know a moment before: looking at it does not count as a change."""
    for controller in world.controllers.values():
        controller.advance(world.now)
    found = world.snapshot(with_inputs=False)
    text = repr((found.now, found.schedulers, found.scripts, found.faults_state, world.trace.digest()))
    return re.sub(r" at 0x[0-9a-f]+", "", text)


# ---------------------------------------------------------------------- the property


Act = tuple[str, int]
ACTS = st.lists(
    st.tuples(
        st.sampled_from(("in", "over", "out", "back", "run", "run back", "set", "go", "branch")),
        st.integers(0, 100),
    ),
    max_size=20,
)


def act(debugger: Debugger, what: str, number: int) -> None:
    controller = debugger.threads[number % 2]
    match what:
        case "in":
            debugger.step_in(controller)
        case "over":
            debugger.step_over(controller)
        case "out":
            debugger.run(debugger.now + number * MILLISECOND)
        case "back":
            debugger.step_back(controller)
        case "run":
            debugger.run(debugger.now + 100 * MILLISECOND)
        case "run back":
            debugger.run_back()
        case "set" if not debugger.is_past:
            debugger.set_value("m", "IN3", str(number % 2))
        case "go":
            debugger.go(debugger.begin + (debugger.present - debugger.begin) * number // 100)
        case "branch" if number > 90:
            debugger.branch()


@settings(max_examples=25, deadline=None)
@given(ACTS)
def test_however_one_goes_every_moment_is_as_it_was(acts: list[Act]) -> None:
    debugger = Debugger(make(world=BOTH))
    debugger.set_breakpoints([at(8), at(3, condition="n % 3 = 0"), LabelPoint(label="INT_IN3")])
    seen: dict[int, str] = {}
    for what, number in acts:
        if what in ("set", "branch"):
            # What is done at a moment changes it, and what follows.
            seen = {moment: text for moment, text in seen.items() if moment < debugger.now}
        act(debugger, what, number)
        now = debugger.now
        assert seen.setdefault(now, state(debugger.view)) == state(debugger.view)
    for moment, text in seen.items():
        if moment <= debugger.present:
            debugger.go(moment)
            assert state(debugger.view) == text


def test_a_world_that_is_debugged_does_what_it_does_without() -> None:
    plain = make(world=BOTH)
    plain.run_to(SECOND)
    debugger = Debugger(make(world=BOTH))
    debugger.set_breakpoints([at(8), LinePoint(controller="c", text="program", line=8)])
    while debugger.run(SECOND).reason is not StopReason.LIMIT:
        debugger.step_back("c")
        debugger.step_in("c")
    assert debugger.view.trace.digest() == plain.trace.digest()


# ---------------------------------------------------------------------- steps


def test_steps_of_wbc() -> None:
    debugger = started()
    lines = [line(debugger)]
    for _ in range(5):
        assert debugger.step_in("m").reason is StopReason.STEP
        lines.append(line(debugger))
    assert lines == [1, 3, 4, 8, 9, 10]
    assert [frame.name for frame in debugger.stack("m")] == ["COUNT", "MAIN"]
    assert [frame.location.line for frame in debugger.stack("m")] == [10, 5]


def test_a_call_is_stepped_over_and_out_of_and_a_delay_takes_its_time() -> None:
    debugger = started()
    debugger.step_over("m")
    debugger.step_over("m")
    assert line(debugger) == 4
    before = debugger.now
    debugger.step_over("m")
    assert (line(debugger), debugger.now - before) == (5, 4 * MILLISECOND)
    debugger.step_over("m")
    assert line(debugger) == 6
    assert debugger.now - before >= 50 * MILLISECOND
    debugger.step_over("m")  # JUMP MAIN comes never back: as a step in
    assert line(debugger) == 3
    debugger.step_in("m")
    debugger.step_in("m")
    assert line(debugger) == 8
    debugger.step_out("m")
    assert line(debugger) == 5


def test_steps_of_an_m1486_and_both_controllers_are_threads() -> None:
    debugger = started(world=BOTH)
    assert debugger.threads == ["m", "c"]
    lines = [line(debugger, "c")]
    for _ in range(5):
        debugger.step_over("c")
        lines.append(line(debugger, "c"))
    assert lines == [4, 5, 6, 5, 6, 7]
    debugger.step_over("c")  # '2
    assert line(debugger, "c") == 8
    assert line(debugger, "m") != 1


def test_step_back_goes_through_the_same_statements_in_reverse() -> None:
    debugger = started()
    lines = []
    for _ in range(12):
        lines.append((line(debugger), debugger.now))
        debugger.step_in("m")
    for known in reversed(lines):
        assert debugger.step_back("m").reason is StopReason.STEP
        assert (line(debugger), debugger.now) == known
        assert debugger.is_past
    assert debugger.step_back("m") == Stopped(StopReason.BEGIN, 0, text="no older moment is kept")
    for known in lines:
        debugger.step_in("m")
        assert (line(debugger), debugger.now) == known


def test_a_pause_in_a_delay_goes_back_to_its_beginning() -> None:
    debugger = started()
    debugger.run(30 * MILLISECOND)
    assert line(debugger) == 5
    debugger.step_back("m")
    assert (line(debugger), debugger.now) == (5, 7 * MILLISECOND - 1)


# ---------------------------------------------------------------------- breakpoints


def test_a_breakpoint_stops_before_its_statement_forwards_and_backwards() -> None:
    debugger = started()
    (point,) = debugger.set_breakpoints([at(7)])
    assert (point.line, point.is_set) == (8, True)  # line 7 has no statement
    stops = [debugger.run() for _ in range(3)]
    assert [(stop.reason, stop.points) for stop in stops] == [(StopReason.BREAKPOINT, (point.number,))] * 3
    assert line(debugger) == 8
    assert debugger.evaluate("m", "n").number == 3.0
    back = [debugger.run_back() for _ in range(3)]
    assert back[:2] == stops[1::-1]
    assert back[2].reason is StopReason.BEGIN
    assert debugger.run() == stops[0]


def test_conditions_hit_counts_and_logs() -> None:
    debugger = started()
    logged: list[str] = []
    debugger.on_log = lambda entry: logged.append(entry.text)
    debugger.set_breakpoints([at(8, condition="n > 2 and OUT1 = OFF"), at(9, log="n is {n}, twice {n * 2}")])
    debugger.run()
    assert debugger.evaluate("m", "n").number == 3.0
    assert logged == ["n is 1, twice 2", "n is 2, twice 4"]
    debugger.run_back()
    debugger.run()
    assert len(logged) == 2  # once
    debugger.set_breakpoints([at(8, hits="% 3")])
    debugger.run()
    debugger.run()
    assert debugger.evaluate("m", "n").number == 8.0


def test_a_condition_that_cannot_be_calculated_stops() -> None:
    debugger = started()
    debugger.set_breakpoints([at(8, condition="unknown = 5")])
    assert debugger.run().reason is StopReason.BREAKPOINT


def test_a_condition_on_another_controller() -> None:
    debugger = started(world=BOTH)
    debugger.set_breakpoints([at(8, condition="c.variable > 30")])
    debugger.run()
    assert line(debugger) == 8
    assert debugger.evaluate("m", "c.variable").number > 30.0  # type: ignore[operator]


AXIS = '[[axis]]\nname = "x"\ndrive = "m.M1"\npulses_per_unit = 100\nunit = "mm"\n'


@pytest.mark.parametrize("condition", ["n = 3 and x.position < 1 cm", "n = 3 and c.variable >= 0", "m.OUT1 = 0 and n = 3"])
def test_a_condition_with_signals_is_decided_while_the_world_runs(condition: str, monkeypatch: pytest.MonkeyPatch) -> None:
    debugger = started(world=BOTH + AXIS)
    assert [one.is_set for one in debugger.set_breakpoints([at(8, condition=condition)])] == [True]
    looked: list[int] = []
    monkeypatch.setattr(Breakpoint, "holds", lambda point, controller, now: looked.append(now))
    assert debugger.run().reason is StopReason.BREAKPOINT
    assert (line(debugger), debugger.evaluate("m", "n").number) == (8, 3.0)
    assert looked == []


def test_conditions_of_two_controllers_on_each_other() -> None:
    """One of them has gone ahead where the other one executes a statement: there the world is looked at once more."""
    debugger = started(world=BOTH)
    points = [at(8, condition="c.variable >= 0"), LinePoint(controller="c", text="program", line=8, condition="m.OUT2 = 0")]
    assert [one.is_set for one in debugger.set_breakpoints(points)] == [True, True]
    stops = [debugger.run() for _ in range(4)]
    assert {stop.controller for stop in stops} == {"m", "c"}
    for stop in reversed(stops[:-1]):
        assert debugger.run_back().time == stop.time
    alone = started(world=BOTH)
    alone.set_breakpoints(points[1:])
    assert next(stop for stop in stops if stop.controller == "c").time == alone.run().time


def test_a_log_with_a_condition_on_a_signal_does_not_stop() -> None:
    debugger = started(world=BOTH)
    logged: list[str] = []
    debugger.on_log = lambda one: logged.append(one.text)
    debugger.set_breakpoints([at(8, log="n is {n}", condition="c.variable >= 0")])
    assert debugger.run(200 * MILLISECOND).reason is StopReason.LIMIT
    assert logged[:3] == ["n is 1", "n is 2", "n is 3"]


def test_a_label_and_an_interrupt() -> None:
    debugger = started()
    (label, interrupt) = debugger.set_breakpoints([LabelPoint(label="count"), LabelPoint(label="INT_IN3")])
    assert label.is_set
    assert interrupt.is_set
    assert debugger.run().reason is StopReason.FUNCTION
    assert line(debugger) == 8


def test_a_data_breakpoint_stops_after_the_change() -> None:
    debugger = started()
    debugger.set_breakpoints([DataPoint(controller="m", name="n")])
    assert debugger.run() == Stopped(StopReason.DATA, MILLISECOND * 2, "m", "n: 0 → 1", (1,))
    debugger.set_breakpoints([DataPoint(controller="m", name="OUT1", condition="= 1")])
    stops = [debugger.run() for _ in range(2)]
    assert [stop.reason for stop in stops] == [StopReason.DATA] * 2
    assert line(debugger) == 9
    assert debugger.run_back() == stops[0]


def test_a_program_error_is_an_event_to_stop_at() -> None:
    debugger = started("n = 0\nx = 5 / n\nEND\n")
    debugger.set_events([Events.PROGRAM_ERROR])
    stop = debugger.run()
    assert (stop.reason, stop.time, stop.text) == (StopReason.EXCEPTION, 2 * MILLISECOND, "line 2: division by zero")


AN_AXIS = '[[mic488]]\nname = "m"\nprogram = "p"\nconfig = "c"\nstart = true\n'
A_MOVE = {"p": b"M1 = ON\nPABS M1 -100\nWAITPOS\nEND\n"}
TYPED = (
    '[[line]]\nname = "bus"\nkind = "m1486"\n[[m1486]]\nname = "m"\nline = "bus"\nprogram = "p"\n'
    '[[script]]\nname = "s"\nsteps = [{ wait = "1 s" }, { send = "bus", text = "V9\\r" }]\n'
)


@pytest.mark.parametrize(
    ("event", "world", "files", "text"),
    [
        (
            Events.LIMIT,
            AN_AXIS + '[[axis]]\nname = "x"\ndrive = "m.M1"\n[[axis.switch]]\nto = "m.IN1"\nbelow = -5\n',
            A_MOVE | {"c": b"[Axis0]\nLimitMode=1\nInKL=0\n"},
            "M1 stopped by KL",
        ),
        (
            Events.POSITION_ERROR,
            AN_AXIS + '[[event]]\nat = 0\nsteps = [{ couple = "m.M1", to = "blocked" }]\n',
            A_MOVE | {"c": b"[Axis0]\nPosCtrlMode=1\nErrCtrlMode=2\n"},
            "M1 did not reach its position",
        ),
        (Events.WRONG_DATA, TYPED, {"p": b"[\n@1\nW1000\nJ1\n]\n"}, ""),
    ],
)
def test_other_events_to_stop_at(event: Events, world: str, files: dict[str, bytes], text: str) -> None:
    debugger = Debugger(World.from_toml(world, files, keep_trace=False, keep_inputs=False))
    debugger.set_events([event])
    stop = debugger.run(5 * SECOND)
    assert stop.reason is StopReason.EXCEPTION
    assert text in stop.text
    assert debugger.evaluate("m", "M1.position" if text else "position").text


@pytest.mark.parametrize(
    ("point", "problem"),
    [
        (at(99), "no statement is in line 99 of m.prg or after it"),
        (at(1, condition="y.position > 3"), "'y.position' means nothing to m (did you mean 'M1.position'?): its variables are n"),
        (DataPoint(controller="m", name="OTU1"), "'OTU1' means nothing to m (did you mean 'OUT1'?): its variables are n"),
        (DataPoint(controller="m", name="n", condition="n > mm"), "'mm' means nothing to m: its variables are n"),
        (at(1, condition="n >"), "expression 'n >' ends too early: expected a name or a number"),
        (at(1, condition="n = = 2"), "expression 'n = = 2', column 5: found '=', expected a name or a number"),
        (at(1, hits="0"), "hit count '0': expected a number from 1 on, after nothing, or one of = < <= > >= %"),
        (at(1, log="{n"), "log '{n': a brace has no partner"),
        (LabelPoint(label="MIAN"), "no label is called 'MIAN' (did you mean 'MAIN'?); there are MAIN, COUNT, INT_IN3"),
        (LinePoint(controller="x", text="program 0", line=1), "'x' has no program: m has one"),
        (LinePoint(controller="m", text="program 3", line=1), "m has no text 'program 3': texts are program 0"),
    ],
)
def test_what_is_no_breakpoint_has_its_reason(point: LinePoint, problem: str) -> None:
    (found,) = started().set_breakpoints([point])
    assert not found.is_set
    assert found.problem == problem


# ---------------------------------------------------------------------- the past, and ends


def test_the_past_cannot_be_changed_unless_it_becomes_a_branch() -> None:
    debugger = started()
    debugger.run(200 * MILLISECOND)
    debugger.go(100 * MILLISECOND)
    with pytest.raises(Misuse, match=r"n cannot be set 0.1 s before the present: branch"):
        debugger.set_value("m", "n", "100")
    debugger.branch()
    assert (debugger.present, debugger.is_past) == (100 * MILLISECOND, False)
    debugger.set_value("m", "n", "100")
    debugger.run(200 * MILLISECOND)
    assert debugger.evaluate("m", "n").number > 100  # type: ignore[operator]


@pytest.mark.parametrize(
    ("do", "problem"),
    [
        (lambda d: d.set_value("m", "OUT1", "1"), "'OUT1': "),
        (lambda d: d.set_value("m", "nothing", "1"), "'nothing' cannot be set"),
        (lambda d: d.evaluate("m", "nothing"), "'nothing' means nothing to m: its variables are n"),
        (lambda d: d.evaluate("m", "1 / 0"), "division by zero"),
        (lambda d: d.scope("m", "x"), "no group of values is called 'x'"),
        (lambda d: d.stack("x"), "no controller is called 'x'"),
        (lambda d: d.go(5 * SECOND), "5 s: the past is kept from 0 s to 999.999 us"),
    ],
)
def test_what_cannot_be_done_has_its_reason(do: Callable[[Debugger], object], problem: str) -> None:
    with pytest.raises(Misuse, match=problem):
        do(started())


def test_programs_without_statement_time_are_refused() -> None:
    world = make(world=f'{ONE}statement_time = "0"\n')
    with pytest.raises(Misuse, match="m: statement_time = 0"):
        Debugger(world)


# ---------------------------------------------------------------------- the end


def test_the_end_of_a_program_is_where_nothing_happens_any_more() -> None:
    debugger = started("n = 1\nEND\n")
    stop = debugger.run()
    assert (stop.reason, stop.text) == (StopReason.IDLE, "the program has ended")
    assert debugger.has_ended
    debugger.step_back("m")
    assert line(debugger) == 2


def test_a_wait_that_nothing_ends_is_named() -> None:
    debugger = started("n = 1\nWAIT IN1 = 1\nEND\n")
    stop = debugger.run()
    assert (stop.reason, stop.text) == (StopReason.IDLE, "nothing will happen any more: m waits for ever in line 2")
    debugger.set_value("m", "IN1", "1")
    debugger.step_over("m")
    assert line(debugger) == 3


def test_a_run_in_parts_can_be_ended_anywhere() -> None:
    debugger = started()
    travel = debugger.running()
    for _ in range(10):
        next(travel)
    travel.close()
    stop = debugger.pause()
    assert stop.reason is StopReason.PAUSE
    assert stop.time == debugger.now > SECOND
    debugger.step_over("m")
    debugger.step_back("m")


def test_a_breakpoint_that_no_run_comes_to_says_so() -> None:
    program = "n = 1\nMAIN:\n    n = n + 1\nJUMP MAIN\nOUT1 = ON\nJUMP OUTSIDE\nOUTSIDE:\nRETURN\nINT_IN3:\n    n = 5\nRETURN\n"
    debugger = Debugger(make(program))
    debugger.run_to_entry()
    points = [at(1), at(3), at(5), at(8), at(10), LabelPoint(label="OUTSIDE")]

    def notes() -> list[str]:
        found = debugger.set_breakpoints(points)
        assert all(point.is_set for point in found)
        return [point.note for point in found]

    dead = ["no way of the program leads to line 5", "no way of the program leads to line 8"]
    assert notes() == ["", "", *dead, "", "no way of the program leads to line 8"]
    debugger.run()
    debugger.step_in("m")
    once = "from where it is, the program comes to line 1 only if it is started again"
    assert notes() == [once, "", *dead, "", "no way of the program leads to line 8"]
    debugger.step_back("m")
    debugger.step_back("m")
    assert (line(debugger), notes()[0]) == (1, "")


def test_a_command_of_an_m1486_that_was_executed_at_power_on() -> None:
    debugger = Debugger(make(world=BOTH))
    found = debugger.set_breakpoints([LinePoint(controller="c", text="program", line=number) for number in (2, 5, 10)])
    once = "from where it is, the program comes to line 2 only if it is started again"
    assert [point.note for point in found] == [once, "", ""]
