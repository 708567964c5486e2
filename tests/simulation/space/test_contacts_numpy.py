"""Contacts of random scenes against a model of them in numpy (`space_scenes`)."""

from __future__ import annotations

from itertools import pairwise

import pytest
from space_scenes import END_NS, LONG_NS, Model, bodies_of, grazing, random_scene

from steptwin.controller import Nanos
from steptwin.simulation.space.contacts import Pair

NEAR_NS = 2.0
"""The search gives the next whole nanosecond, the model is within one."""
NEAR_NM = 0.01
SCENES = 25


def found_by_search(pair: Pair) -> list[Nanos]:
    """When contacts begin and end, in turn."""
    now, found = 0, []
    while True:
        at, is_change = pair.next_change(now)
        if at is None or at >= END_NS:
            return found
        now = at
        if is_change:
            found.append(now)


def contacts(changes: list[float], *, touch: bool) -> list[tuple[float, float]]:
    """Beginning and end of each contact. ``touch``: there is one at the beginning."""
    ends = [*([0.0] if touch else []), *changes]
    return list(zip(ends[::2], [*ends[1::2], END_NS][: len(ends[::2])], strict=True))


def long_ones(those: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Those that cannot be between two samples; where a gap may be, the contacts on both sides are one."""
    joined: list[tuple[float, float]] = []
    for begin, end in those:
        if joined and begin - joined[-1][1] <= LONG_NS:
            joined[-1] = joined[-1][0], end
        else:
            joined.append((begin, end))
    return [(begin, end) for begin, end in joined if end - begin > LONG_NS]


@pytest.mark.parametrize("block", range(5))
def test_contacts_are_those_of_the_model(block: int) -> None:
    count = 0
    for seed in range(block * SCENES, (block + 1) * SCENES):
        scene = random_scene(seed)
        model, pair = Model(scene), Pair(*bodies_of(scene))
        touch = model.at(0) > 0.5
        assert pair.overlap(0) is touch, seed
        changes = found_by_search(pair)
        assert all(pair.overlap(moment) is not pair.overlap(moment - 1) for moment in changes), seed
        ours = contacts([float(moment) for moment in changes], touch=touch)
        theirs = contacts(model.changes(), touch=touch)
        assert len(long_ones(ours)) == len(long_ones(theirs)), seed
        for one, other in zip(long_ones(ours), long_ones(theirs), strict=True):
            assert one == pytest.approx(other, abs=NEAR_NS), seed
        for begin, end in ours:
            assert model.at(round(0.5 * (begin + end))) > 0.5 - NEAR_NM, seed
        count += len(ours)
    assert count > SCENES // 4, "scenes in which hardly anything touches show little"


@pytest.mark.parametrize("block", range(2))
def test_what_touches_by_a_nanometre_is_found_and_what_passes_by_one_is_not(block: int) -> None:
    """Grazing: contacts so short that samples would not show them."""
    short = 0
    for seed in range(block * 8, block * 8 + 8):
        scenes = grazing(random_scene(seed))
        if scenes is None:
            continue
        for scene, touches in zip(scenes, (False, True), strict=True):
            model, pair = Model(scene), Pair(*bodies_of(scene))
            moment, depth = model.deepest()
            if abs(depth - 0.5) < NEAR_NM or moment >= END_NS:
                continue
            changes = found_by_search(pair)
            assert (bool(changes) or pair.overlap(0)) is touches, seed
            assert all(model.at((begin + end) // 2) > 0.5 - NEAR_NM for begin, end in list(pairwise(changes))[::2])
            short += touches
    assert short > 2
