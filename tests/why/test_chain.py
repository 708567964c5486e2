"""The rules that hold for every chain of causes, whatever was asked."""

from __future__ import annotations

from collections import Counter

import pytest
from compositions import composed, finish

from steptwin.errors import Misuse
from steptwin.messages import MessageText
from steptwin.why.answer import ChainLink, ChainRule, Cover
from steptwin.why.chain import BrokenRule, Cause, Place, broken, nothing


def cause(time: int, order: int = 0, number: int = 0, *, is_root: bool = False) -> Cause:
    link = ChainLink(time, "a", MessageText("something"))
    return Cause(link, Place(time, order, number), nothing if is_root else lambda: None, Cover.DELAY)


@pytest.mark.parametrize(
    ("chain", "found"),
    [
        ([cause(9, 4), cause(9, 3), cause(7, 5, is_root=True)], None),
        ([cause(9, 4), cause(9, 4, -1), cause(3, is_root=True)], None),
        ([cause(11, 1)], BrokenRule(0, ChainRule.ORDER)),
        ([cause(9, 4), cause(9, 4)], BrokenRule(1, ChainRule.ORDER)),
        ([cause(9, 4), cause(8), cause(9, 4)], BrokenRule(2, ChainRule.ORDER)),
        ([cause(9, 4), cause(7)], BrokenRule(2, ChainRule.ROOT)),
        ([], BrokenRule(0, ChainRule.ROOT)),
    ],
)
def test_rules(chain: list[Cause], found: BrokenRule | None) -> None:
    assert broken(chain, Place(10, 1), is_followed=True) == found


def test_a_link_has_the_moment_of_its_place() -> None:
    other = cause(9)._replace(place=Place(8))
    assert broken([other], Place(10), is_followed=False) == BrokenRule(0, ChainRule.ORDER)


def test_what_comes_later_is_covered() -> None:
    at_once, later = (cause(time, 1, is_root=True)._replace(cover=None) for time in (10, 9))
    assert broken([at_once], Place(10, 2), is_followed=True) is None
    assert broken([later], Place(10, 2), is_followed=True) == BrokenRule(0, ChainRule.COVER)


def test_a_chain_that_goes_on_needs_no_root() -> None:
    assert broken([cause(9)], Place(10), is_followed=False) is None


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
