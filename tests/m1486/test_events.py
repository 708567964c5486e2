"""What a chip reports of itself: the text for people, and the same as facts (`steptwin.m1486.events`)."""

from __future__ import annotations

import pytest
from m1486_rig import Bench

# Slow, and with no ramp at V not above S (M-8): 80 full steps are 5120 minimum microsteps a second.
SLOW = ("s200", "v80")


@pytest.mark.parametrize(
    ("lines", "code", "text", "facts"),
    [
        (["[", "f64", "w5", "]"], "file", "a file of 64 bits", {"size": 64}),
        ([*SLOW, "f640", "r"], "moves", "moves +640 to 640 in 0.125000 s", {"axis": 1, "direction": 1, "distance": 640}),
        (
            [*SLOW, "b640", "r"],
            "moves",
            "moves -640 to 16776576 (-640) in 0.125000 s",
            {"axis": 1, "direction": -1, "distance": -640},
        ),
        (["g+", "r", "k"], "moves", "moves on in positive direction", {"axis": 1, "direction": 1}),
        (["g-", "r", "k"], "moves", "moves on in negative direction", {"axis": 1, "direction": -1}),
        ([")4", "k"], "seeks", "seeks B4 in positive direction", {"axis": 1, "direction": 1, "line": 4}),
        (["(4", "k"], "seeks", "seeks B4 in negative direction", {"axis": 1, "direction": -1, "line": 4}),
        (["f640", "r"], "stands", "stands at 640", {"axis": 1, "counter": 640, "is_valid": True}),
        (
            ["f640000", "r", "k"],
            "stands",
            "stands at 640000, position not valid",
            {"axis": 1, "counter": 640_000, "is_valid": False},
        ),
        (["f640000", "r", "k"], "stops", "stops: Kill", {"axis": 1, "why": "Kill"}),
        (["w5"], "wait", "waits 5 ms", {"duration": 5_000_000}),
        (["o4"], "wait", "waits until B4 is high", {"line": 4, "level": 1}),
        (["c3"], "output", "B3 low", {"line": 3, "level": 0}),
        (["c3", "t3"], "output", "B3 high", {"line": 3, "level": 1}),
        (["u20"], "upload", "U20 sends 42H", {"command": 20, "byte": 0x42}),
        (["k"], "kill", "Kill", {}),
        (["c75"], "clear-kill", "Clear kill", {}),
        (["\\"], "reset", "reset", {}),
        (
            ["j1"],
            "wrong-data",
            "wrong data: there is no label 1; the program stops",
            {"why": "there is no label 1", "stops": True},
        ),
        (["t44", "j1"], "wrong-data", "wrong data: there is no label 1", {"why": "there is no label 1", "stops": False}),
    ],
)
def test_an_event_says_what_happened(lines: list[str], code: str, text: str, facts: dict[str, object]) -> None:
    bench = Bench("B")
    bench.pin(B4=0)
    for line in lines:
        bench.send(line)
        bench.run(ms=20)
    bench.run(1)
    event = bench.events(code)[-1]
    assert event.text == text
    assert list(event.facts) == list(facts.items())


def test_times_of_a_chip_with_24_mhz_are_half() -> None:
    bench = Bench("B2x")
    bench.do("w5")
    (event,) = bench.events("wait")
    assert (event.text, event.facts) == ("waits 2.5 ms", (("duration", 2_500_000),))


def test_events_of_rst_shutdown_and_power() -> None:
    bench = Bench("B", address=3)
    bench.pin(RST=1)
    assert bench.chip.events[-1][1:] == ("restart", "RST: the program begins again", ())
    bench.pin(SD=0)
    assert bench.chip.events[-1][1:] == ("shutdown", "shutdown", ())
    bench.pin(SD=1, RST=0)
    bench.pin(RST=1)
    bench.run(ms=10)
    assert bench.chip.events[-1][1:] == ("restart", "shutdown is over: the program begins again", ())
    bench.chip.power_cycle(bench.now)
    assert bench.chip.events[-1][1:] == ("power-on", "power-on", ())
    bench.pin(ADDR0=0, ADDR1=0, RST=0)
    bench.pin(RST=1)
    assert bench.chip.events[-1][1:] == ("reset", "RST with all address pins low: reset", ())
