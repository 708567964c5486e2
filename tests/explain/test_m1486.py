"""What is explained of programs of the M1486 holds on the chip."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from m1486_rig import Bench

from steptwin.controller import MILLISECOND, Nanos
from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse
from steptwin.explain.m1486 import explain
from steptwin.explain.model import Explanation
from steptwin.m1486.commands import When, when
from steptwin.m1486.encoding import encode
from steptwin.m1486.structure import streams
from steptwin.m1486.syntax import parse
from steptwin.m1486.variants import variant

LABELS = (1, 2, 3, 4)


def explained(text: str, kind: str = "B") -> Explanation:
    (found,) = explain(SourceText("p.m1486", text), variant(kind))
    return found


def executed(text: str, happens: list[tuple[int, int, int]] = [], kind: str = "B", ms: int = 400) -> list[tuple[Nanos, int]]:  # noqa: B006 - never changed
    """Moments and numbers of the commands that a chip executes, which receives the text at once."""
    places: dict[int, int] = {}
    place = 0
    for index, command in enumerate(streams(parse(text).program)[0].commands):
        if when(command.key, command.number) is When.QUEUED:
            places[place] = index
            place += len(encode(command))
    bench = Bench(kind)
    found: list[tuple[Nanos, int]] = []
    bench.chip.program.add_hook(lambda now, place: found.append((now, places[place])) if place in places else None)
    bench.raw(text.replace("\n", "\r").encode())
    for at, line, level in happens:
        bench.chip.advance(max(bench.now, at * MILLISECOND))
        bench.pin(**{f"B{line}": level})
    bench.chip.advance(max(bench.now, ms * MILLISECOND))
    return found


jump = st.tuples(st.sampled_from(("J{}", "I1H{}", "I80H{}", "'{}")), st.sampled_from(LABELS)).map(
    lambda one: one[0].format(one[1])
)
command = st.one_of(
    jump, jump, st.sampled_from(("W10", "T80", "C80", "E", "L3", "O2", ".", "+1", "T44", ":2", "J", "'", "E", "L2"))
)
bodies = st.lists(command, max_size=6)
programs = st.tuples(bodies, bodies, bodies, bodies, bodies).map(
    lambda parts: (
        "\n".join(
            ["[", *parts[0], *(line for n, part in zip(LABELS, parts[1:], strict=True) for line in (f"@{n}", *part)), "U20", "]"]
        )
        + "\n"
    )
)
levels = st.lists(st.tuples(st.integers(0, 300), st.integers(1, 2), st.integers(0, 1)), max_size=10).map(sorted)


@settings(max_examples=60)
@given(programs, levels)
def test_what_is_never_reached_is_never_executed(text: str, happens: list[tuple[int, int, int]]) -> None:
    found = explained(text)
    assert {number for _, number in executed(text, happens)}.isdisjoint(found.unreachable)


@settings(max_examples=60)
@given(programs, levels)
def test_a_loop_that_is_never_left_is_never_left(text: str, happens: list[tuple[int, int, int]]) -> None:
    found = explained(text)
    order = [number for _, number in executed(text, happens)]
    for loop in found.loops:
        inside = [number in loop.statements for number in order]
        if True in inside:
            assert all(inside[inside.index(True) :])


settled = st.sampled_from(("S100", "S300", "V800", "V1500", "A2000", "F640", "B6400", "F64000", "D", "W25", "T3", "R", "R", "+1"))


@settings(max_examples=60)
@given(st.lists(settled, min_size=1, max_size=12), st.sampled_from(("B", "B2x")))
def test_measured_durations_are_the_explained_ones(commands: list[str], kind: str) -> None:
    text = "\n".join(["[", *commands, "T1", "]"]) + "\n"
    found = explained(text, kind)
    order = executed(text, kind=kind, ms=60_000)
    (piece,) = (piece for block in found.blocks for piece in block.pieces)
    assert order[-1][1] == len(commands) + 1
    assert order[-1][0] + found.statement_time - order[0][0] == piece.duration


def test_the_duration_of_a_move_by_its_equations() -> None:
    """From S200 with A5000 to V1000, 619 full steps: 0.16 s up over 96 steps, and down; the rest at 1000 step/s."""
    found = explained("[\nS200\nV1000\nA5000\nF39616\nR\n]\n")
    (piece,) = (piece for block in found.blocks for piece in block.pieces)
    assert piece.duration == pytest.approx(4e6 + 1e9 * (0.16 + 0.16 + (619 - 2 * 96) / 1000), abs=1)


def test_a_jump_out_of_a_loop_makes_its_end_lead_to_any_loop() -> None:
    """E belongs to the loop that is in progress, which after a jump need not be the one around it in the text."""
    text = "[\nL2\nJ1\nE\nU1\n@1\nL3\nE\nE\n]\n"
    found = explained(text)
    numbers = {number for _, number in executed(text)}
    assert numbers.isdisjoint(found.unreachable)
    last = next(block for block in found.blocks if block.last == 8)
    assert {"again", "done"} <= {way.when for way in last.ways}


def test_errors_that_the_chip_finds_are_named() -> None:
    late = "@1\nI1H2\nJ1\n@2\nT1\n"
    assert any(note.startswith("steptwin check finds errors") for note in explained(late).notes)
    assert not any(note.startswith("steptwin check finds errors") for note in explained(f"[\n{late}]\n").notes)


def test_a_register_that_there_is_not_is_neither_read_nor_written() -> None:
    assert [used.name for used in explained("<1\n>9\n<11\n").usage["registers"]] == ["register 1", "register 9"]


def test_wrong_commands_are_refused() -> None:
    with pytest.raises(Misuse, match=r"p\.m1486:2: .* steptwin check shows all errors"):
        explained("[\n%5\n]\n")
