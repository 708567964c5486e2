"""The M1486 as a kind of device: what the commands of the shell do with it. The chips live in virtual time."""

from __future__ import annotations

from dataclasses import replace
from typing import NoReturn

import pytest
from chip_rig import KNOWN, ChipWire, chip_driver, typed
from line_rig import at_every_address, run_virtual

from steptwin.controller import Nanos
from steptwin.drivers.exchange import LineLost
from steptwin.drivers.kind import DeviceAddress, DeviceMotion, DriverKind, EndedMotion, FoundDevice, WantedMoves
from steptwin.drivers.m1486 import kind
from steptwin.drivers.m1486.failures import WrongType
from steptwin.drivers.m1486.jog import LINK_S
from steptwin.drivers.m1486.kind import GOES_ON, LOST, M1486_DRIVER
from steptwin.drivers.m1486.sync import M1486
from steptwin.errors import Misuse, Refusal
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection

ADDRESS = DeviceAddress("memory", "m1486", 7, 4800, 1.0)


def ready(wire: ChipWire) -> M1486:
    chip = chip_driver(wire, 7)
    chip.configure(**KNOWN)
    return chip


def carried_out(chip: M1486, motion: DeviceMotion[M1486], checks: int) -> EndedMotion:
    begun: set[int] = set()
    seen: list[set[int]] = []
    assert tuple(motion.axes) == (1,)
    motion.begin(chip, begun, lambda: seen.append(set(begun)))
    assert (begun, seen) == ({1}, [set()] * checks)
    (end,) = M1486_DRIVER.wait(chip, (1,), None)
    return motion.end(chip, end)


def test_a_move() -> None:
    wire = ChipWire(addresses=(7,))
    chip = ready(wire)
    end = carried_out(chip, M1486_DRIVER.move(WantedMoves({1: 50.0}, False, None)), 2)
    assert (end.axis, end.name, end.ok, end.position, end.unit) == (1, "chip 7", True, 50.0, "step")
    assert not end.is_overdue
    assert end.after_s > 0.0
    assert chip.settings.velocity == 1000
    end = carried_out(chip, M1486_DRIVER.move(WantedMoves({1: 50.0}, True, 500)), 2)
    assert end.position == 100.0
    assert chip.settings.velocity == wire.chip.drive.velocity == 500
    assert wire.true() == 100 * 64


def test_a_stop_of_a_move_spoils_the_position() -> None:
    assert M1486_DRIVER.move(WantedMoves({1: 50.0}, False, None)).stop_note == LOST
    assert "home the axis" in LOST


@pytest.mark.parametrize(("text", "line", "direction"), [("1=-B8", 8, -1), ("M1 = +b8", 8, 1), ("m1=-b9", 9, -1)])
def test_a_seek_and_homing(text: str, line: int, direction: int) -> None:
    for motion, what in ((M1486_DRIVER.seek, "seek"), (M1486_DRIVER.home, "home")):
        wire = ChipWire(addresses=(7,))
        chip = ready(wire)
        wire.chip.set_pin(f"B{line}", 1, wire.now)
        wanted = motion([text])
        begun: set[int] = set()
        wanted.begin(chip, begun, lambda: None)
        assert begun == {1}
        wire.at(0.5, lambda wire=wire: wire.chip.set_pin(f"B{line}", 0, wire.now))  # type: ignore[misc]
        (end,) = M1486_DRIVER.wait(chip, wanted.axes, None)
        assert end.ok
        assert wire.true() * direction > 0
        ended = wanted.end(chip, end)
        assert (ended.position, chip.position()) == ((0.0, 0.0) if what == "home" else (end.position, end.position))
        assert end.position != 0.0
        assert bool(wanted.must_wait) == (what == "home")


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["2=-B8"], "'2=-B8': an M1486 has one axis: expected 1=-B8"),
        (["1=B8"], r"'1=B8': expected the direction and the line of an M1486, such as 1=-B8 or 1=\+B8"),
        (["1=-B8", "1=+B9"], "expected the direction and the line"),
        (["1=-5"], "expected the direction and the line"),
    ],
)
def test_what_is_no_seek(texts: list[str], message: str) -> None:
    for motion in (M1486_DRIVER.seek, M1486_DRIVER.home):
        with pytest.raises(Misuse, match=message):
            motion(texts)


def test_a_dead_man_jog() -> None:
    wire = ChipWire(addresses=(7,))
    chip = ready(wire)
    jog = M1486_DRIVER.jog(chip, 1, 400.0, 0.3)
    assert (jog.unit, jog.ahead_s) == ("step", 2.0 * LINK_S)
    with jog:
        assert jog.hold()
        assert wire.moving()
    end = jog.ended()
    assert (end.ok, end.reason, end.name) == (True, "released", "chip 7")
    assert not wire.moving()
    assert end.position == wire.true() / 64 > 0.0
    assert chip.settings.velocity == wire.chip.drive.velocity == 1000


def test_a_jog_that_others_end_is_not_ok() -> None:
    wire = ChipWire(addresses=(7,))
    chip = ready(wire)
    jog = M1486_DRIVER.jog(chip, 1, 400.0, 0.3)
    with jog:
        assert jog.hold()
        chip.stop()
        while jog.hold():
            pass
    end = jog.ended()
    assert not end.ok
    assert end.reason != "released"


def test_a_jog_that_limit_holds_is_not_ok_and_no_error() -> None:
    """Function 51 OFF: the chip does not answer as long as LIMIT is low. V is not known, so it is not put back."""
    wire = ChipWire(addresses=(7,))
    chip = chip_driver(wire, 7)
    chip.command("c51")
    jog = M1486_DRIVER.jog(chip, 1, 400.0, 0.3)
    with jog:
        assert jog.hold()
        wire.chip.set_pin("LIMIT", 0, wire.now)
    end = jog.ended()
    assert (end.ok, end.is_overdue) == (False, True)


def test_an_end_that_does_not_come_in_time_is_overdue() -> None:
    wire = ChipWire(addresses=(7,))
    chip = ready(wire)
    M1486_DRIVER.move(WantedMoves({1: 5000.0}, False, None)).begin(chip, set(), lambda: None)
    (end,) = M1486_DRIVER.wait(chip, (1,), 0.5)
    assert (end.ok, end.is_overdue) == (False, True)
    M1486_DRIVER.halt(chip, (1,))
    wire.sleep(2.0)
    assert not wire.moving()


@pytest.mark.parametrize("program", [False, True])
def test_a_stop_sends_k_without_any_question(monkeypatch: pytest.MonkeyPatch, *, program: bool) -> None:
    wire = ChipWire(addresses=(7,))
    chip = ready(wire)
    chip.move_by(5000.0)
    wire.sleep(0.5)
    at_every_address(monkeypatch, wire)
    del wire.sent[:]
    log: list[str] = []
    assert M1486_DRIVER.stop(ADDRESS, log.append, (), program) == (None if program else GOES_ON)
    wire.sleep(2.0)
    assert not wire.moving()
    assert "u" not in typed(wire).partition("k")[0]
    assert log


def test_an_open_driver_leaves_the_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = ChipWire(addresses=(7,))
    ready(wire)
    at_every_address(monkeypatch, wire)
    with M1486_DRIVER.opened(ADDRESS, False, None) as chip:
        assert (chip.address, chip.variant.name) == (7, "B")
    assert wire.chip.drive.velocity == 1000


def test_chips_on_a_line_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = ChipWire("C", addresses=(2, 10))
    at_every_address(monkeypatch, wire)
    search = M1486_DRIVER.search
    assert search is not None
    asked: list[int] = []
    found = search.find("memory", 4800, range(16), 0.1, asked.append)
    assert found == [FoundDevice(2, "C", "M1486C"), FoundDevice(10, "C", "M1486C")]
    assert len(asked) == 16
    assert (search.numbers, search.disturbs, search.form) == (16, False, "X")


def test_after_a_search_all_chips_listen_again(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = ChipWire(addresses=(2, 10))
    chip_driver(wire, 2)
    assert [chip.receiver.is_listening for chip in wire.chips.values()] == [True, False]
    at_every_address(monkeypatch, wire)
    assert M1486_DRIVER.search is not None
    M1486_DRIVER.search.leave("memory", 4800)
    wire.sleep(1.0)
    assert [chip.receiver.is_listening for chip in wire.chips.values()] == [True, True]


def test_bytes_of_other_protocols_are_ended_by_a_line_end(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = ChipWire(addresses=(7,))
    wire.send(b"v3")
    wire.sleep(1.0)
    at_every_address(monkeypatch, wire)
    del wire.sent[:]
    M1486_DRIVER.clear("tcp://memory:1", 38400)
    once = typed(wire)
    assert once.endswith(" ")
    del wire.sent[:]
    M1486_DRIVER.clear("memory", 38400)  # at the rate of the chips, too
    assert typed(wire) == 2 * once


def test_a_chip_as_a_subject(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the studio connects; a twin beside a chip is impossible, for its position is unknown while it moves."""
    wire = ChipWire("C", addresses=(7,))
    at_every_address(monkeypatch, wire)
    connect, part_of = M1486_DRIVER.line, M1486_DRIVER.part

    async def main() -> tuple[int | None, str, str]:
        line = connect("memory", 4800)
        await line.open()
        try:
            with pytest.raises(WrongType, match="reports that it is an M1486C, not M1486B"):
                await part_of(replace(ADDRESS, variant="B"), line)
            part = await part_of(replace(ADDRESS, variant=None), line)
            with pytest.raises(Refusal) as refused:
                await part.twin("beside")
            return part.address, part.unit_of("position"), str(refused.value)
        finally:
            await line.close()

    address, unit, refused = run_virtual(wire, main())
    assert (address, unit) == (7, "min. microsteps")
    assert refused == "no twin beside an M1486, whose position is unknown while it moves (M-28)"


def test_a_server_of_modbus_tcp_has_no_chips(monkeypatch: pytest.MonkeyPatch) -> None:
    """It closes the connection when it receives characters; a serial port that is lost is a failure."""

    waited = []

    def lost(*arguments: object, timeout_ns: Nanos, **options: object) -> NoReturn:
        waited.append(timeout_ns)
        raise LineLost("closed by the other end")

    at_every_address(monkeypatch, ChipWire(addresses=(7,)))
    monkeypatch.setattr(kind, "scan_chips", lost)
    search = M1486_DRIVER.search
    assert search is not None
    assert search.find("tcp://memory:1", 4800, range(16), 0.1, lambda number: None) == []
    with pytest.raises(LineLost):
        search.find("memory", 4800, range(16), 0.25, lambda number: None)
    assert waited == [100_000_000, 250_000_000]


@pytest.mark.parametrize(("variant", "told"), [(None, "@80  out of range"), ("B", "@80  Address 80")])
def test_traffic_is_decoded_for_a_type(variant: str | None, told: str) -> None:
    """An A has 15 labels, and is what the manual speaks of."""
    frames: list[FrameLine] = []
    assert M1486_DRIVER.decoding is not None
    assert M1486_DRIVER.decoding.protocol == "m1486"
    M1486_DRIVER.decoding.make(frames.append, variant, False).feed(b"@80\r", 5, FrameDirection.IN)
    assert frames == [FrameLine(5, "", FrameDirection.IN, b"@80\r", told)]


def test_what_it_takes() -> None:
    selection = M1486_DRIVER.selection
    assert [selection.read(text) for text in ("0", "F", "a")] == [0, 15, 10]
    assert (selection.show(15), selection.show(3), selection.usual) == ("F", "3", None)
    assert selection.may_be_open
    assert not selection.has_config
    assert selection.options == {"chip", "variant"}
    assert M1486_DRIVER.check_axis(1) == 1
    for axis in (0, 2):
        with pytest.raises(Misuse, match=rf"axis {axis} is not one of an M1486: permitted are 1$"):
            M1486_DRIVER.check_axis(axis)
    assert list(M1486_DRIVER.programs) == [".m1486"]
    assert not M1486_DRIVER.offers(DriverKind.enable)
