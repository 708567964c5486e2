"""Power supplies: when controllers are on, against ramps by hand; and what is off does not answer."""

from __future__ import annotations

from pathlib import Path

import pytest

from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.files.recording import load, recording_of, save
from steptwin.files.world import World
from steptwin.simulation.components.supply import SUPPLY, Ramp
from steptwin.simulation.toml.reader import WorldError

TEXT = """
[[line]]
name = "bus"
kind = "modbus"
[[mic488]]
name = "a"
line = "bus"
program = "a.prg"
start = true
[[mic488]]
name = "b"
program = "a.prg"
start = true
[[m1486]]
name = "c"
[[button]]
name = "main"
to = "logic.on"
[[supply]]
name = "logic"
feeds = ["a", "c"]
switched = true
volts = 24
enough = 18
delay = "200 ms"
rise = "80 ms"
hold_up = "10 ms"
fall = "240 ms"
[[supply]]
name = "power"
feeds = "b"
on = "logic.good"
delay = "1 s"
rise = "100 ms"
fall = "100 ms"
{more}
"""
PROGRAM = b"OUT1 = ON\nM1 = ON\nWAIT IN9 = ON\n"


def world(more: str = "", text: str = TEXT) -> World:
    return World.from_toml(text.format(more=more), {"a.prg": PROGRAM}, name="w.toml")


def edges(found: World, subject: str) -> list[tuple[float, object]]:
    return [(record.time / SECOND, record.value) for record in found.trace.edges() if record.subject == subject and record.time]


def supplies(found: World) -> list[tuple[float, str]]:
    return [(record.time / SECOND, str(record.value)) for record in found.trace.of("event") if record.subject == "supply"]


def press(found: World, pressed: bool = True) -> None:
    found.press("main") if pressed else found.release("main")


def test_controllers_come_on_in_the_order_of_their_supplies() -> None:
    found = world()
    found.run(for_=1.0)
    assert (found.read("a.OUT1"), found.read("b.OUT1"), found.read("a.M1.enabled")) == (0, 0, 0)
    press(found)
    found.run(for_=3.0)
    # 18 of 24 V after three quarters of the ramp; then those of the power supply.
    logic, power = 1.0 + 0.2 + 0.06, 1.0 + 0.2 + 0.06 + 1.0 + 0.075
    assert supplies(found) == [(logic, "logic is on, with a, c"), (power, "power is on, with b")]
    assert edges(found, "logic.good") == [(logic, 1.0)]
    on = [record.time / SECOND for record in found.trace.edges() if record.subject == "OUT1"]
    assert on == pytest.approx([logic, power], abs=0.01)
    assert (found.read("a.OUT1"), found.read("b.OUT1")) == (1, 1)


def test_the_voltage_is_a_ramp() -> None:
    found = world()
    press(found)
    for moment, volts in ((0.2, 0.0), (0.22, 6.0), (0.26, 18.0), (0.28, 24.0), (0.5, 24.0)):
        found.run(until=moment)
        assert found.read("logic.volts") == pytest.approx(volts, abs=1e-9)
    press(found, pressed=False)
    for moment, volts in ((0.51, 24.0), (0.53, 22.0), (0.57, 18.0), (0.74, 1.0), (0.75, 0.0)):
        found.run(until=moment)
        assert found.read("logic.volts") == pytest.approx(volts, abs=1e-6)
    assert edges(found, "logic.good")[1] == (pytest.approx(0.57, abs=2e-9), 0.0)
    again = world()
    press(again)
    again.run(until="logic.volts > 6 V", for_=1)
    assert again.time == pytest.approx(0.22, abs=2e-9)


def test_a_switch_that_is_off_for_less_than_the_hold_up_is_not_noticed() -> None:
    found = world()
    press(found)
    found.run(for_=2)
    press(found, pressed=False)
    found.run(for_=0.009)
    press(found)
    found.run(for_=1)
    assert [level for _, level in edges(found, "logic.good")] == [1.0]
    press(found, pressed=False)
    found.run(for_=0.05)  # 4 V less
    press(found)
    found.run(for_=3)
    assert [level for _, level in edges(found, "logic.good")] == [1.0, 0.0, 1.0], "it begins with its delay again"
    assert found.read("a.OUT1") == 1


@pytest.mark.parametrize(("volts", "resets"), [(18.1, False), (17.9, True), (0.0, True)])
def test_a_brown_out_resets_what_has_not_enough(volts: float, resets: bool) -> None:
    found = world()
    press(found)
    found.run(for_=3)
    before = found.now / SECOND
    found.fault(f"brown-out element=logic volts={volts} name=sag")
    found.run(for_=0.3)
    assert found.read("logic.volts") == volts
    assert (found.read("a.OUT1") == 0) is resets
    assert (found.read("a.M1.enabled") == 0) is resets
    found.clear_fault("sag")
    found.run(for_=2)
    assert found.read("a.OUT1") == 1
    moments = [moment for moment, _ in edges(found, "logic.good")][1:]
    if not resets:
        assert moments == []
        return
    low = min(24 - volts, 24.0)
    assert moments[0] == pytest.approx(before + 0.06, abs=1e-8), "6 of 24 V in a quarter of 240 ms"
    assert moments[1] == pytest.approx(before + 0.3 + (low - 6) / 24 * 0.08, abs=1e-8)


def test_what_is_off_does_not_answer() -> None:
    steps = '{ write = { "a.M1_ACC" = 500 } }, { note = "first" }, { at = "3 s" }, { write = { "a.M1_ACC" = 600 } }'
    found = world(f'[[script]]\nname = "s"\nsteps = [{steps}]\n')
    found.run(for_=2)
    notes = [record.time / SECOND for record in found.trace if record.subject == "note"]
    assert notes == [pytest.approx(1.0, abs=0.02)], "given up after a second"
    press(found)
    found.run(for_=2)
    assert found.read("a.M1_ACC") == 600


def test_what_a_supply_feeds_is_not_power_cycled_otherwise() -> None:
    found = world()
    with pytest.raises(Misuse, match="'a' is switched by its supply 'logic'"):
        found.mic488["a"].power_cycle()
    with pytest.raises(WorldError, match="'b' is switched by its supply 'power'"):
        world('[[script]]\nname = "s"\nsteps = [{ power_cycle = "b" }]')


def test_a_supply_that_drops_while_the_fault_of_a_controller_lasts() -> None:
    found = world()
    press(found)
    found.run(for_=2.5)
    found.fault("supply-drop machine=a at_s=0.1 for_s=1")
    found.run(for_=0.2)
    assert found.read("a.OUT1") == 0
    press(found, pressed=False)
    found.run(until=5)
    assert found.read("a.OUT1") == 0, "its own fault is over, the supply is off"
    press(found)
    found.run(for_=2)
    assert found.read("a.OUT1") == 1


def test_all_of_its_voltage_may_be_needed() -> None:
    found = {one.name: one for one in world(text=TEXT.replace("enough = 18", "enough = 24")).spec.elements.of(SUPPLY)}
    assert (found["logic"].enough, found["logic"].threshold) == (24.0, 24.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('feeds = "b"', 'feeds = "bb"'), r"nothing is called 'bb'"),
        (('feeds = "b"', 'feeds = ["b", "b"]'), "a controller is named twice"),
        (('feeds = "b"', 'feeds = ["b", "a"]'), "'a' has the supply 'logic' already"),
        (('feeds = "b"', 'feeds = "logic"'), "'logic' is an element"),
        (('on = "logic.good"', 'on = "power.good"'), "on: power waits for power, so that it never comes on"),
        (("enough = 18", "enough = 25"), "enough = 25 V is more than volts = 24"),
        (("enough = 18", "enough = 24.001"), "enough = 24.001 V is more than volts = 24"),
        (("enough = 18", "enogh = 18"), r"\[supply\] has no 'enogh' \(did you mean 'enough'\?\)"),
        (("switched = true\n", ""), "digital inputs of 'logic' are none"),
        (('on = "logic.good"', 'on = "logic.godo"'), "logic.GODO is not an output"),
    ],
)
def test_mistakes_have_their_places(change: tuple[str, str], message: str) -> None:
    assert change[0] in TEXT
    with pytest.raises(WorldError, match=f"(?s)w.toml:.*{message}"):
        world(text=TEXT.replace(*change))


@pytest.mark.parametrize("moment_s", [0.0, 0.23, 0.6, 1.4, 1.55, 2.1, 3.0])
def test_it_can_be_restored_anywhere(moment_s: float, tmp_path: Path) -> None:
    found, other = world(), world()
    found.at(0.1, lambda: press(found))
    found.fault("brown-out element=logic volts=10 from_s=1.5 until_s=2.0")
    found.run(until=moment_s)
    place = tmp_path / "s.json"
    if moment_s >= 0.1:
        snapshot = found.snapshot()
        found.run(until=5.0)
        other.restore(snapshot)
        other.run(until=5.0)
        assert other.trace.digest() == found.trace.digest()
    found.run(until=5.0)
    assert len(edges(found, "logic.good")) == 3
    save(recording_of(found), place)
    assert load(place).replay().trace.digest() == found.trace.digest()


@pytest.mark.parametrize(
    ("ramp", "volts"),
    [
        (Ramp(100, 3.0, 24.0, 0.5), [3.0, 3.5, 4.0]),
        (Ramp(100, 24.0, 3.0, 0.5), [24.0, 23.5, 23.0]),
        (Ramp(100, 3.0, 24.0, 0.0), [24.0, 24.0, 24.0]),
        (Ramp(100, 3.0, 3.0, 0.5), [3.0, 3.0, 3.0]),
    ],
)
def test_the_voltage_of_a_ramp(ramp: Ramp, volts: list[float]) -> None:
    assert [ramp.at(now) for now in (100, 101, 102)] == volts
    assert ramp.at(10_000) == ramp.target


@pytest.mark.parametrize(
    ("ramp", "end"),
    [
        (Ramp(100, 3.0, 24.0, 0.5), 142),
        (Ramp(100, 24.0, 3.0, 0.5), 142),
        (Ramp(100, 3.0, 24.0, 0.4), 153),  # 52.5 ns
        (Ramp(100, 3.0, 24.0, 0.0), 100),
    ],
)
def test_the_end_of_a_ramp(ramp: Ramp, end: int) -> None:
    assert ramp.end == end
    assert ramp.at(end) == ramp.target
    assert end == 100 or ramp.at(end - 1) != ramp.target


@pytest.mark.parametrize("level", [0.0, 3.0, 3.1, 10.0, 10.25, 18.0, 23.9, 24.0, 25.0])
@pytest.mark.parametrize("after", [100, 101, 114, 141, 142, 150])
@pytest.mark.parametrize(("first", "target"), [(3.0, 24.0), (24.0, 3.0), (3.0, 3.0)])
def test_when_a_ramp_crosses_a_level(first: float, target: float, after: int, level: float) -> None:
    """The first nanosecond in which it is at or above, or below it, as a walk finds it."""
    ramp = Ramp(100, first, target, 0.5)
    high = ramp.at(after) >= level
    expected = next((now for now in range(after + 1, 200) if (ramp.at(now) >= level) is not high), None)
    assert ramp.crosses(level, after) == expected
