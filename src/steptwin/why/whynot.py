"""Reasons why something is not so: what a condition lacks, and whether it becomes true, or a program goes on, by itself."""

from __future__ import annotations

from collections.abc import Generator
from functools import partial
from typing import TypeAlias

from steptwin.controller import SECOND, Nanos
from steptwin.messages import Message
from steptwin.simulation.kinds.programs import ProgramState
from steptwin.simulation.logic.expression import deciding, parse_condition
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.simulation import Simulation
from steptwin.why.answer import ALL_LINKS, ChainLink
from steptwin.why.log import in_parts
from steptwin.why.notedpast import WHY_NOT, NotedPast, text_of_question, without_not
from steptwin.why.presentstates import PresentStates
from steptwin.why.sentences import value_with_unit

LONGEST_AHEAD_NS: Nanos = 60 * SECOND
"""How far ahead it is tried whether a condition becomes true by itself."""
Lacking: TypeAlias = Generator[None, None, tuple[ChainLink, ...]]

BECOMES_TRUE = Message("why.becomes-true", "it becomes true at {time:.6f} s if nothing comes from outside")
ONLY_FROM_OUTSIDE = Message(
    "why.only-from-outside", "it does not become true within {time:g} s if nothing comes from outside: only from outside"
)
GOES_ON = Message("why.goes-on", "it goes on at {time:.6f} s if nothing comes from outside")
DOES_NOT_GO_ON = Message(
    "why.does-not-go-on", "it does not go on within {time:g} s if nothing comes from outside: only from outside"
)


def what_lacks(past: NotedPast, question: str, at: Nanos) -> Lacking:
    """Lines of a question that begins with ``not`` and is true: the present values of what would have to be otherwise, with
    what drives it, and when it becomes so by itself, or when a program that waits goes on, in parts; none for another one.
    `Why.asking` comes first."""
    text = text_of_question(question)
    if not text.startswith(WHY_NOT):
        return ()
    other = yield from past.world_at(at)
    if without_not(text) in other.programs:
        return (yield from _going_on(other, without_not(text), at))
    condition = past.names.named(without_not(text))
    node = parse_condition(condition).in_unit("", past.names.unit)

    def value(name: str) -> float:
        return other.read(name) if past.names.is_signal(name) else past.log.level(name, at)

    if node.value(value):
        return ()
    links: list[ChainLink] = []
    states = PresentStates(past.causes, other, ALL_LINKS)
    for name in dict.fromkeys(name for one in deciding(node, value, wanted=True) for name in one.names()):
        full = past.names.canonical(name)
        if past.log.is_recorded(full):
            links += states.of([full])
        else:
            text = value_with_unit(name, value(name), past.names.unit(name))
            links.append(ChainLink(at, name.partition(".")[0], text))
        is_kept = full.partition(".")[0] in past.log.world.controllers and full.partition(".")[2] not in past.pins(full)
        for controller, wanted in past.changeable([full], at) if is_kept else ():
            tried = past.tried(controller, wanted, at)
            links += states.before(controller, wanted) if tried is None else (one.link for one in (tried, *tried.along))
    if all(map(past.names.is_signal, node.names())):
        found: list[Nanos] = []
        other.start("why", partial(_note_when, other, condition, found), is_external=True)
        for _ in in_parts(other, (), at + LONGEST_AHEAD_NS):
            if found:
                break
            yield
        ahead = BECOMES_TRUE(time=found[0] / SECOND) if found else ONLY_FROM_OUTSIDE(time=LONGEST_AHEAD_NS / SECOND)
        links.append(ChainLink(at, "", ahead))
    return tuple(dict.fromkeys(links))


def _going_on(other: Simulation, controller: str, at: Nanos) -> Lacking:
    """When a program that waits goes on by itself."""
    programs = other.programs[controller]
    stand, depth, found = programs.stand(at), programs.depth(), list[Nanos]()
    if stand is None or stand.state is not ProgramState.RUNS:
        return ()

    def hook(now: Nanos, number: int) -> None:
        if programs.depth() <= depth and programs.location(number) != stand.location:
            found.append(now)

    programs.add_hook(hook)
    for _ in in_parts(other, (), at + LONGEST_AHEAD_NS):
        if found:
            break
        yield
    ahead = GOES_ON(time=found[0] / SECOND) if found else DOES_NOT_GO_ON(time=LONGEST_AHEAD_NS / SECOND)
    return (ChainLink(at, controller, ahead),)


def _note_when(world: Simulation, condition: str, found: list[Nanos]) -> do.Steps:
    yield do.Until(condition)
    found.append(world.now)
