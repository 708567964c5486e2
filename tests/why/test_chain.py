"""The rules that hold for every chain of causes, whatever was asked."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace

import pytest
from compositions import composed, finish

from steptwin.errors import Misuse
from steptwin.messages import MessageText
from steptwin.simulation.script import steps as do
from steptwin.why.answer import ChainLink, ChainRule, Cover
from steptwin.why.chain import BETWEEN, NOT_KNOWN, Cause, Chain, Place, broken, nothing
from steptwin.why.roots import Act


def cause(time: int, order: int = 0, number: int = 0, *, is_root: bool = False) -> Cause:
    link = ChainLink(time, "a", MessageText(f"something at {time}"))
    return Cause(link, Place(time, order, number), nothing if is_root else lambda: None, Cover.DELAY)


@pytest.mark.parametrize(
    ("one", "found"),
    [
        (cause(9, 4), None),
        (cause(10, 0), None),
        (cause(10, 1, -1), None),
        (cause(10, 1), ChainRule.ORDER),
        (cause(11), ChainRule.ORDER),
        (cause(9)._replace(place=Place(8)), ChainRule.ORDER),  # a link has the moment of its place
        (cause(10, 0)._replace(cover=None), None),
        (cause(9)._replace(cover=None), ChainRule.COVER),
    ],
)
def test_rules(one: Cause, found: ChainRule | None) -> None:
    assert broken(one, Place(10, 1)) is found


def chain(first: Cause | None, *, is_whole: bool = True) -> Chain:
    found = Chain(cause(10).link, Place(10, 1), first, is_whole=lambda moment: is_whole, is_owed=first is None)
    while not found.is_followed:
        found.go_on()
    return found


def test_causes_come_once_and_the_latest_ones_first() -> None:
    root = cause(1, is_root=True)
    other = cause(3)._replace(before=lambda: root)
    first = cause(5)._replace(before=lambda: root, besides=lambda: [other])
    found = chain(first)
    assert [link.time for link in found.links] == [5, 3, 1]
    assert (found.broken, found.is_cut) == (None, False)


def test_a_cause_that_breaks_a_rule_is_left_out_and_the_others_are_followed() -> None:
    first = cause(5)._replace(before=lambda: cause(7), besides=lambda: [cause(2, is_root=True)])
    found = chain(first)
    assert [str(link.text) for link in found.links] == ["something at 5", str(NOT_KNOWN()), "something at 2"]
    assert found.broken is ChainRule.ORDER


def test_what_was_so_several_times_is_there_once_and_what_led_to_the_first_time_is_found() -> None:
    link = cause(9).link
    before = cause(4)._replace(link=replace(link, time=4), before=lambda: cause(1, is_root=True))
    assert [one.time for one in chain(cause(9)._replace(before=lambda: before)).links] == [9, 1]


def led_by(moments: Iterable[int], *besides: Cause) -> Cause:
    """The last of some moments, each of which led to the next one; the last one needed others besides."""
    first, *others = (cause(moment, is_root=True) for moment in moments)
    for one in others:
        first = one._replace(before=lambda led=first: led)
    return first._replace(besides=lambda: besides)


def long_chain(first: Cause, most: int) -> Chain:
    found = Chain(cause(1000).link, Place(1000, 1), first, is_whole=lambda moment: True, is_owed=False, most=most)
    while not found.is_over:
        found.go_on()
    return found


def test_what_led_to_something_is_taken_before_what_had_to_be_so_besides() -> None:
    beside = cause(1, is_root=True)
    assert [link.time for link in long_chain(led_by((6, 7, 9), beside), 3).links] == [9, 7, 6]
    assert [link.time for link in long_chain(led_by(range(100, 108), beside), 8).links][-1] == 1


def test_the_nearest_roots_of_what_had_to_be_so_besides_are_shown_behind_what_is_shown() -> None:
    act = Act(1, "setup", do.Press("go"), 1, "setup")
    deep = cause(1, is_root=True)
    deep = deep._replace(link=replace(deep.link, root=act))
    beside = cause(50)._replace(before=lambda: deep)
    found = long_chain(led_by(range(100, 108), beside), 6)
    assert [link.time for link in found.links] == [107, 106, 105, 104, 103, 102, 101, 100, 1]


def test_the_beginning_of_a_long_chain_is_shown() -> None:
    found = long_chain(led_by(range(100, 130)), 8)
    assert [link.time for link in found.links] == [129, 128, 127, 126, 125, 102, 102, 101, 100]
    assert str(found.links[5].text) == str(BETWEEN(count=22))
    assert found.is_followed


def test_a_beginning_that_is_too_far_is_not_searched() -> None:
    found = long_chain(led_by(range(100, 900)), 8)
    assert [link.time for link in found.links] == list(range(899, 891, -1))
    assert not found.is_followed


@pytest.mark.parametrize("first", [None, cause(9)])
def test_a_chain_ends_with_a_root_or_where_nothing_is_known(first: Cause | None) -> None:
    assert chain(first).broken is ChainRule.ROOT
    cut = chain(first, is_whole=False)
    assert (cut.broken, cut.is_cut) == (None, True)


@pytest.mark.parametrize("seed", [4, 1])
def test_no_answer_about_a_world_by_chance_has_a_cause_after_its_effect(seed: int) -> None:
    composition = composed(seed)
    world = composition.world()
    finish(world, composition)
    past, rules = world.past, Counter[ChainRule | None]()
    names = [f"c.{pin}" for pin in world.controllers["c"].pins()]
    names += [
        f"{name}.{one}"
        for built in world.objects.elements.values()
        for name in built
        for one in world.objects.element_signals(name) or ()
    ]
    for name in ["c", *names]:
        try:
            answer = past.ask(name)
        except Misuse:  # an element that has no such signal now
            continue
        rules[answer.broken] += 1
        links = answer.links[1 if name == "c" else 0 :]
        assert [link.time for link in links] == sorted((link.time for link in links), reverse=True), answer.text()
        assert len(set(links)) == len(links)
    assert rules[None] > 50
    assert not rules[ChainRule.ORDER]
