"""A stop of its world ends what a chip was given before, wherever that lies."""

from __future__ import annotations

import pytest
from m1486_rig import Bench, moving


def halt(bench: Bench) -> None:
    bench.chip.halt(bench.now)


@pytest.mark.parametrize("kind", ["A", "B", "C", "E1", "E2"])
@pytest.mark.parametrize("setup", [(), ("t44",), ("c51",)], ids=["as usual", "function 44 ON", "function 51 OFF"])
@pytest.mark.parametrize("ms", [0.0, 1.0, 300.0, 700.0, 1200.0])
def test_nothing_begins_and_what_is_typed_behind_it_is_done(kind: str, setup: tuple[str, ...], ms: float) -> None:
    bench = Bench(kind)
    bench.do(*setup)
    bench.send("f6400", "r", "b640", "r")
    bench.run(ms=ms)
    halt(bench)
    begun = len(bench.events("moves"))
    bench.run(5.0)
    assert len(bench.events("moves")) == begun
    stood = bench.true
    bench.send("f640", "r")
    bench.finish()
    assert bench.true == stood + 640
    assert bench.chip.is_idle()


def test_a_motion_ends_with_its_ramp_and_its_program_with_it() -> None:
    bench = moving("v2000", "f640000", seconds=0.5)
    halt(bench)
    assert bench.chip.drive.is_busy
    bench.finish()
    bench.file("@5", "f640", "r", "w10", "j5")
    bench.run(0.5)
    halt(bench)
    begun = len(bench.events("moves"))
    bench.run(2.0)
    assert len(bench.events("moves")) == begun


def test_what_is_on_the_line_is_dropped_but_x() -> None:
    """So that the same chips listen as without the stop; the rest of a line that has begun is dropped when it comes."""
    bench = Bench("B", is_timed=True, baud=300, address=7)
    bench.raw(b"f640\rr\rx3\rv2")
    bench.run(ms=90)  # two characters have arrived
    halt(bench)
    bench.raw(b"00\rf640\rr\r")
    bench.run(5.0)
    assert (bench.true, bench.chip.receiver.is_listening, bench.chip.drive.velocity) == (0, False, 1000)
    bench.raw(b"x7\rf64\r")
    bench.run(1.0)
    bench.raw(b"f12")
    bench.run(1.0)
    halt(bench)
    bench.raw(b"8\rr\r")  # not F8, nor 128
    bench.finish()
    assert bench.true == 64


def test_a_file_that_is_being_received_does_not_run() -> None:
    bench = Bench("B")
    bench.send("[", "f640", "r")
    halt(bench)
    bench.send("f640", "r", "]")
    bench.finish()
    assert bench.true == 0
    bench.file("f64", "r")
    bench.finish()
    assert bench.true == 64


def test_a_chip_that_is_shut_down_has_nothing_to_stop() -> None:
    bench = Bench("B")
    bench.pin(SD=0)
    halt(bench)
    bench.run(1.0)
    assert bench.chip.is_shut_down
