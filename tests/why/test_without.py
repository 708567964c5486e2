"""The run again without a root: what was asked for is otherwise, or since another moment, or something else is enough for it."""

from __future__ import annotations

import pytest

from steptwin.files.world import World
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.inputs import Bytes
from steptwin.simulation.world.snapshotlog import SnapshotLog
from steptwin.why.answer import Answer, Effect, read_answer
from steptwin.why.pastquestions import PastQuestions
from steptwin.why.question import finish
from steptwin.wire.crc import with_crc

ROD = """
[world]
name = "w"
[[line]]
name = "bus"
kind = "modbus"
[[mic488]]
name = "c"
line = "bus"
unit = 1
program = "p.prg"
start = true
[[cylinder]]
name = "rod"
extend = "c.OUT1"
[[wire]]
from = "rod.extended"
to = "c.IN1"
"""
BUTTONS = """
[world]
name = "w"
[[mic488]]
name = "c"
[[relay]]
name = "first"
[[relay]]
name = "second"
[[gate]]
name = "either"
kind = "or"
inputs = ["first.no", "second.no"]
[[wire]]
from = "either.out"
to = "c.IN1"
[[button]]
name = "one"
to = "first.COIL"
[[button]]
name = "two"
to = "second.COIL"
"""
PROGRAM = b"DELAY 0.2\nOUT1 = ON\nWAIT IN1 = ON\nOUT2 = ON\nWAIT IN2 = ON\n"


def rod(*faults: str) -> World:
    world = World.from_toml(ROD, {"p.prg": PROGRAM})
    for fault in faults:
        world.fault(fault)
    return world


def effects(answer: Answer) -> list[tuple[str, Effect]]:
    return [(str(trial.link.text), trial.effect) for trial in answer.trials]


def test_what_is_otherwise_since_another_moment_or_the_same() -> None:
    world = World.from_toml(BUTTONS)
    world.at(1.0, lambda: world.press("one"))
    world.at(2.0, lambda: world.press("two"))
    world.run(3.0)
    answer = world.why("either.out", try_without=True)
    assert effects(answer) == [("from outside: presses one", Effect.OTHER_TIME)]
    assert answer.trials[0].text == "the same, but since 2.000000 s"


def test_of_two_that_are_enough_each_none_decides() -> None:
    world = World.from_toml(BUTTONS)
    world.at(1.0, lambda: world.press("one"))
    world.at(1.0, lambda: world.press("two"))
    world.run(3.0)
    answer = world.why("either.out", try_without=True)
    assert [(trial.effect, trial.text) for trial in answer.trials] == [(Effect.SAME, "the same: something else is enough for it")]


@pytest.mark.parametrize(
    ("fault", "what"),
    [
        ("jam element=rod name=f", "rod is jammed"),
        ("no-air element=rod name=f from_s=0.3", "rod has no air"),
        ("stuck machine=c pin=OUT1 value=0 name=f", "OUT1 is stuck at 0"),
        ("stuck machine=c pin=IN1 value=0 name=f", "IN1 is stuck at 0"),
        ("stuck-input element=rod input=extend name=f", "rod.extend is stuck at 0"),
        ("stuck-output element=rod output=extended name=f", "rod.extended is stuck at 0"),
    ],
)
def test_a_fault_that_stops_a_program_is_in_the_answer_and_proved(fault: str, what: str) -> None:
    world = rod(fault)
    world.run(5.0)
    answer = world.past.ask("c", try_without=True)
    assert answer.state == "c waits at line 3 `WAIT IN1 = ON`"
    assert next(trial for trial in answer.trials if what in trial.link.text).text == "c waits at line 5 `WAIT IN2 = ON`"
    assert any(what in link.text for link in world.why("c").links)


def test_a_fault_that_makes_no_difference_is_not_in_the_answer() -> None:
    world = rod("jam element=rod from_s=1", "stuck machine=c pin=IN3 value=0")
    world.run(5.0)
    answer = world.why("c", try_without=True)
    assert answer.state == "c waits at line 5 `WAIT IN2 = ON`"
    assert not any("fault" in link.text for link in answer.links)


def test_of_faults_without_names_the_right_one_is_left_out() -> None:
    world = rod("stuck machine=c pin=IN3 value=1", "stuck machine=c pin=IN1 value=0")
    world.run(2.0)
    answer = world.why("c", try_without=True)
    assert [(trial.link.text, trial.text) for trial in answer.trials] == [
        ("fault stuck-2: IN1 is stuck at 0", "c waits at line 5 `WAIT IN2 = ON`")
    ]


def test_a_request_of_a_program_outside() -> None:
    world = rod()
    world.run(1.0)
    world.apply_input(Bytes("bus", "hmi", "rtu", with_crc(bytes.fromhex("01 05 17 72 ff 00"))))
    world.run(2.0)
    answer = world.why("c.OUT3", try_without=True)
    assert [(trial.link.subject, trial.effect, trial.text) for trial in answer.trials] == [
        ("bus", Effect.OTHERWISE, "c.OUT3 is 0")
    ]
    assert read_answer(answer.to_json()) == answer


def test_what_happened_before_the_past_that_is_kept_cannot_be_left_out() -> None:
    world = rod("stuck machine=c pin=IN1 value=0 name=f")
    world.run(1.0)
    snapshots = SnapshotLog(world)
    world.run(4.0)
    snapshots.take()
    answer = finish(PastQuestions(snapshots).asking("c.IN1", try_without=True))
    assert [(trial.effect, trial.text) for trial in answer.trials] == [
        (Effect.UNKNOWN, "not known: the past before it is not kept")
    ]


def test_a_step_that_is_left_out_lets_its_script_go_on() -> None:
    text = ROD + '[[script]]\nname = "s"\nsteps = [{ wait = "1 s" }, { write = { "c.OUT_3" = 1 } }, { note = "later" }]\n'
    text = text.replace('"c.OUT_3"', '"c.M1_EN"')
    world = World.from_toml(text, {"p.prg": PROGRAM})
    world.run(2.0)
    answer = world.why("c.M1_EN == 1", try_without=True)
    assert effects(answer)[-1] == ("script s: writes c.M1_EN = 1", Effect.OTHERWISE)
    left_out = World.from_toml(text, {"p.prg": PROGRAM})
    left_out.leave_out(lambda script, step: script == "s" and isinstance(step, do.Write))
    left_out.run(2.0)
    assert left_out.read("c.M1_EN") == 0
    assert [record.value for record in left_out.trace if record.subject == "note"] == ["later"]


SHUTTLE = """
[world]
name = "w"
[[line]]
name = "bus"
kind = "modbus"
[[mic488]]
name = "c"
line = "bus"
unit = 1
[[script]]
name = "operator"
steps = [
  { write = { "c.M1_EN" = 1 } },
  { repeat = 100, steps = [{ write = { "c.M1_POS_REL" = 10.0 } }, { wait = "1 s" }] },
]
"""


def test_a_fault_that_keeps_a_cycle_where_it_would_be_again_is_in_the_answer() -> None:
    """The axis has reached its position most of the time, with and without the fault; but without it not since then."""
    world = World.from_toml(SHUTTLE)
    world.keep_states()
    world.run(for_=2.9)
    world.fault("exception line=bus link=script")
    world.run(for_=3.0)
    answer = world.why("c.M1.status")
    assert answer.since is not None
    assert answer.since / 1e9 < 2.9
    (fault,) = [link.text for link in answer.links if link.text.startswith("fault exception")]
    assert "without it: the same, but since 5." in fault
