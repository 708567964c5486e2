"""The questions of questions.txt: each answer is what was written by hand from the description and the program, whatever is
searched first, and each of its roots is proved by the run without it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple, TypeAlias
from unittest.mock import patch

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from steptwin.files.world import World
from steptwin.simulation.faults import read as read_fault
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.inputs import Bytes, ExternalInput
from steptwin.why import pastquestions
from steptwin.why.answer import Answer, Effect
from steptwin.why.replayedrun import ReplayedRun
from steptwin.wire.crc import with_crc

TABLE = Path(__file__).with_name("questions.txt")
REST = "..."
"""Links that are not written."""
SAME = "="
"""Before a root that does not decide alone."""
HEAD = '[world]\nname = "w"\n'
MIC = '[[mic488]]\nname = "c"\nprogram = "p.prg"\nstart = true\n'
CHIP = '[[m1486]]\nname = "k"\nprogram = "p.m1486"\n'


Asked: TypeAlias = "tuple[str, str, float | None]"


class Machine(NamedTuple):
    """``positions``: the table of the program. ``outside``: what comes from outside, by its moment in s. ``questions``: each with
    its moment, and its answer: parts of the state and of each link."""

    name: str
    tables: str
    program: str
    positions: str
    outside: tuple[tuple[float, str], ...]
    end: float
    questions: Mapping[tuple[str, float | None], tuple[str, ...]]


def machines() -> Iterator[Machine]:
    """As questions.txt has them; its head says how they are written."""
    for text in TABLE.read_text(encoding="utf-8").split("\n=== ")[1:]:
        name, _, rest = text.partition("\n")
        parts: dict[str, str] = {}
        for part in f"\n{rest}".split("\n--- ")[1:]:
            head, _, parts[head] = part.partition("\n")
        outside = [line.partition(" ")[::2] for line in parts.get("outside", "").splitlines()]
        questions: dict[tuple[str, float | None], tuple[str, ...]] = {}
        for block in re.split(r"\n(?=\S)", parts["why"].strip("\n")):
            asked, *links = block.splitlines()
            question, _, at = asked.partition(" @ ")
            questions[question, float(at) if at else None] = tuple(link.strip() for link in links)
        end = float(parts.get("end", "3"))
        moments = tuple((float(at), what) for at, what in outside)
        yield Machine(
            name.strip(), parts.get("world", ""), parts.get("program", ""), parts.get("positions", ""), moments, end, questions
        )


MACHINES = {machine.name: machine for machine in machines()}
ASKED: list[Asked] = [(machine.name, question, at) for machine in MACHINES.values() for question, at in machine.questions]


def act(text: str) -> ExternalInput:
    """What comes from outside: ``press go``, ``release go``, ``set c.IN1 1``, ``write c.M1_POS_ABS 10``, ``fault ...``,
    ``clear NAME``, ``request 01 05 17 71 ff 00`` of the client hmi, ``spoilt`` with another check sum."""
    word, _, rest = text.partition(" ")
    match word:
        case "press":
            return do.Press(rest)
        case "release":
            return do.Release(rest)
        case "set":
            pin, level = rest.split()
            controller, _, name = pin.partition(".")
            return do.Set(((controller, name, float(level)),))
        case "write":
            point, value = rest.split()
            controller, _, name = point.partition(".")
            return do.Write(((controller, name, float(value)),))
        case "fault":
            return do.SetFault(read_fault(rest))
        case "clear":
            return do.ClearFault(rest)
        case "spoilt":
            return Bytes("bus", "hmi", "rtu", bytes.fromhex(rest))
        case "request":
            return Bytes("bus", "hmi", "rtu", with_crc(bytes.fromhex(rest)))
    raise AssertionError(text)


@lru_cache
def past(name: str) -> ReplayedRun:
    machine = MACHINES[name]
    is_chip = machine.program.lstrip().startswith("[")
    text = machine.tables if "[world]" in machine.tables else HEAD + (CHIP if is_chip else MIC) + machine.tables
    files = {"p.prg": machine.program, "p.m1486": machine.program, "p.pos": machine.positions}
    world = World.from_toml(text, {name: content.encode() for name, content in files.items()})
    for moment, what in machine.outside:
        world.run(moment)
        world.apply_input(act(what))
    world.run(machine.end)
    return world.past


@lru_cache
def answer(name: str, question: str, at: float | None) -> Answer:
    return past(name).ask(question, None if at is None else round(at * 1e9), try_without=True)


def fits(written: tuple[str, ...], found: list[str]) -> bool:
    """Whether each link has what was written of it, in this order."""
    if not written:
        return not found
    if written[0] == REST:
        return any(fits(written[1:], found[begin:]) for begin in range(len(found) + 1))
    return bool(found) and written[0].removeprefix(SAME) in found[0] and fits(written[1:], found[1:])


@pytest.mark.parametrize(("name", "question", "at"), ASKED)
def test_the_answer_is_what_was_written_by_hand(name: str, question: str, at: float | None) -> None:
    state, *links = MACHINES[name].questions[question, at]
    found = answer(name, question, at)
    assert state in found.text().splitlines()[0]
    assert fits(tuple(links), [str(link.text) for link in found.links]), found.text()


@pytest.mark.parametrize(("name", "question", "at"), ASKED)
def test_each_root_is_proved(name: str, question: str, at: float | None) -> None:
    _, *links = MACHINES[name].questions[question, at]
    for trial in answer(name, question, at).trials:
        together = any(link.startswith(SAME) and link[1:] in trial.link.text for link in links)
        assert (trial.effect is Effect.SAME) is together, trial
        assert trial.effect is not Effect.UNKNOWN, trial


@example(("interrupts that were switched off after they had come", "OUT4", None), 0.13, False)
@given(st.sampled_from(ASKED), st.sampled_from([0.05, 0.2, 0.7, 1.0, 2.0]), st.booleans())
@settings(max_examples=30)
def test_an_answer_does_not_depend_on_what_is_searched_first(asked: Asked, span: float, everything: bool) -> None:
    name, question, at = asked
    moment = None if at is None else round(at * 1e9)
    found: list[Answer] = []
    for first in (span, 1e6):
        with patch.multiple(pastquestions, FIRST_SPAN_NS=round(first * 1e9), FIRST_STATEMENTS=round(first * 1e9)):
            found.append(past.__wrapped__(name).ask(question, moment, everything=everything))
    assert found[0] == found[1]


def test_there_are_enough() -> None:
    assert len(ASKED) >= 150
