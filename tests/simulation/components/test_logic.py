"""Gates, latches, timers, counters and relays, each from its definition, at every change of its inputs."""

from __future__ import annotations

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.controller import MILLISECOND
from steptwin.errors import Misuse, Runaway
from steptwin.files.world import World
from steptwin.simulation.components.gate import FUNCTIONS
from steptwin.simulation.components.timer import TIMER
from steptwin.simulation.toml.reader import WorldError

BASE = """
[[mic488]]
name = "a"
[[button]]
name = "one"
to = "it.{one}"
[[button]]
name = "two"
to = "it.{two}"
[[wire]]
from = "it.out"
to = "a.IN9"
"""


def world(text: str, one: str = "in1", two: str = "in2") -> World:
    return World.from_toml(BASE.format(one=one, two=two) + text)


def press(there: World, name: str, level: bool) -> None:
    if level:
        there.press(name)
    else:
        there.release(name)
    there.run(for_=0)


def edges(there: World, channel: str) -> list[tuple[float, object]]:
    """Milliseconds and levels."""
    return [(record.time / MILLISECOND, record.value) for record in there.trace.edges() if record.subject == channel]


TRUTH = {
    "and": (0, 0, 0, 1),
    "or": (0, 1, 1, 1),
    "nand": (1, 1, 1, 0),
    "nor": (1, 0, 0, 0),
    "xor": (0, 1, 1, 0),
}


@pytest.mark.parametrize(("kind", "levels"), TRUTH.items())
def test_truth_tables(kind: str, levels: tuple[int, ...]) -> None:
    there = world(f'[[gate]]\nname = "it"\nkind = "{kind}"\ninputs = 2')
    for (one, two), level in zip(product((False, True), repeat=2), levels, strict=True):
        press(there, "one", one)
        press(there, "two", two)
        assert there.read("it.out") == level, (one, two)


@pytest.mark.parametrize("levels", [*product((False, True), repeat=4)])
def test_more_inputs(levels: tuple[bool, ...]) -> None:
    on = levels.count(True)
    expected = {"and": on == 4, "or": on > 0, "nand": on < 4, "nor": on == 0, "xor": on in (1, 3), "not": not levels[0]}
    assert {kind: function(list(levels)) for kind, function in FUNCTIONS.items()} == expected


def test_a_gate_joins_outputs_of_controllers_and_elements() -> None:
    text = """
[[mic488]]
name = "a"
[[mic488]]
name = "b"
[[gate]]
name = "no"
kind = "not"
inputs = ["a.OUT1"]
[[gate]]
name = "both"
kind = "and"
inputs = ["no.out", "b.OUT2"]
[[wire]]
from = "both.out"
to = "a.IN3"
[[wire]]
from = "both.out"
to = "b.IN4"
delay = "5 ms"
"""
    there = World.from_toml(text)
    there.run(for_=0.01)
    assert (there.read("no.out"), there.read("a.IN3")) == (1, 0)
    there.mic488["b"].write("OUT2", 1)
    there.run(for_=0.001)
    assert (there.read("a.IN3"), there.read("b.IN4")) == (1, 0)
    there.run(for_=0.005)
    assert there.read("b.IN4") == 1
    there.mic488["a"].write("OUT1", 1)
    there.run(for_=0.01)
    assert (there.read("a.IN3"), there.read("b.IN4")) == (0, 0)
    # Both are in one scheduler, and channels are under its first machine.
    assert {record.controller for record in there.trace.edges() if record.subject == "both.out"} == {"a"}


def test_a_latch_keeps_what_was_last() -> None:
    for priority, level in (("reset", 0), ("set", 1)):
        there = world(f'[[latch]]\nname = "it"\npriority = "{priority}"', "set", "reset")
        seen = [there.read("it.out")]
        for name, pressed in (("one", 1), ("one", 0), ("two", 1), ("one", 1), ("two", 0), ("one", 0)):
            press(there, name, bool(pressed))
            seen.append(there.read("it.out"))
        assert seen == [0, 1, 1, 0, level, 1, 1]


TIMERS = {
    # IEC 61131-3, table 46: inputs at 10 to 40, 100 to 300 ms; 100 ms.
    "on-delay": [(0, 0), (200, 1), (300, 0)],
    "off-delay": [(0, 0), (10, 1), (400, 0)],
    "pulse": [(0, 0), (10, 1), (110, 0)],
}


@pytest.mark.parametrize(("kind", "expected"), TIMERS.items())
def test_timers_are_those_of_the_standard(kind: str, expected: list[tuple[float, object]]) -> None:
    there = World.from_toml(
        '[[mic488]]\nname = "a"\n[[button]]\nname = "one"\nto = "it.in"\n[[wire]]\nfrom = "it.out"\nto = "a.IN1"\n'
        f'[[timer]]\nname = "it"\nkind = "{kind}"\ntime = "100 ms"\n'
    )
    for at_ms, pressed in ((10, True), (40, False), (100, True), (300, False)):
        there.run(until=at_ms / 1000)
        press(there, "one", pressed)
    there.run(until=1.0)
    assert edges(there, "it.out") == expected


def test_a_timer_whose_time_is_broken_off_is_not_due() -> None:
    text = '[[mic488]]\nname = "a"\n[[button]]\nname = "one"\nto = "it.in"\n[[timer]]\nname = "it"\n'
    there = World.from_toml(text + 'kind = "on-delay"\ntime = "100 ms"\n[[wire]]\nfrom = "it.out"\nto = "a.IN1"\n')
    timer = there.objects.built(TIMER)["it"]
    deadlines = []
    for pressed in (True, False):
        press(there, "one", pressed)
        deadlines.append(timer.deadline())
    assert deadlines == [100 * MILLISECOND, None]


@pytest.mark.parametrize(("up", "down", "count"), [(True, False, 1), (False, True, 0), (True, True, 0)])
def test_an_input_that_is_on_from_the_beginning_is_an_edge(up: bool, down: bool, count: int) -> None:
    keys = [f'{key} = "on.out"\n' for key, is_on in (("up", up), ("down", down)) if is_on]
    counter = f'[[counter]]\nname = "it"\npreset = 1\n{"".join(keys)}'
    there = World.from_toml(f'[[mic488]]\nname = "a"\n[[gate]]\nname = "on"\nkind = "not"\ninputs = ["a.OUT1"]\n{counter}')
    there.run(for_=0.1)
    assert there.read("it.count") == count


@given(st.lists(st.tuples(st.sampled_from(["one", "two"]), st.booleans()), max_size=30))
def test_a_counter_counts_edges(moves: list[tuple[str, bool]]) -> None:
    there = world('[[counter]]\nname = "it"\npreset = 2', "up", "down")
    count, before = 0, {"one": False, "two": False}
    for name, pressed in moves:
        press(there, name, pressed)
        if pressed and not before[name]:
            count = max(0, count + (1 if name == "one" else -1))
        before[name] = pressed
        assert there.read("it.count") == count
        assert there.read("it.out") == (count >= 2)


def test_a_counter_begins_anew_while_reset_is_on() -> None:
    there = world('[[counter]]\nname = "it"\npreset = 1', "up", "reset")
    press(there, "one", True)
    press(there, "two", True)
    press(there, "one", False)
    press(there, "one", True)
    assert (there.read("it.count"), there.read("it.out")) == (0, 0)
    press(there, "two", False)
    assert there.read("it.count") == 0
    press(there, "one", False)
    press(there, "one", True)
    assert there.read("it.count") == 1


RELAY = """
[[mic488]]
name = "a"
[[mic488]]
name = "b"
[[button]]
name = "stop1"
to = "safety.coil"
contact = "NC"
join = "series"
[[button]]
name = "stop2"
to = "safety.coil"
contact = "NC"
join = "series"
[[relay]]
name = "safety"
pull_in = "15 ms"
drop_out = "8 ms"
[[wire]]
from = "safety.no"
to = "a.IN1"
[[wire]]
from = "safety.no"
to = "b.IN1"
"""


def test_an_emergency_stop_chain_over_two_controllers() -> None:
    there = World.from_toml(RELAY)
    there.run(until=0.1)
    assert (there.read("a.IN1"), there.read("b.IN1")) == (1, 1)
    press(there, "stop2", True)
    there.run(until=0.2)
    press(there, "stop1", True)
    press(there, "stop2", False)
    there.run(until=0.3)
    assert (there.read("a.IN1"), there.read("b.IN1")) == (0, 0)
    press(there, "stop1", False)
    there.run(until=0.4)
    assert edges(there, "safety.no") == [(0, 0), (15, 1), (108, 0), (315, 1)]
    assert edges(there, "safety.nc") == [(0, 1), (15, 0), (108, 1), (315, 0)]
    # The name of a contact is a channel of its own, under a controller.
    assert edges(there, "stop2") == [(0, 1), (100, 0), (200, 1)]
    assert {record.controller for record in there.trace.edges() if record.subject == "stop2"} == {"a"}


def test_a_pulse_that_is_too_short_does_not_move_a_relay() -> None:
    there = World.from_toml(RELAY)
    there.run(until=0.1)
    press(there, "stop1", True)
    there.run(until=0.107)
    press(there, "stop1", False)
    there.run(until=0.2)
    assert edges(there, "safety.no") == [(0, 0), (15, 1)]


EQUAL = """
[[mic488]]
name = "a"
[[timer]]
name = "pulse"
kind = "pulse"
time = "20 ms"
input = "a.OUT1"
[[relay]]
name = "it"
coil = "{coil}"
pull_in = "20 ms"
drop_out = "7 ms"
[[wire]]
from = "it.no"
to = "a.IN1"
"""


@pytest.mark.parametrize("coil", ["pulse.out", "a.OUT1"])
def test_a_pulse_as_long_as_the_pull_in_moves_a_relay_whatever_gives_it(coil: str) -> None:
    """What is due at a moment comes before an input at the same moment."""
    there = World.from_toml(EQUAL.format(coil=coil))
    out = there.mic488["a"]
    there.at(0.1, lambda: out.write("OUT1", 1))
    there.at(0.12, lambda: out.write("OUT1", 0))
    there.run(until=0.3)
    assert edges(there, "it.no") == [(0, 0), (120, 1), (127, 0)]


def test_faults_of_a_relay() -> None:
    there = World.from_toml(RELAY)
    there.run(until=0.1)
    there.fault("welded-contact element=safety name=weld")
    press(there, "stop1", True)
    there.run(until=0.2)
    assert (there.read("safety.no"), there.read("safety.nc")) == (1, 0)
    there.clear_fault("weld")
    there.run(until=0.3)
    assert there.read("a.IN1") == 0
    there.fault("open-coil element=safety")
    press(there, "stop1", False)
    there.run(until=0.4)
    assert there.read("a.IN1") == 0


def test_an_output_that_is_stuck() -> None:
    there = world('[[gate]]\nname = "it"\nkind = "or"\ninputs = 2\n[[wire]]\nfrom = "it.out"\nto = "a.IN1"')
    there.fault("stuck-output element=it level=1 name=high")
    there.run(for_=0)
    assert there.read("a.IN1") == 1
    press(there, "one", True)
    press(there, "one", False)
    assert there.read("a.IN1") == 1
    there.clear_fault("high")
    there.run(for_=0)
    assert there.read("a.IN1") == 0
    with pytest.raises(Misuse, match="fault stuck-output: output = 'no': outputs of 'it' are out"):
        there.fault("stuck-output element=it output=no")


def test_of_several_faults_of_one_terminal_the_newest_that_lasts_decides() -> None:
    there = world('[[gate]]\nname = "it"\nkind = "or"\ninputs = 2\n')
    for name, terminal, level, end in (("one", "output", 1, 0.3), ("two", "output", 0, 0.3), ("other", "input", 1, 0.15)):
        which = "out" if terminal == "output" else "in1"
        there.fault(f"stuck-{terminal} element=it {terminal}={which} level={level} until_s={end} name={name}")
        there.run(for_=0.1)
    there.fault("stuck-output element=it output=OUT level=0 name=late")
    seen = []
    for moment in (0.31, 0.34, 0.36, 0.41):
        there.run(until=moment)
        seen.append((there.read("it.out"), there.read("it.in1")))
    assert seen == [(0, 1), (0, 1), (0, 0), (0, 0)]
    there.clear_fault("late")
    assert there.read("it.out") == 0
    assert "it ends, but fault late lasts" in [str(record.value) for record in there.trace.of("fault")]


def test_a_relay_stays_welded_until_the_last_fault_ends() -> None:
    there = World.from_toml('[[mic488]]\nname = "a"\n[[relay]]\nname = "r"\ncoil = "a.OUT1"\n')
    there.mic488["a"].write("OUT1", 1)
    there.fault("welded-contact element=r until_s=0.1")
    there.fault("welded-contact element=r until_s=0.2 name=other")
    there.run(until=0.05)
    there.mic488["a"].write("OUT1", 0)
    there.run(until=0.15)
    assert there.read("r.no") == 1
    there.run(until=0.25)
    assert there.read("r.no") == 0


def test_a_contact_that_is_stuck_at_an_input_of_an_element() -> None:
    there = World.from_toml(
        '[[mic488]]\nname = "a"\n[[button]]\nname = "stop1"\nto = "safety.coil"\ncontact = "NC"\n'
        '[[relay]]\nname = "safety"\ndrop_out = "8 ms"\n[[wire]]\nfrom = "safety.no"\nto = "a.IN1"'
    )
    there.fault("stuck-input element=safety input=coil level=1 until_s=0.5")
    press(there, "stop1", True)
    there.run(until=0.499999999)
    assert (there.read("safety.coil"), there.read("a.IN1")) == (1, 1)  # welded: the button stops nothing
    held = there.snapshot()
    for _ in range(2):
        there.run(until=0.507999999)
        assert (there.read("safety.coil"), there.read("a.IN1")) == (0, 1)
        there.run(until=0.508)
        assert there.read("a.IN1") == 0
        there.restore(held)
        assert there.read("safety.coil") == 1
    with pytest.raises(Misuse, match=r"fault stuck-input: input = 'no': inputs of 'safety' are coil$"):
        there.fault("stuck-input element=safety input=no")


GATE = """
[[mic488]]
name = "a"
[[gate]]
name = "it"
kind = "and"
inputs = ["a.OUT1", "a.OUT2"]
[[wire]]
from = "it.out"
to = "a.IN1"
"""


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ('"a.OUT2"', '"a.IN2"', r"a.IN2 is not an output: outputs of 'a' are OUT1"),
        ('"a.OUT2"', '"b.OUT2"', "nothing is called 'b'"),
        ('["a.OUT1", "a.OUT2"]', "[]", "0 terminals: permitted are 1 to 32"),
        ('["a.OUT1", "a.OUT2"]', "33", "33: permitted are whole numbers from 1 to 32"),
        ('"and"', '"not"', "a gate of kind 'not' has one input, not 2"),
        ('"and"', '"nan"', r"'nan' \(did you mean 'nand'\?\): permitted are and, or, nand"),
        ('"it.out"', '"it.q"', "it.Q is not an output: outputs of 'it' are OUT"),
        ('to = "a.IN1"', 'to = "it.in1"', "it.IN1 is driven already"),
    ],
)
def test_mistakes_have_their_places(old: str, new: str, text: str) -> None:
    with pytest.raises(WorldError, match=text):
        World.from_toml(GATE.replace(old, new, 1))


def test_an_element_belongs_to_a_controller() -> None:
    with pytest.raises(WorldError, match="nothing joins 'it' to a controller"):
        World.from_toml('[[mic488]]\nname = "a"\n[[gate]]\nname = "it"\nkind = "or"\ninputs = 2')


def test_a_loop_that_does_not_settle_is_reported() -> None:
    with pytest.raises(Runaway, match="a loop of wires"):
        World.from_toml(
            '[[mic488]]\nname = "a"\n[[gate]]\nname = "it"\nkind = "not"\ninputs = ["it.out"]\n'
            '[[wire]]\nfrom = "it.out"\nto = "a.IN1"'
        ).run(for_=0.01)


# ---------------------------------------------------------------------- joints in the table of an element

JOINED = """
[[mic488]]
name = "a"
[[mic488]]
name = "b"
[[{kind}]]
name = "it"
{keys}
"""


@pytest.mark.parametrize(
    ("kind", "keys", "moves", "outputs"),
    [
        ("relay", 'coil = "a.OUT3"', ["OUT3"], {"no": [1.0], "nc": [0.0]}),
        ("timer", 'kind = "off-delay"\ntime = "1 h"\ninput = "a.OUT3"', ["OUT3", "-OUT3"], {"out": [1.0, 1.0]}),
        ("latch", 'set = "a.OUT3"\nreset = "b.OUT4"', ["OUT3", "-OUT3", "OUT4"], {"out": [1.0, 1.0, 0.0]}),
        (
            "counter",
            'preset = 2\nup = "a.OUT3"\ndown = "b.OUT4"\nreset = "a.OUT5"',
            ["OUT3", "-OUT3", "OUT3", "OUT4", "-OUT3", "OUT3", "OUT5"],
            {"out": [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0], "count": [1.0, 1.0, 2.0, 1.0, 1.0, 2.0, 0.0]},
        ),
        ("gate", 'kind = "xor"\ninputs = ["a.OUT3", "b.OUT4"]', ["OUT3", "OUT4", "-OUT3"], {"out": [1.0, 0.0, 1.0]}),
    ],
)
def test_inputs_are_joined_by_the_keys_of_the_table(
    kind: str, keys: str, moves: list[str], outputs: dict[str, list[float]]
) -> None:
    """Each key joins the input of its name, with outputs of any controller; OUT4 is that of b."""
    there = World.from_toml(JOINED.format(kind=kind, keys=keys))
    shown: dict[str, list[float]] = {name: [] for name in outputs}
    for move in moves:
        pin = move.removeprefix("-")
        there.mic488["b" if pin == "OUT4" else "a"].write(pin, 0 if move.startswith("-") else 1)
        there.run(for_=0.001)
        for name, seen in shown.items():
            seen.append(there.read(f"it.{name}"))
    assert shown == outputs


def test_a_conveyor_is_joined_by_its_keys() -> None:
    there = World.from_toml(
        JOINED.format(kind="conveyor", keys='length = 400.0\nspeed = 100.0\nrun = "a.OUT3"\nfeed = "b.OUT4"\nworkpiece = 10.0')
    )
    there.mic488["b"].write("OUT4", 1)
    there.run(for_=1.0)
    assert [str(record.value) for record in there.trace.of("event") if record.subject == "workpiece"] == ["it.1 is on it"]
    there.mic488["a"].write("OUT3", 1)
    there.run(for_=5.0)
    assert [str(record.value) for record in there.trace.of("event") if record.subject == "workpiece"][1:] == ["it.1 leaves it"]


def test_joints_are_checked() -> None:
    with pytest.raises(WorldError, match="OUT99"):
        World.from_toml(JOINED.format(kind="relay", keys='coil = "a.OUT99"'))
