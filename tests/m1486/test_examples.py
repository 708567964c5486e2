"""The manual's motion programs 1 to 6 (chapter VIII) do what their comments say, on chips that get them over the line."""

from __future__ import annotations

import pytest
from m1486_rig import Bench

from steptwin.controller import MILLISECOND, SECOND
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.line import SerialChain
from steptwin.m1486.variants import variant
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.wires import PinName, Wire

STEP = 64


def characters(text: str) -> bytes:
    """A listing as a terminal sends it: comments and blank lines too."""
    return text.replace("\n", "\r\n").encode()


def loaded(text: str, kind: str = "A", **pins: int) -> Bench:
    bench = Bench(kind)
    bench.pin(**pins)
    assert bench.raw(characters(text)) == b""
    assert bench.wrong == []
    return bench


def cruise(bench: Bench) -> float:
    """Highest speed of the present move in full steps/s."""
    profile = bench.chip.drive.profile
    assert profile.end is not None
    return abs(profile.velocity((profile.start + profile.end) // 2)) / STEP


@pytest.mark.parametrize("kind", ["A", "B", "C", "A2x"])
def test_example_1_one_revolution(manual_examples: dict[int, str], kind: str) -> None:
    bench = loaded(manual_examples[1], kind)
    bench.finish()
    clock = bench.chip.variant.clock
    assert bench.counter == 200 * STEP
    # Defaults (M-3): 96 steps up to 1000 step/s in 160 ms, 8 steps, and down.
    [stands] = bench.events("stands")
    assert (stands.time - bench.events("moves")[0].time) / SECOND == pytest.approx(0.328 / clock, abs=2e-9)


def test_example_1_on_e_types_needs_a_pause_after_the_reset(manual_examples: dict[int, str]) -> None:
    bench = Bench("E1")
    bench.raw(characters(manual_examples[1]))
    bench.finish()
    assert bench.true == 0
    bench.do("\\")
    bench.do("f12800", "r")
    assert bench.true == 12_800


def test_example_2_three_moves_with_pauses(manual_examples: dict[int, str]) -> None:
    bench = loaded(manual_examples[2])
    bench.finish()
    assert bench.counter == 3 * 619 * STEP
    begins, ends = bench.events("moves"), bench.events("stands")
    assert len(begins) == len(ends) == 3
    # W250 waits 250 ms; W, E and R take a millisecond each and the next R begins after it.
    for end, begin in zip(ends, begins[1:], strict=False):
        assert 250 * MILLISECOND <= begin.time - end.time <= 252 * MILLISECOND
    assert cruise(bench) == 1000


@pytest.mark.parametrize("number", [3, 4])
@pytest.mark.parametrize(("b1", "b2", "velocity"), [(0, 0, 370), (1, 0, 1230), (0, 1, 1450), (1, 1, 1920)])
def test_examples_3_and_4_inputs_choose_the_speed(
    manual_examples: dict[int, str], number: int, b1: int, b2: int, velocity: int
) -> None:
    bench = loaded(manual_examples[number], B1=b1, B2=b2)
    bench.run(ms=20)
    assert bench.chip.drive.is_busy
    assert cruise(bench) == velocity
    # The choice is made anew for each move.
    bench.pin(B1=0, B2=0)
    while len(bench.events("moves")) < 2:
        bench.run(0.1)
    assert cruise(bench) == 370
    assert bench.wrong == []


@pytest.mark.parametrize("tens", range(10))
def test_example_5_bcd_digits_through_a_multiplexer(manual_examples: dict[int, str], tens: int) -> None:
    ones = (tens + 3) % 10

    def select(digit: int) -> None:
        bench.pin(**{f"B{line}": digit >> line - 1 & 1 for line in range(1, 5)})

    bench = Bench("A")
    # The multiplexer gives the tens while line 8 is high, the ones while it is low.
    select(tens)
    bench.raw(characters(manual_examples[5]))
    while bench.level("B8"):
        bench.run(ms=0.5)
    select(ones)
    bench.finish()
    value = 10 * tens + ones
    assert bench.variable == value
    assert bench.chip.drive.acceleration == (value or 5000)
    assert bool(bench.wrong) is (value == 0)


@pytest.mark.parametrize("is_timed", [False, True])
def test_example_6_two_chips_joined_by_a_wire(manual_examples: dict[int, str], is_timed: bool) -> None:
    chips = {n: M1486Chip(variant("B"), address=n, is_timed=is_timed) for n in (0, 7)}
    world = Scheduler()
    for n, chip in chips.items():
        world.add(f"chip {n}", chip)
    world.connect(Wire(PinName("chip 0", "B1"), PinName("chip 7", "B3")))
    line = SerialChain(chips.values())
    port = line.port()
    # Chip 0 is at work on its loop while chip 7 gets its file.
    line.receive(characters(manual_examples[6]), 0)
    world.advance(120 * SECOND)
    assert [event for chip in chips.values() for event in chip.events if event.code == "wrong-data"] == []
    # Chip 0: f64, f128, ... twenty times.
    moves = [event.text for event in chips[0].events if event.code == "moves"]
    assert [int(text.split()[1]) for text in moves] == [STEP * n for n in range(1, 21)]
    assert chips[0].drive.true_u(world.now) == STEP * 210
    # Chip 7: 400 full steps forth and back, one move for each pulse that falls while it waits.
    pulses = [event.time for event in chips[0].events if event.text == "B1 low"]
    moves7 = [event for event in chips[7].events if event.code == "moves"]
    assert len(pulses) == 20
    missed = sum(1 for event in pulses if event < chips[7].events[0].time)
    assert len(moves7) == 20 - missed >= 19
    assert [int(event.text.split()[1]) for event in moves7[:4]] == [25_600, -25_600, 25_600, -25_600]
    assert chips[7].drive.true_u(world.now) in (0, 25_600)
    # Each move begins within two commands of its pulse.
    for pulse, move in zip(pulses[missed:], moves7, strict=True):
        assert 0 <= move.time - pulse <= 2 * MILLISECOND
    assert port.to_send(world.now) == []


# ---------------------------------------------------------------------- the programs of chapter VII

IF_EXAMPLE = "[\n@1\nw3000\ni7h3\nb64000\nr\nj1\n@3\nf6400\nr\nj1\n]\n"
# The scan of the manual has i116.
SUBROUTINE_EXAMPLE = "[\n@1\ni1l6\nf12800\n'3\nz3\nj1\n@6\nb25600\n'3\nz4\nj1\n@3\nr\nw2000\nd\nr\n.\n]\n"


@pytest.mark.parametrize(("b7", "distance"), [(0, -64_000), (1, 6400)])
def test_the_example_of_if(b7: int, distance: int) -> None:
    bench = loaded(IF_EXAMPLE, B7=b7)
    bench.run(3.5)
    assert bench.chip.drive.distance_u == distance
    assert bench.events("moves")[0].time == 3 * SECOND + 2 * MILLISECOND


@pytest.mark.parametrize(("b1", "distance", "waits_for"), [(1, 12_800, 3), (0, -25_600, 4)])
def test_the_example_of_subroutine(b1: int, distance: int, waits_for: int) -> None:
    bench = loaded(SUBROUTINE_EXAMPLE, B1=b1)
    bench.run(20.0)
    moves = [int(event.text.split()[1]) for event in bench.events("moves")]
    assert moves == [distance, -distance]
    assert bench.events("wait")[-1].text == f"waits until B{waits_for} is low"
    # The next round begins when the line lets it, at the condition.
    bench.pin(B1=1 - b1)
    bench.pin(**{f"B{waits_for}": 0})
    bench.run(1.0)
    assert bench.chip.drive.distance_u == (-25_600 if b1 else 12_800)
