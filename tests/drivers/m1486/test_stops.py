"""After a stop of a chip nothing begins that was asked for before it: types, motions, moments and ways, in one table.

In virtual time; `tests/soak/test_stops.py` has drawn moments.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest
from chip_rig import KNOWN, ChipWire, chip_driver, chip_line, chip_task_line
from chip_stops import ASKED, BEGINS, FAMILIES, OPERATIONS, WAYS, trial
from line_rig import run_virtual

from steptwin.controller import SECOND
from steptwin.drivers import Unconfirmed
from steptwin.drivers.m1486 import M1486, AsyncM1486, Busy, FileGivenUp, PositionUnknown
from steptwin.drivers.m1486.driver import download_to
from steptwin.errors import Refusal

MOMENTS_S = {"A": (0.0, 0.001, 0.3), "B": (0.0, 0.001, 0.3), "C": (0.0, 0.002, 0.3), "E1": (0.0, 0.3, 1.2), "E2": (0.0, 0.8, 1.6)}
"""At once, in the time that commands take until they move something, and after it."""


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("asked", ASKED)
@pytest.mark.parametrize("family", FAMILIES)
def test_nothing_begins_after_a_stop_that_was_asked_for_before_it(family: str, asked: str, way: str) -> None:
    wrong = [fault for delay_s in MOMENTS_S[family] if (fault := trial(family, asked, way, delay_s)) is not None]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("delay_s", [0.0, 0.3, 0.7])
def test_wrong_data_that_end_nothing_are_followed_by_a_second_kill(delay_s: float) -> None:
    """With function 44 ON a motion in the EEPROM is ended when it has begun, and only that confirms the stop."""
    wire = ChipWire("E1", (7,))
    chip = chip_driver(wire, 7)
    chip.set_function(44, True)
    wire.sleep(1.0)
    chip.run(1)
    wire.sleep(delay_s)
    assert chip.stop() is (delay_s == 0.7)  # then all is known: a motion that has begun, and no program
    confirmed = wire.now
    wire.sleep(5.0)
    assert not [event for _, event in wire.happened if event.code == "moves" and event.time > confirmed]
    assert not wire.moving(7)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_stop_of_a_chip_of_which_nothing_is_known_is_confirmed_by_its_second_kill(family: str) -> None:
    """Another process has asked for the motion; the one that stops has opened the line only."""
    wire = ChipWire(family, (7,))
    chip_driver(wire, 7).run(1)
    wire.sleep(0.2)
    wire.sent.clear()
    stopping = M1486(chip_line(wire), 7)
    stopping.open_line()
    assert stopping.stop() is False
    confirmed = wire.now
    assert b"".join(data for _, data in wire.sent).count(b"k\r") == 3  # twice at once, to a chip that may not echo
    wire.sleep(5.0)
    assert not [event for _, event in wire.happened if event.code == "moves" and event.time > confirmed]
    assert not wire.moving(7)


@pytest.mark.parametrize("family", FAMILIES)
def test_of_a_chip_that_has_never_echoed_nothing_is_claimed(family: str) -> None:
    """Another program has asked for the motion without echoes (function 41 OFF), and switched function 44 ON. An E type cannot be
    had to echo in time, and that is said."""
    wire = ChipWire(family, (7,))
    wire.send(b"x7\rt44\r")
    wire.sleep(1.0)
    wire.send(b"g+\rr\r")
    wire.sleep(0.2)
    stopping = M1486(chip_line(wire), 7)
    stopping.open_line()
    if wire.chip.variant.write_ns:
        with pytest.raises(Unconfirmed):
            stopping.stop()
        return
    assert stopping.stop() is False
    confirmed = wire.now
    wire.sleep(5.0)
    assert not [event for _, event in wire.happened if event.code == "moves" and event.time > confirmed]
    assert not wire.moving(7)


def test_a_stop_that_does_not_get_through_is_not_confirmed() -> None:
    wire = ChipWire("E1", (7,))
    chip = chip_driver(wire, 7)
    chip.run(1)
    wire.severed = True
    with pytest.raises(Unconfirmed):
        chip.stop()


def test_a_program_that_stops_is_told() -> None:
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    chip.download("[\n@5\nF6400\nR\nW100\nJ5\n]")
    wire.sleep(0.5)
    assert chip.stop() is True
    stood = wire.now + SECOND
    wire.sleep(5.0)
    assert not [event for _, event in wire.happened if event.code == "moves" and event.time > stood - SECOND]
    # With function 44 ON it goes on, and that is told.
    chip.download("[\nT44\n@5\nF6400\nR\nW100\nJ5\n]")
    wire.sleep(0.5)
    assert chip.stop() is False
    assert _begun(wire, 2.0), "it goes on"


def _begun(wire: ChipWire, seconds: float) -> list[float]:
    """When motions begin from now on, s."""
    now = wire.now
    wire.sleep(seconds)
    return [(event.time - now) / SECOND for _, event in wire.happened if event.code in BEGINS and event.time > now]


LOOP = "F6400\nR\nW50\nB6400\nR\nJ5\n"
CONTINUES = f"[\nT44\n@5\n{LOOP}]"


def _downloads(wire: ChipWire, text: str) -> M1486:
    chip = chip_driver(wire, 7)
    chip.download(text)
    return chip


def _starts_that_of_another(wire: ChipWire, *, is_read_before: bool) -> M1486:
    """Another process has downloaded it."""
    _downloads(wire, f"[\nJ9\n@5\nT44\n{LOOP}@9\n]").wait()
    chip = chip_driver(wire, 7)
    if is_read_before:
        assert not chip.functions()[44]
    chip.start_program(5)
    return chip


def _starts_its_own_again(wire: ChipWire) -> M1486:
    chip = _downloads(wire, f"[\nJ9\n@5\nT44\n{LOOP}@9\n]")
    chip.wait()
    assert not chip.functions()[44]
    chip.start_program(5)
    return chip


def _turns_on_what_the_variable_names(wire: ChipWire) -> M1486:
    return _downloads(wire, f"[\n:44\nT\n@5\n{LOOP}]")


def _types_the_number_before(wire: ChipWire) -> M1486:
    chip = chip_driver(wire, 7)
    chip.set_variable(44)
    chip.command("t")
    chip.download(f"[\n@5\n{LOOP}]")
    return chip


@pytest.mark.parametrize(
    ("family", "started"),
    [
        ("B", lambda wire: _downloads(wire, CONTINUES)),
        ("E1", lambda wire: _downloads(wire, CONTINUES)),
        ("B", lambda wire: _downloads(wire, f"\\\n{CONTINUES}")),
        ("B", lambda wire: _starts_that_of_another(wire, is_read_before=False)),
        ("B", lambda wire: _starts_that_of_another(wire, is_read_before=True)),
        ("B", _starts_its_own_again),
        ("B", _turns_on_what_the_variable_names),
        ("B", _types_the_number_before),
    ],
    ids=["file", "file into EEPROM", "text with reset", "of another", "of another, read", "again", "variable", "typed"],
)
def test_a_program_that_wrong_data_do_not_end_is_never_called_ended(family: str, started: Callable[[ChipWire], M1486]) -> None:
    """Function 44 ON, wherever it was switched."""
    wire = ChipWire(family, (7,))
    chip = started(wire)
    wire.sleep(3.0)
    assert chip.stop() is False
    assert _begun(wire, 3.0)


@pytest.mark.parametrize("settings", [KNOWN, {}], ids=["known", "unknown"])
def test_a_move_that_is_long_over_does_not_hide_a_program(settings: dict[str, int]) -> None:
    """Nobody has waited for the move, and another process has started a program since."""
    wire = ChipWire("B", (7,))
    other = _downloads(wire, f"[\nJ9\n@5\n{LOOP}@9\n]")
    other.wait()
    chip = chip_driver(wire, 7)
    chip.configure(**settings)  # type: ignore[arg-type]
    chip.move_by(10.0)
    wire.sleep(3.0)
    other.start_program(5)
    wire.sleep(0.7)
    assert chip.stop() is True
    assert not _begun(wire, 3.0)


@pytest.mark.parametrize("is_known", [True, False])
def test_a_program_that_kill_holds_is_not_released_by_a_stop(is_known: bool) -> None:
    """Function 51 OFF, and 44 ON or not known: behind C75 the motor would move."""
    wire = ChipWire("B", (7,))
    owner = chip = _downloads(wire, f"[\nT44\nC51\n@5\n{LOOP}]")
    wire.sleep(1.0)
    if not is_known:
        chip = M1486(chip_line(wire), 7)
        chip.open_line()
    with pytest.raises(Busy, match="C75 was not sent, because function 44 may be ON"):
        chip.stop_program(timeout_s=1.0)
    assert not _begun(wire, 3.0)
    chip.recover()
    assert _begun(wire, 3.0), "as recover says"
    owner.reset(force=True)
    assert not _begun(wire, 3.0)


def test_a_stop_of_a_program_at_rest_leaves_the_position_known() -> None:
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    chip.move_by(10.0)
    chip.wait()
    chip.stop_program()
    assert chip.position() == 10.0
    chip.move_by(1000.0)
    wire.sleep(0.3)
    chip.stop_program()
    with pytest.raises(PositionUnknown):
        chip.position()


@pytest.mark.parametrize("delay_s", [0.0, 0.001, 0.004])
@pytest.mark.parametrize("asked", ASKED)
def test_what_is_asked_for_while_a_stop_is_unanswered_is_refused(asked: str, delay_s: float) -> None:
    wire = ChipWire("B", (7,))
    line = chip_task_line(wire)
    chip = AsyncM1486(line, 7)

    async def work() -> None:
        await chip.open()
        await chip.run(1)
        await line.sleep(1.0)
        stop = asyncio.ensure_future(chip.stop())
        await line.sleep(delay_s)
        assert not stop.done()
        motion = asyncio.ensure_future(OPERATIONS[asked](chip))
        await stop
        stopped_at = wire.now
        with pytest.raises((Refusal, FileGivenUp), match="a stop was requested meanwhile"):
            await motion
        await line.sleep(3.0)
        assert not [event for _, event in wire.happened if event.code in BEGINS and event.time > stopped_at]

    run_virtual(wire, work())


def test_the_rest_of_a_text_is_not_sent_behind_a_stop() -> None:
    """The second chip of a text is stopped while the first gets its part, whose own K ends nothing of the text."""
    wire = ChipWire("B", (1, 2))
    line = chip_task_line(wire)
    first, second = AsyncM1486(line, 1), AsyncM1486(line, 2)

    async def work() -> None:
        await first.open()
        await second.open()
        text = "X1\nF640\nR\nK\nW300\nF640\nR\nX2\nS300\nF640\nR\n"
        await download_to([first, second], text)
        await line.sleep(3.0)
        assert sorted(address for address, event in wire.happened if event.code == "moves") == [1, 1, 2]
        sending = asyncio.ensure_future(download_to([first, second], text))
        await line.sleep(0.1)
        await second.stop()
        with pytest.raises(Refusal, match="'chip 2: s300' was not sent: a stop was requested meanwhile"):
            await sending
        await line.sleep(3.0)
        assert sorted(address for address, event in wire.happened if event.code == "moves") == [1, 1, 1, 1, 2]

    run_virtual(wire, work())


def test_two_that_drop_the_same_unfinished_line_are_both_done() -> None:
    """Two commands that a stop has overtaken: the second finds nothing more to drop."""
    wire = ChipWire("B", (7,))
    chip = AsyncM1486(chip_task_line(wire), 7)

    async def work() -> bool:
        await chip.open()
        chip._unit.talk.dirty = True
        async with asyncio.timeout(5.0):
            await asyncio.gather(chip._unit.drop_line(), chip._unit.drop_line())
            return await chip.is_busy()

    assert run_virtual(wire, work()) is False
