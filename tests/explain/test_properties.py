"""What is explained holds when the program runs: random programs in the twin, with random inputs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from steptwin.controller import MILLISECOND, Nanos
from steptwin.diagnostics import SourceText
from steptwin.explain.mic488 import explain
from steptwin.explain.model import Explanation
from steptwin.mic488.config import AxisConfig, ControllerConfig
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.program_banks import load
from steptwin.wbc.check import check
from steptwin.wbc.positions import parse_positions

LABELS = ("A", "B", "C", "D")
CONDITIONS = ("IN1 = ON", "x > 2", "x < 5", "1 = 2", "1 = 1", "IN2 = 7", "x = 1", "IN2 = OFF", "TIMA1 > 3")
HANDLERS = ("IN1", "IN2", "TICK")
CONFIG = ControllerConfig(axes=(AxisConfig(gear=10.0, acc=5000.0, dec=8000.0, vel=600.0), *(AxisConfig(),) * 3))
POSITIONS = "one;1;x;x;x\ntwo;25.5;x;x;x\n"
RUN = 150 * MILLISECOND


@st.composite
def lines(draw: st.DrawFn, depth: int = 2) -> list[str]:
    found: list[str] = []
    for _ in range(draw(st.integers(1, 4))):
        kind = draw(st.integers(0, 9))
        if kind == 0 and depth:
            middle = ["ELSE", *draw(lines(depth - 1))] if draw(st.booleans()) else []
            found += [f"IF {draw(st.sampled_from(CONDITIONS))}", *draw(lines(depth - 1)), *middle, "ENDIF"]
        elif kind == 1 and depth:
            found += [f"WHILE {draw(st.sampled_from(CONDITIONS))}", *draw(lines(depth - 1)), "ENDWHILE"]
        elif kind <= 4:
            found.append(f"JUMP {draw(st.sampled_from(LABELS))}")
        elif kind == 5:
            found.append("RETURN")
        elif kind == 6:
            found.append(draw(st.sampled_from(("END", "PROGRESET", "DELAY 0.01", "WAIT IN1 = ON", "WAIT TIMA1 > 2", "JUMP A"))))
        else:
            found.append(draw(st.sampled_from(("x = x + 1", "x = 0", "OUT1 = ON", "TIMA1 = 0"))))
    return found


@st.composite
def wandering(draw: st.DrawFn) -> str:
    """Programs that jump anywhere: into subroutines, out of interrupts, past what nothing leads to."""
    handlers = draw(st.lists(st.sampled_from(HANDLERS), unique=True, max_size=2))
    found = ["x = 0"]
    found += [f"CFGINT_{event} = {4 if event == 'TICK' else draw(st.integers(1, 3))}" for event in handlers]
    found += draw(lines())
    for label in LABELS:
        found += [f"{label}:", *draw(lines())]
    found.append(draw(st.sampled_from(("END", "RETURN", "JUMP A"))))
    for event in handlers:
        found += [
            f"{draw(st.sampled_from(('INT_', 'HARDINT_')))}{event}:",
            *draw(st.one_of(lines(1), st.just(["x = 3"]))),
            "RETURN",
        ]
    return "\n".join(found) + "\n"


inputs = st.lists(st.tuples(st.integers(0, 150), st.integers(1, 2), st.booleans()), max_size=14).map(sorted)


def explained(text: str, rows: str | None = None) -> tuple[Explanation, Callable[[], Mic488Device]]:
    table = None if rows is None else parse_positions(rows)[0]
    checked = check(text, table)
    program = load(checked)
    positions = {} if table is None else {0: table}
    found = explain(SourceText("p.prg", text), checked, CONFIG)
    return found, lambda: Mic488Device(CONFIG, programs={0: program}, positions=positions)


def executed(device: Mic488Device, happens: list[tuple[int, int, bool]] = []) -> list[tuple[Nanos, int]]:  # noqa: B006 - never changed
    """Moments and numbers of the statements that are executed from the start on."""
    found: list[tuple[Nanos, int]] = []
    device.program.interpreter.rests_in_loops = False
    device.program.interpreter.add_hook(lambda now, number: found.append((now, number)))
    device.command(partial(device.program.command, 1), 0)
    for ms, number, on in happens:
        device.advance(max(device.now, ms * MILLISECOND))
        device.set_pin(f"IN{number}", float(on), device.now)
    device.advance(RUN)
    return found


@settings(max_examples=60, suppress_health_check=[HealthCheck.filter_too_much])
@given(wandering(), inputs)
def test_what_is_never_reached_is_never_executed(text: str, happens: list[tuple[int, int, bool]]) -> None:
    if check(text).executable is None:
        return
    found, device = explained(text)
    seen = {number for _, number in executed(device(), happens)}
    assert seen.isdisjoint(found.unreachable)
    in_blocks = {number for block in found.blocks for number in range(block.first, block.last + 1)}
    assert seen <= {*in_blocks, len(found.statements)}


@settings(max_examples=60, suppress_health_check=[HealthCheck.filter_too_much])
@given(wandering(), inputs)
def test_a_loop_that_is_never_left_is_never_left(text: str, happens: list[tuple[int, int, bool]]) -> None:
    if check(text).executable is None:
        return
    found, device = explained(text)
    order = [number for _, number in executed(device(), happens)]
    for loop in found.loops:
        if loop.left_by or not any(number in loop.statements for number in order):
            continue
        first = next(at for at, number in enumerate(order) if number in loop.statements)
        handlers = {number for number in order[first:] if number not in loop.statements}
        # Whatever else is executed belongs to interrupts, which all return.
        entries = [block.first for block in found.blocks if block.is_entry and block.first]
        assert not handlers or entries
        assert handlers <= _inside(found, entries)


def _inside(found: Explanation, entries: list[int]) -> set[int]:
    """The statements of blocks that are reached from interrupts."""
    by_first = {block.first: index for index, block in enumerate(found.blocks)}
    work, seen = [by_first[entry] for entry in entries], set()
    while work:
        index = work.pop()
        if index not in seen:
            seen.add(index)
            work += [way.target for way in found.blocks[index].ways if way.target is not None]
    return {n for index in seen for n in range(found.blocks[index].first, found.blocks[index].last + 1)}


def test_numbers_are_compared_as_the_controller_holds_them() -> None:
    """A REAL has 24 bits: these two are one number to it."""
    text = "IF 0,1 = 0,1000000001\nOUT1 = ON\nENDIF\nEND\n"
    found, device = explained(text)
    assert {number for _, number in executed(device())} >= {0, 1}
    assert found.unreachable == []


MOVES = (
    "PREL M1 10",
    "PREL M1 -3,5",
    "PABS M1 5",
    "PABS M1 40",
    "MOVEPTP @one",
    "MOVEPTP 1",
    "WAITPOS",
    "WAITPOS",
    "DELAY 0.01",
    "DELAY 0,0234",
    "x = x + 1",
    "PosM1 = 3",
    "BRAKE M1",
    "VABS M1 20",
    "STOP M1",
    "M1 = OFF",
    "M1 = ON",
    "IF IN1 = ON\nPREL M1 2\nENDIF",
)


@settings(max_examples=60)
@given(st.lists(st.sampled_from(MOVES), min_size=1, max_size=14))
def test_measured_durations_are_the_explained_ones(moves: list[str]) -> None:
    text = "\n".join(["M1 = ON", "PABS M1 7", "WAITPOS", "x = 0", *moves, "$I0 = x", "END"]) + "\n"
    found, device = explained(text, POSITIONS)
    order = executed(device())
    times = {number: now for now, number in order}
    measured = 0
    for block in found.blocks:
        for piece in block.pieces:
            end = piece.last if piece.wait else piece.last + 1
            if piece.first in times and end in times:
                assert times[end] - times[piece.first] == piece.duration, (text, piece)
                measured += 1
    assert measured
