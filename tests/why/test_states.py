"""Questions about what is in no trace are answered from states on the way, as from the whole past."""

from __future__ import annotations

import pytest
from why_worlds import PROGRAM, WAITS

from steptwin.files.world import World
from steptwin.machine import MILLISECOND, SECOND
from steptwin.why import states
from steptwin.why.question import Why
from steptwin.world import script as do

COUNTS = "n = 0\n$I5 = 0\nMAIN:\n    n = n + 1\n    $I4 = n\n    DELAY 0.3\n    IF n = 7\n        $I5 = 1\n    ENDIF\nJUMP MAIN\n"
WORLD = '[[mic488]]\nname = "m"\nprogram = "m.prg"\nstart = true\n'
QUESTIONS = ("m.USER_REGISTER[4] > 3", "m.USER_REGISTER[4]", "m.USER_REGISTER[5] == 1", "m.USER_REGISTER[5]", "time > 1.5")


def counting() -> Why:
    world = World.from_toml(WORLD, {"m.prg": COUNTS.encode()})
    world.run(1.7)
    world.apply_input(do.Write((("m", "USER_REGISTER[4]", 90.0),)))
    world.run(for_=6.0)
    return world.past


@pytest.mark.parametrize("question", QUESTIONS)
def test_answers_are_those_of_a_run_from_the_beginning(question: str, monkeypatch: pytest.MonkeyPatch) -> None:
    past = counting()
    moments = [number * 450 * MILLISECOND for number in range(1, 17)]
    found = [past.ask(question, at) for at in moments]
    monkeypatch.setattr(states, "FIRST_DISTANCE_NS", 3600 * SECOND)
    whole = counting()
    assert found == [whole.ask(question, at) for at in moments]
    assert len({answer.since for answer in found}) > 1


def test_as_many_states_are_kept_as_may_be() -> None:
    world = World.from_toml(WAITS, {"p.prg": PROGRAM.encode()})
    kept = states.StatesOnTheWay(world)
    for second in range(1, 1000):
        world.run_to(second * SECOND)
        kept.pass_by(0)
    moments = [state.snapshot.now for state in kept.until(700 * SECOND)]
    assert len(moments) < states.MOST_KEPT
    assert moments == sorted(moments, reverse=True)
    assert moments[0] > 680 * SECOND
    assert moments[-1] == 0
