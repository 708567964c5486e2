"""What holds for every program: it is deterministic, resting and looking change nothing, snapshots are complete."""

from __future__ import annotations

import pickle
from dataclasses import replace
from functools import partial
from typing import Any
from unittest.mock import patch

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.mic488.config import AxisConfig, ControllerConfig, InputConfig
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.program_banks import LoadedProgram, load
from steptwin.wbc import code
from steptwin.wbc.check import check
from steptwin.wbc.positions import PositionTable, parse_positions

AXES = (
    AxisConfig(gear=10.0, acc=500.0, dec=800.0, vel=60.0, in_kl=0, limit_mode=1),
    AxisConfig(gear=10.0, acc=500.0, dec=500.0, vel=60.0),
    AxisConfig(gear=3.0, acc=50.0, dec=20.0, vel=90.0, pos_ctrl_mode=1, err_ctrl_mode=1),
    AxisConfig(),
)
CONFIG = replace(ControllerConfig(), axes=AXES, inputs=(InputConfig(), *(InputConfig(interrupt=1),) * 19))

Act = tuple[Nanos, str, Any]
_WRITE = bytes.fromhex("10 0000 0002 04")


def acts() -> SearchStrategy[list[Any]]:
    """What happens to a controller meanwhile: pins, writes of a master, pauses."""
    pin = st.tuples(st.just("pin"), st.tuples(st.integers(1, 20), st.booleans()))
    write = st.tuples(st.just("write"), st.binary(min_size=4, max_size=4))
    control = st.tuples(st.just("control"), st.sampled_from((1, 2, 2, 1)))
    volts = st.tuples(st.just("volts"), st.integers(0, 10))
    moment = st.one_of(st.integers(0, 1800).map(lambda ms: ms * MILLISECOND), st.integers(0, 2 * SECOND))
    act = st.tuples(moment, st.one_of(pin, pin, write, control, volts)).map(lambda a: (a[0], *a[1]))
    return st.lists(act, max_size=12).map(lambda found: sorted(found, key=lambda a: a[0]))


def ready(text: str, rows: str) -> tuple[LoadedProgram, PositionTable]:
    table, _ = parse_positions(rows)
    return load(check(text, table)), table


def started(
    loaded: tuple[LoadedProgram, PositionTable], statement_time: Nanos = MILLISECOND, *, rests: bool = True
) -> Mic488Device:
    program, table = loaded
    device = Mic488Device(CONFIG, programs={0: program}, positions={0: table}, statement_time=statement_time)
    device.program.interpreter.rests = rests
    device.command(partial(device.program.command, 1), 0)
    return device


def act(device: Mic488Device, one: Act) -> None:
    now, what, value = one
    if what == "pin":
        device.set_pin(f"IN{value[0]}", float(value[1]), now)
    elif what == "write":
        device.execute(_WRITE + value, now)
    elif what == "volts":
        device.set_pin("AIN1", float(value), now)
    else:
        device.command(partial(device.program.command, value), now)


def seen(device: Mic488Device) -> dict[str, Any]:
    """What there is to see of a controller, inside and outside, by name: a failure shows which of it differs."""
    control, now = device.program, device.now
    shown: dict[str, Any] = {
        "edges": device.take_edges(),
        "state": control.state,
        "statement": control.statement(now),
        "fault": control.fault,
        "user registers": {number: word for number, word in enumerate(device.user) if word},
        "events": [(event.time, event.code, event.text) for event in device.events],
    }
    for axis in device.axes:
        shown[f"M{axis.number}"] = axis.status, axis.coordinate_p(now), axis.profile.velocity(now)
    return shown


END = 2 * SECOND
STATEMENT_TIMES = (MILLISECOND, 700_001, 13 * MILLISECOND)


@pytest.fixture(scope="module")
def cases(programs: SearchStrategy[Any]) -> SearchStrategy[Any]:
    return st.tuples(programs, acts(), st.sampled_from(STATEMENT_TIMES))


few = settings(max_examples=12, deadline=None, suppress_health_check=list(HealthCheck))


@few
@given(data=st.data())
def test_wbc_18_resting_changes_nothing(data: st.DataObject, cases: SearchStrategy[Any]) -> None:
    program, happening, statement_time = data.draw(cases)
    loaded = ready(program.text, program.positions)
    resting, looking = (started(loaded, statement_time, rests=rests) for rests in (True, False))
    for one in happening:
        act(resting, one)
        act(looking, one)
    resting.advance(END)
    looking.advance(END)
    assert seen(resting) == seen(looking)


@st.composite
def polling(draw: st.DrawFn) -> str:
    """A program that looks again and again at what changes by itself, and now and then does something about it."""
    changing = (
        "PosM1",
        "VactM1",
        "PosM2",
        "VactM2",
        "TIMA1",
        "TIMB1",
        "ENC1",
        "XENC2",
        "M1",
        "M2",
        "StatM2",
        "AIN1",
        "$I0",
        "IN2",
    )
    number = st.integers(-60, 150).map(str)
    condition = st.tuples(
        st.sampled_from(changing), st.sampled_from(("=", "<", ">", "<=", ">=")), st.one_of(number, st.sampled_from(changing))
    ).map(" ".join)
    doing = st.one_of(
        st.sampled_from(
            ("OUT1 = ON", "OUT2 = OFF", "OUT3 = IN2", "TIMA1 = 0", "n = n + 1", "n = 3", "$I5 = n", "x = PosM1", "JUMP SUB")
        ),
        st.sampled_from(
            ("VABS M1 -30", "PABS M1 40", "PREL M2 -25", "BRAKE M2", "PosM1 = 0", "DELAY 0.02", "DELAY 0.137", "LimRM1 = 12")
        ),
        condition.map(lambda text: f"WAIT {text}"),
    )
    lines = [
        "M1 = ON",
        "M2 = ON",
        f"{draw(st.sampled_from(('VABS', 'PABS')))} M1 {draw(number)}",
        f"PABS M2 {draw(number)}",
        "L:",
    ]
    for _ in range(draw(st.integers(1, 4))):
        lines += [f"IF {draw(condition)}", *draw(st.lists(doing, max_size=2)), "ENDIF"]
        lines += draw(
            st.lists(st.sampled_from(("DELAY 0.05", "n = 7", "x = TIMB1", "JUMP SUB", "OUT4 = ON", "DELAY AIN1")), max_size=1)
        )
    lines += draw(st.sampled_from((["JUMP L"], [f"WHILE {draw(condition)}", "ENDWHILE", "JUMP L"], ["JUMP L"])))
    return "\n".join(["n = 0", *lines, "SUB:", "$I6 = n", "RETURN", "INT_IN3:", "$I7 = $I7 + 1", "RETURN", ""])


@settings(few, max_examples=40)
@given(text=polling(), happening=acts(), statement_time=st.sampled_from(STATEMENT_TIMES))
def test_wbc_18_polling_loops_rest_and_nobody_notices(text: str, happening: list[Act], statement_time: Nanos) -> None:
    loaded = ready(text, "A;1;2;3;4\n")
    resting, looking = (started(loaded, statement_time, rests=rests) for rests in (True, False))
    for one in happening:
        act(resting, one)
        act(looking, one)
        assert resting.program.statement(resting.now) == looking.program.statement(looking.now)
    resting.advance(END)
    looking.advance(END)
    assert seen(resting) == seen(looking)


ACTING = (
    *("PREL M1 1", "PREL M2 -3", "PABS M1 40", "VABS M1 -30", "VREL M2 1", "BRAKE M1", "STOP M2", "HOME M1 -20"),
    *("OUT1 = IN2", "OUTPUTS = 5", "$I5 = $I5 + 1", "PosM1 = 0", "M1 = ON", "M2 = OFF", "LimRM1 = 12", "VmaxM1 = 20"),
    *("CFGINT_IN3 = RIS", "TIMA1 = 0", "ENC1 = 7", "LinX = 3", "LinAcc = 9", "VisionNew = 0", "PULSE(OUT2, 0.05)"),
    *("MOVEPTP @A", "MOVELIN @A", "n = n + 1", "DELAY 0.02"),
)


@settings(few, max_examples=40)
@given(
    body=st.lists(st.sampled_from(ACTING), min_size=1, max_size=3),
    closed=st.sampled_from(("JUMP", "WHILE")),
    happening=acts(),
    statement_time=st.sampled_from(STATEMENT_TIMES),
)
@example(body=["PREL M1 1"], closed="JUMP", happening=[], statement_time=MILLISECOND)
@example(body=["$I5 = $I5 + 1"], closed="WHILE", happening=[], statement_time=MILLISECOND)
def test_wbc_18_a_loop_that_acts_never_rests(body: list[str], closed: str, happening: list[Act], statement_time: Nanos) -> None:
    loop = ["L:", *body, "JUMP L"] if closed == "JUMP" else ["WHILE 1 = 1", *body, "ENDWHILE"]
    loaded = ready("\n".join(["M1 = ON", "M2 = ON", "n = 0", *loop, "INT_IN3:", "$I7 = $I7 + 1", "RETURN", ""]), "A;1;2;3;4\n")
    resting, looking = (started(loaded, statement_time, rests=rests) for rests in (True, False))
    for one in happening:
        act(resting, one)
        act(looking, one)
        assert resting.program.statement(resting.now) == looking.program.statement(looking.now), one
    resting.advance(END)
    looking.advance(END)
    assert seen(resting) == seen(looking)


LARGE = f"3{'0' * 38}"
"""Near the end of what a variable holds."""


@st.composite
def calculating(draw: st.DrawFn, depth: int = 2) -> list[str]:
    """Lines that depend on variables and constants; now and then another one is between them."""
    operand = st.sampled_from(("a", "b", "n", "1", "-3,5", LARGE))
    condition = st.builds(" ".join, st.tuples(st.sampled_from("abn"), st.sampled_from(("=", "<", ">", "<=", ">=")), operand))
    operation = st.builds(" ".join, st.tuples(operand, st.sampled_from("+-*"), operand))
    line = st.builds("{} = {}".format, st.sampled_from("ab"), st.one_of(operand, operation))
    lines: list[str] = []
    for _ in range(draw(st.integers(1, 3))):
        lines += draw(st.lists(line, max_size=4))
        kind = draw(st.sampled_from(("other", "IF", "ELSE", "WHILE") if depth else ("other", "call")))
        if kind == "IF":
            lines += [f"IF {draw(condition)}", *draw(calculating(depth - 1)), "ENDIF"]
        elif kind == "ELSE":
            lines += [f"IF {draw(condition)}", *draw(calculating(depth - 1)), "ELSE", *draw(calculating(depth - 1)), "ENDIF"]
        elif kind == "WHILE":
            lines += ["WHILE n < 9", "n = n + 1", *draw(calculating(depth - 1)), "ENDWHILE"]
        else:
            lines += draw(st.lists(st.sampled_from(("a = b / 7", "$I3 = n", "a = PosM1", "JUMP SUB")), max_size=1))
    return lines


@settings(few, max_examples=30)
@given(lines=calculating(), looks=st.lists(st.integers(0, 200), max_size=20), hooked=st.sets(st.integers(0, 60), max_size=2))
@example(lines=[f"b = {LARGE} + {LARGE}", "b = n - b", "a = b"], looks=[], hooked=set())
@example(lines=["a = n + 1", "n = a * 1", "b = b + n"], looks=[7, 8], hooked={5})
def test_calculations_at_once_are_calculations_one_by_one(lines: list[str], looks: list[int], hooked: set[int]) -> None:
    ends = ("JUMP L", "SUB:", "n = n + 1", "a = n", "RETURN", "INT_TICK100:", "a = b", "RETURN")
    text = "\n".join(("CFGINT_TICK100 = HIGH", "a = 1", "b = 2", "L:", "n = 0", *lines, *ends))
    with patch.object(code, "COMPILED_AFTER", 3):
        loaded = ready(text, "")
        at_once, one_by_one = started(loaded), started(loaded)
        for device in (at_once, one_by_one):
            device.program.interpreter.rests_in_loops = False
        told: list[tuple[Nanos, int]] = []
        every: list[tuple[Nanos, int]] = []
        at_once.program.interpreter.add_hook(lambda now, number: told.append((now, number)), hooked)
        one_by_one.program.interpreter.add_hook(lambda now, number: every.append((now, number)))
        for moment in sorted({*looks, 300}):
            at_once.advance(moment * MILLISECOND)
            one_by_one.advance(moment * MILLISECOND)
            assert at_once.program.interpreter.copy_state() == one_by_one.program.interpreter.copy_state()
    assert seen(at_once) == seen(one_by_one)
    assert [now for now, _ in every] == [moment * MILLISECOND for moment in range(1, 301)]
    assert told == [(now, number) for now, number in every if number in hooked]


@few
@given(data=st.data())
def test_one_jump_is_many_steps(data: st.DataObject, cases: SearchStrategy[Any]) -> None:
    program, happening, statement_time = data.draw(cases)
    loaded = ready(program.text, program.positions)
    jumping, stepping = started(loaded, statement_time), started(loaded, statement_time)
    looks = data.draw(st.lists(st.integers(0, END), max_size=30))
    for moment, one in sorted([*((one[0], one) for one in happening), *((look, None) for look in looks)], key=lambda a: a[0]):
        stepping.advance(moment)
        assert stepping.deadline() is None or stepping.deadline() > moment  # type: ignore[operator]
        _ = stepping.program.statement(stepping.now)
        if one is not None:
            act(stepping, one)
            act(jumping, one)
    jumping.advance(END)
    stepping.advance(END)
    assert seen(jumping) == seen(stepping)


@few
@given(data=st.data())
def test_a_snapshot_at_any_moment_is_complete(data: st.DataObject, cases: SearchStrategy[Any]) -> None:
    program, happening, statement_time = data.draw(cases)
    loaded = ready(program.text, program.positions)
    one = started(loaded, statement_time)
    moment = data.draw(st.integers(0, END))
    for what in happening:
        if what[0] <= moment:
            act(one, what)
    one.advance(moment)
    one.take_edges()
    snapshot = pickle.loads(pickle.dumps(one.snapshot()))
    other = started(loaded, statement_time)
    other.restore(snapshot)
    for what in happening:
        if what[0] > moment:
            act(one, what)
            act(other, what)
    one.advance(END)
    other.advance(END)
    ends = seen(one)
    assert ends == seen(other)
    one.restore(snapshot)
    for what in happening:
        if what[0] > moment:
            act(one, what)
    one.advance(END)
    assert seen(one) == ends


@few
@given(data=st.data())
def test_wbc_24_without_statement_time_every_program_comes_to_an_end_of_each_moment(
    data: st.DataObject, cases: SearchStrategy[Any]
) -> None:
    program, happening, _ = data.draw(cases)
    loaded = ready(program.text, program.positions)
    one, other = started(loaded, 0), started(loaded, 0)
    for moment, *what in happening:
        soon = (moment // 100, *what)
        act(one, soon)
        other.advance(max(other.now, moment // 200))
        act(other, soon)
    end = max(one.now, other.now) + 10 * MILLISECOND
    one.advance(end)
    other.advance(end)
    assert seen(one) == seen(other)
