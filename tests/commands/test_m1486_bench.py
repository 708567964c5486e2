"""Programs of the M1486 in virtual time: what is typed when, when a run ends, and that looking changes nothing."""

from __future__ import annotations

import pytest

from steptwin.commands import m1486_bench
from steptwin.commands.m1486_bench import Bench, Ending, Happening, Input
from steptwin.m1486.chip import M1486
from steptwin.m1486.variants import variant
from steptwin.machine import MILLISECOND, SECOND
from steptwin.served.m1486 import ChainOptions, chip_name, make_chips, parse_wire
from steptwin.world.trace import Trace

EXAMPLE_6 = """
x0
:0
l20
[
c1
t1
w2000
+64
f
r
e
]
x7
[
s70
a1000
f25600
@2
z3
r
d
j2
]
"""


class Ran:
    """A run and all it told."""

    def __init__(
        self,
        text: str,
        *,
        kind: str = "B",
        addresses: tuple[int, ...] = (15,),
        wires: tuple[str, ...] = (),
        inputs: tuple[Input, ...] = (),
        limit: int = 60 * SECOND,
        until_idle: bool = False,
    ) -> None:
        chain = ChainOptions(variant=variant(kind), addresses=addresses)
        self.chips: dict[str, M1486] = {chip_name(a): chip for a, chip in make_chips(chain).items()}
        self.trace = Trace(self.chips)
        self.bench = Bench(self.chips, text, [parse_wire(wire) for wire in wires], self.trace)
        self.told: list[Happening] = []
        self.ending: Ending = self.bench.run(inputs, limit, self._look, until_idle=until_idle)

    def _look(self) -> None:
        self.told += self.bench.happened
        self.bench.happened.clear()

    def times(self, code: str, chip: str = "F") -> list[int]:
        return [each.event.time // MILLISECOND for each in self.told if each.event.code == code and each.chip == chip]


def test_a_program_ends_with_its_last_command() -> None:
    assert Ran("f640\nr\n").ending == Ending(41 * MILLISECOND, "idle")
    assert Ran("w2500\n").ending == Ending(2500 * MILLISECOND, "idle")
    assert Ran("w2500\n", until_idle=True).ending == Ending(2500 * MILLISECOND, "idle")
    assert Ran("c1\nc2\n").ending == Ending(2 * MILLISECOND, "idle")
    assert Ran("").ending == Ending(0, "idle")


def test_the_limit_ends_what_does_not_end() -> None:
    ran = Ran("[\n@1\n+1\nj1\n]\n", limit=3_500 * MILLISECOND)
    assert ran.ending == Ending(3_500 * MILLISECOND, "limit")
    assert ran.chips["F"].unit.variable == 1751


def test_a_program_that_waits_for_ever() -> None:
    assert Ran("w100\nz3\n", limit=10 * SECOND).ending == Ending(10 * SECOND, "limit")
    assert Ran("w100\nz3\n", limit=10 * SECOND, until_idle=True).ending == Ending(101 * MILLISECOND, "waiting")


def test_inputs_come_at_their_moments() -> None:
    inputs = (Input(1500 * MILLISECOND, "F", "B3", 0), Input(1500 * MILLISECOND, "F", "B4", 0), Input(2 * SECOND, "F", "B3", 1))
    ran = Ran("z3\nc1\no3\nt1\n", inputs=inputs, until_idle=True)
    assert ran.times("input") == [1500, 1500, 2000]
    assert ran.times("output") == [1500, 2000]
    assert [record.time for record in ran.trace.inputs()] == [each.time for each in inputs]
    assert [(r.time, r.value) for r in ran.trace.edges() if r.subject == "B3"] == [(1500 * MILLISECOND, 0.0), (2 * SECOND, 1.0)]


def test_a_run_waits_for_inputs_that_are_to_come() -> None:
    ran = Ran("c1\n", inputs=(Input(2 * SECOND, "F", "B3", 0),))
    assert ran.ending == Ending(2 * SECOND, "idle")


def test_lines_are_typed_as_there_is_room() -> None:
    """Compression rests while the motor runs, and the buffer of an A holds 12 characters: a host that does not wait would
    lose some."""
    moves = 40
    ran = Ran("f640\nr\nb640\nr\n" * moves, kind="A")
    assert len(ran.times("moves")) == 2 * moves
    assert ran.times("wrong-data") == []
    assert (ran.bench.untyped, ran.bench.sent["F"]) == (0, b"")
    assert ran.ending.why == "idle"


def test_what_was_never_taken_is_counted() -> None:
    ran = Ran("g+\nr\n" + "f640\n" * 100, limit=SECOND)
    assert ran.ending.why == "limit"
    assert ran.bench.untyped == 101 - 63 - 1  # as many as the memory holds, and one in the buffer


def test_example_6_of_the_manual() -> None:
    ran = Ran(EXAMPLE_6, addresses=(0, 7), wires=("0.B1=7.B3",), limit=10 * SECOND)
    low = [each.event.time for each in ran.told if (each.chip, each.event.text) == ("0", "B1 low")]
    moved = [each.event.time for each in ran.told if (each.chip, each.event.code) == ("7", "moves")]
    assert len(low) == len(moved) == 5
    assert moved[1:] == low[1:]
    assert moved[0] - low[0] == 2 * MILLISECOND  # it had not come to its Z yet


@pytest.mark.parametrize("wires", [(), ("0.B2=7.B2",)])
def test_a_run_is_the_same_however_often_it_is_looked_at(monkeypatch: pytest.MonkeyPatch, wires: tuple[str, ...]) -> None:
    """With chips on their own and with chips in a kernel."""
    digests = set()
    for part in (SECOND, 10 * MILLISECOND, 1_234_567):
        monkeypatch.setattr(m1486_bench, "SLICE_NS", part)
        ran = Ran(EXAMPLE_6, addresses=(0, 7), wires=wires, limit=5 * SECOND)
        digests.add(ran.trace.digest())
        assert len(ran.trace) > 20
    assert len(digests) == 1


def test_plans_and_waveforms_are_recorded() -> None:
    ran = Ran("n3\nf640\nr\nn1\n")
    plans = list(ran.trace.plans())
    assert [(record.time, record.subject) for record in plans] == [(2 * MILLISECOND, "1")]
    assert [record.value for record in ran.trace.edges() if record.subject == "N"] == [3.0, 1.0]


def test_kill_is_in_the_trace() -> None:
    ran = Ran("k\n")
    assert [(record.kind, record.subject, record.value) for record in ran.trace] == [("event", "kill", "Kill")]
