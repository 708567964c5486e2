"""Steps that move axes: they mean the motion that they command, whatever the status was before."""

from __future__ import annotations

from pathlib import Path

import pytest
from world_rig import check_it_can_be_restored

from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.simulation.script.control import Enable, Home
from steptwin.simulation.script.steps import Send
from steptwin.simulation.toml.reader import WorldError
from steptwin.simulation.world.motions import ordered

TEXT = """
[[mic488]]
name = "a"
{line}
[mic488.M1]
unit = "mm"
gear = 640.0
acc = 100.0
dec = 100.0
vel = 50.0
mot_resol = 3200
in_kl = "IN1"
home_mode = "HOME0"
limit_mode = "KR"
in_kr = "IN2"
[[axis]]
name = "x"
drive = "a.M1"
pitch = 5.0
start = 30.0
travel = [-5.0, 205.0]
[[axis.switch]]
below = 0.0
to = "a.IN1"
[[axis.switch]]
above = 200.0
to = "a.IN2"
[[script]]
name = "s"
steps = [
  {{ write = {{ "a.M1_EN" = 1 }} }},
  {steps}
]
"""
LINE = 'line = "bus"\nunit = 1\n[[line]]\nname = "bus"\nbaud = 9600\n[[mic488]]\nname = "other"\nline = "bus"\nunit = 2\n'


def world(*steps: str, line: str = "") -> World:
    return World.from_toml(TEXT.format(line=line, steps=",\n  ".join(steps)), name="t.toml")


def notes(found: World) -> list[tuple[float, object]]:
    return [(record.time / SECOND, record.value) for record in found.trace.of("event") if record.subject == "note"]


def test_each_waits_for_its_own_end() -> None:
    found = world(
        '{ home = "a.M1", velocity = -20.0, within = "10 s" }',
        '{ note = "home" }',
        '{ move = "a.M1", to = 100.0, within = "10 s" }',
        '{ note = "there" }',
        '{ move = "a.M1", by = -50.0, within = "10 s" }',
        '{ note = "back" }',
        '{ move = "a.M1", to = 50.0 }',
        '{ note = "there already" }',
    )
    found.run(for_=20)
    assert not found.failures
    assert not found.overdue
    (home, _), (there, _), (back, _), (already, _) = notes(found)
    # 100 mm at 50 mm/s with ramps of 0.5 s are 2.5 s, 50 mm 1.5 s; homing: 0.2 s to 20 mm/s over 2 mm, then 28 mm.
    assert home == pytest.approx(0.2 + 28 / 20, abs=1e-3)
    assert there == pytest.approx(home + 2.5, abs=1e-3)
    assert back == pytest.approx(there + 1.5, abs=1e-3)
    assert already == pytest.approx(back, abs=1e-3)
    assert found.axis["x"].position == pytest.approx(50.0, abs=0.01)


def test_on_a_slow_line_the_request_is_waited_for() -> None:
    text = TEXT.format(line='line = "bus"\nunit = 1', steps='{ move = "a.M1", to = 10.0 }, { note = "end" }')
    found = World.from_toml(text + '[[line]]\nname = "bus"\nbaud = 9600\ntiming = "real"\n')
    found.run(for_=5)
    assert not found.failures
    # 10 mm: 2·√(10/100) s, after two requests of at least 8 + 13 characters and their answers.
    ((end, _),) = notes(found)
    assert end > 2 * (10 / 100) ** 0.5 + 0.02
    assert found.axis["x"].position == 40.0


def test_a_motion_that_fails_is_a_failure() -> None:
    found = world('{ move = "a.M1", to = 190.0 }', '{ note = "end" }')
    found.run(for_=10)
    assert [str(record.value) for record in found.failures] == ["a.M1.status == 4; a.M1.status is 10"]
    assert found.axis["x"].position == pytest.approx(200.0, abs=0.01)
    off = World.from_toml(TEXT.format(line="", steps='{ write = { "a.M1_EN" = 0 } }, { move = "a.M1", to = 10.0 }'))
    off.run(for_=1)
    assert [str(record.value) for record in off.failures] == ["a.M1.status == 4; a.M1.status is 0"]


def test_wait_for_waits_for_what_is_in_progress() -> None:
    found = world(
        '{ write = { "a.M1_POS_ABS" = 100.0 } }',
        '{ wait_for = "a.M1", within = "1 s" }',
        '{ wait_for = "a.M1" }',
        '{ note = "end" }',
    )
    found.run(for_=10)
    assert [str(record.value) for record in found.overdue] == [
        "s waited in vain for a.M1.status != 3 and a.M1.status != 6 and a.M1.status != 8; a.M1.status is 3"
    ]
    assert notes(found)[0][0] == pytest.approx(2.5, abs=1e-3)


@pytest.mark.parametrize("moment_s", [0.0, 1.0, 2.0, 4.3])
def test_it_can_be_restored_anywhere(moment_s: float, tmp_path: Path) -> None:
    steps = ('{ home = "a.M1", velocity = -20.0 }', '{ repeat = 3, steps = [{ move = "a.M1", by = 20.0 }, { note = "next" }] }')
    found, other = world(*steps), world(*steps)
    check_it_can_be_restored(found, other, moment_s, 10.0, tmp_path)
    assert len(notes(found)) == 3


@pytest.mark.parametrize(
    ("step", "text"),
    [
        ('{ move = "a.M1" }', "t.toml:32.*step 2: move: give either to"),
        ('{ move = "a.M1", to = 1.0, by = 2.0 }', "move: give either to"),
        ('{ move = "a.M7", to = 1.0 }', "t.toml:32.*step 2: a.M7: a has M1, M2, M3, M4"),
        ('{ move = "b.M1", to = 1.0 }', "no controller is called 'b'"),
        ('{ mov = "a.M1", to = 1.0 }', r"has 'mov', 'to' \(did you mean 'move'\?\)"),
        ('{ home = "a.M1" }', "step 2: home: give either velocity .* or seek"),
        ('{ home = "a.M1", velocity = -5, seek = "-B8" }', "home: give either velocity .* or seek"),
        ('{ home = "a.M1", seek = "-B8" }', "'a' is a MIC488, which knows its switches: home it with a velocity"),
        ('{ home = "a.M1", seek = "B8" }', "'B8': expected a direction and an input, such as '-B8'"),
        ('{ home = "a.M1", velocity = 0 }', "its sign chooses the switch, so it must not be 0"),
        ('{ move = "a.M0", to = 1.0 }', "'a.M0': expected CONTROLLER.M1 to M4"),
        ('{ move = "a.M٣", to = 1.0 }', "expected CONTROLLER.M1 to M4"),
        pytest.param('{ move = "a.M' + "9" * 5000 + '", to = 1.0 }', "expected CONTROLLER.M1 to M4", id="many digits"),
        ('{ move = "a.IN1", to = 1.0 }', "expected CONTROLLER.M1 to M4"),
        ('{ move = "a.M1", to = 1e39 }', "t.toml:32.*step 2: M1_POS_ABS = 1e\\+39 mm: permitted "),
        ('{ move = "a.M1", by = -4e7 }', "t.toml:32.*step 2: M1_POS_REL = -40000000 mm: permitted "),
    ],
)
def test_mistakes_have_their_places(step: str, text: str) -> None:
    with pytest.raises(WorldError, match=f"(?s){text}") as raised:
        world(step)
    assert len(raised.value.findings) == 1


CHIP = """
[[line]]
name = "chips"
kind = "m1486"
{timing}
[[m1486]]
name = "c"
line = "chips"
address = 3
[[script]]
name = "s"
steps = [
  {{ send = "chips", text = "x3\\rv2000\\r" }},
  {{ wait_for = "c.M1" }},
  {steps}
]
"""


def chip(*steps: str, timing: str = "") -> World:
    return World.from_toml(CHIP.format(steps=",\n  ".join(steps), timing=timing), name="t.toml")


@pytest.mark.parametrize("timing", ["", 'timing = "real"'])
def test_a_chip_moves_and_is_waited_for(timing: str) -> None:
    found = chip(
        '{ move = "c.M1", by = 128000, within = "10 s" }',
        '{ note = "there" }',
        '{ move = "c.M1", to = 64000, within = "10 s" }',
        '{ note = "half way back" }',
        '{ expect = "c.position == 64000 and c.counter == 64000 and chips.idle and not c.busy" }',
        timing=timing,
    )
    found.run(for_=5)
    assert not found.failures
    assert not found.overdue
    (there, _), (back, _) = notes(found)
    assert there > 1.0  # at 2000 full steps of 64 microsteps each second
    other = chip('{ move = "c.M1", by = 128000 }', '{ move = "c.M1", to = 64000 }', timing=timing)
    other.run(until="c.position == 128000")
    assert other.now / SECOND == there
    other.run(until="c.position == 64000")
    assert other.now / SECOND == back


def test_a_move_of_a_chip_that_is_stopped_is_a_failure() -> None:
    found = chip('{ move = "c.M1", by = 640000 }', '{ note = "end" }')
    found.at(2.0, Send("chips", b"k\r"))
    found.run(for_=10)
    assert [str(record.value) for record in found.failures] == ["c.valid; c.valid is 0"]
    ((end, _),) = notes(found)
    assert 2.0 < end < 2.5


def test_what_a_chip_cannot_do_now_is_a_failure() -> None:
    found = chip('{ move = "c.M1", by = 7 }', '{ send = "chips", text = "f100000\\rr\\r" }', '{ move = "c.M1", by = 64 }')
    found.run(for_=20)
    first, second = (str(record.value) for record in found.failures)
    assert first == "distance 7 min. microsteps: no multiple of 64, the microstep of M1"
    assert second.startswith("c is not at rest (")


HOMED = """
[[axis]]
name = "x"
drive = "c.M1"
pitch = 5.0
start = 4.0
[[axis.switch]]
below = 0.0
to = "c.B8"
contact = "NC"
"""


def homing(*steps: str, timing: str = "") -> World:
    return World.from_toml(CHIP.format(steps=",\n  ".join(steps), timing=timing) + HOMED, name="t.toml")


@pytest.mark.parametrize("timing", ["", 'timing = "real"'])
def test_a_chip_seeks_its_switch_and_is_at_0(timing: str) -> None:
    """4 mm are 160 full steps; it seeks with 500 of them each second, and ends on one of four."""
    found = homing(
        '{ home = "c.M1", seek = "-B8", within = "10 s" }',
        '{ note = "there" }',
        '{ expect = "c.counter == 0 and x.position <= 0 and x.position > -0.11 and not c.busy" }',
        '{ move = "c.M1", by = 12800, within = "10 s" }',
        '{ expect = "c.counter == 12800 and x.position > 4.8" }',
        '{ home = "c.M1", seek = "- b8" }',
        '{ home = "c.M1", seek = "-B8" }',
        '{ note = "again" }',
        timing=timing,
    )
    found.run(for_=5)
    assert [str(record.value) for record in (*found.failures, *found.overdue)] == []
    (there, _), _ = notes(found)
    assert there > 160 / 500


def test_a_seek_that_is_stopped_or_finds_nothing_is_a_failure() -> None:
    found = homing('{ home = "c.M1", seek = "-B8" }', '{ note = "end" }')
    found.at(0.2, Send("chips", b"k\r"))
    found.run(for_=5)
    assert [str(record.value) for record in found.failures] == [
        "c.valid and c.counter == 0 and c.B8 == 0; c.valid is 1, c.counter is 0 min. microsteps, c.B8 is 1"
    ]
    away = homing('{ home = "c.M1", seek = "+B8", within = "2 s" }', '{ note = "end" }')
    away.run(for_=5)
    assert [str(record.value) for record in away.overdue] == [
        "s waited in vain for not c.busy and chips.idle; c.busy is 1, chips.idle is 1"
    ]
    assert len(away.failures) == 1
    busy = homing('{ send = "chips", text = "g+\\rr\\r" }', '{ home = "c.M1", seek = "-B8", within = "1 s" }')
    busy.run(for_=5)
    assert str(busy.failures[0].value).startswith("c is not at rest (")


@pytest.mark.parametrize(
    ("step", "text"),
    [
        ('{ home = "c.M1", seek = "-B22" }', "step 3: seek 'B22': permitted are B1 to B21, such as '-B8'"),
        ('{ home = "c.M1", seek = "-IN1" }', "step 3: seek 'IN1': permitted are B1 to B21"),
        ('{ home = "c.M1", velocity = 5 }', "step 3: 'c' is an M1486, which does not know its switch: home it with seek"),
        ('{ home = "c.M2", seek = "-B8" }', "step 3: c.M2: c has M1"),
    ],
)
def test_a_seek_that_cannot_be_is_refused(step: str, text: str) -> None:
    with pytest.raises(WorldError, match=f"t.toml:.*{text}"):
        homing(step)


@pytest.mark.parametrize("moment_s", [0.0, 0.05, 0.2, 0.4])
def test_seeks_can_be_restored_anywhere(moment_s: float) -> None:
    found, other = (homing('{ home = "c.M1", seek = "-B8" }', '{ note = "a" }', timing='timing = "real"') for _ in range(2))
    found.run(until=moment_s)
    snapshot = found.snapshot()
    found.run(until=3.0)
    other.restore(snapshot)
    other.run(until=3.0)
    assert other.trace.digest() == found.trace.digest()
    assert len(notes(found)) == 1


def test_a_chip_that_has_no_line_says_so() -> None:
    found = World.from_toml('[[m1486]]\nname = "c"\n[[script]]\nname = "s"\nsteps = [{ move = "c.M1", to = 64 }]\n')
    found.run(for_=1)
    assert [str(record.value) for record in found.failures] == ["c is on no line, so no commands can be sent to it"]


@pytest.mark.parametrize("moment_s", [0.0, 0.01, 0.5, 1.2])
def test_moves_of_a_chip_can_be_restored_anywhere(moment_s: float) -> None:
    steps = ('{ move = "c.M1", by = 64000 }', '{ note = "a" }', '{ move = "c.M1", to = 0 }', '{ note = "b" }')
    found, other = (chip(*steps, timing='timing = "real"') for _ in range(2))
    found.run(until=moment_s)
    snapshot = found.snapshot()
    found.run(until=5.0)
    assert len(notes(found)) == 2
    other.restore(snapshot)
    other.run(until=5.0)
    assert other.trace.digest() == found.trace.digest()


def test_commands_that_a_chip_does_not_know_are_refused() -> None:
    world = World.from_toml('[[m1486]]\nname = "d"\n')
    with pytest.raises(Misuse, match="'d' is an M1486, which has no command enable"):
        ordered(world, Enable("d", 1, True))
    with pytest.raises(Misuse, match="which does not know its switch: home it with seek"):
        ordered(world, Home("d", 1, 1.0))


@pytest.mark.parametrize(
    ("pin", "text"),
    [("B11", "step 1: B11 is taken: the Dual DAC interface"), ("B99", "step 1: seek 'B99': permitted")],
)
def test_what_a_chip_cannot_seek_is_told_also_where_it_could_not_now(pin: str, text: str) -> None:
    """It is on no line."""
    chip = '[[m1486]]\nname = "d"\ninterface = "dual"\n[[script]]\nname = "s"\n'
    with pytest.raises(WorldError, match=text):
        World.from_toml(f'{chip}steps = [{{ home = "d.M1", seek = "-{pin}" }}]\n')
