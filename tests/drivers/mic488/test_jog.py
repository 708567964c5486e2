"""The dead-man's switch: held, it runs evenly; whatever else happens, the axis comes to rest within its reach."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest
from host_rig import Fault, Wire, async_driver, driver, run_virtual, task_line

from steptwin.controller import MILLISECOND, SECOND
from steptwin.drivers import Mic488, NotReady, Reason, TooLate, Unconfirmed
from steptwin.errors import Misuse
from steptwin.mic488.registers import register_map
from steptwin.wire import pdu

REACH = 5.0 * 0.4 + 5.0**2 / (2 * 50.0)
"""mm that 5 mm/s go in 0.4 s and then braking with 50 mm/s²."""


def ready() -> tuple[Wire, Mic488]:
    wire = Wire()
    mic = driver(wire)
    mic.enable()
    return wire, mic


def speed(wire: Wire) -> float:
    return wire.twin.axes[0].profile.velocity(wire.now) / 100


@pytest.mark.parametrize("velocity", [5.0, -0.4])
def test_held_it_runs_evenly_and_released_it_ramps_down(velocity: float) -> None:
    wire, mic = ready()
    with mic.axis(1).jog(velocity) as jog:
        assert jog.hold()
        for _ in range(20):
            assert jog.hold()
            assert speed(wire) == pytest.approx(velocity)
    assert jog.end is not None
    assert (jog.end.ok, str(jog.end)) == (True, "M1: released")
    assert mic.axis(1).wait().ok
    assert not wire.moving()
    assert mic.get("M1_VMAX") == {"M1_VMAX": 25.0}


def test_not_held_any_more_it_stops_by_itself_within_its_reach() -> None:
    """The process was killed: nothing is sent after some moment, whatever moment that is."""
    for holds in range(4):
        wire, mic = ready()
        jog = mic.axis(1).jog(5.0)
        jog.__enter__()
        for _ in range(holds):
            assert jog.hold()
        held = wire.position()
        assert jog.reach_u == pytest.approx(REACH)
        wire.rest()
        assert not wire.moving()
        assert 0 < wire.position() - held <= REACH * 100 + 1


def test_a_killed_jog_leaves_an_axis_slower_and_the_next_one_tells() -> None:
    wire, mic = ready()
    mic.axis(1).jog(5.0).__enter__()
    wire.rest()
    assert mic.get("M1_VMAX") == {"M1_VMAX": 5.0}
    with pytest.raises(
        NotReady, match=r"a jog of M1 at 10 mm/s is faster than its VMAX, 5 mm/s \(which a program that was killed"
    ):
        mic.axis(1).jog(10.0).__enter__()
    assert mic.get("M1_VMAX") == {"M1_VMAX": 5.0}
    assert not wire.moving()
    # VMAX is a REAL: one step of its last place above it is rounding.
    mic.axis(1).set_ramp(velocity=8)
    with pytest.raises(NotReady, match="a jog of M1 at 8 mm/s is faster than its VMAX, 8 mm/s"):
        mic.axis(1).jog(8 + 2.0**-19).__enter__()
    with mic.axis(1).jog(8 + 2.0**-20) as jog:
        assert jog.hold()
    mic.axis(1).set_ramp(velocity=10.1)
    with mic.axis(1).jog(-10.1) as jog:
        assert jog.hold()


def test_a_program_that_was_away_does_not_find_it_running_on() -> None:
    wire, mic = ready()
    with mic.axis(1).jog(5.0) as jog:
        assert jog.hold()
        wire.sleep(5.0)
        stood = wire.position()
        assert not jog.hold()
        assert jog.end is not None
        assert jog.end.reason is Reason.NOT_HELD
        assert not jog.hold()
        wire.rest()
    assert wire.position() == stood


def test_a_cut_line_is_told_as_what_it_is() -> None:
    """The controller cannot be told; the driver says so, and how far the axis goes at most."""
    wire, mic = ready()
    jog = mic.axis(1).jog(5.0)
    jog.__enter__()
    assert jog.hold()
    held = wire.position()
    wire.severed = True
    with pytest.raises(Unconfirmed) as caught:  # noqa: PT012
        while jog.hold():
            pass
    text = str(caught.value)
    assert text.startswith("M1 cannot be held any more: the controller cannot be reached (memory: no answer to")
    assert f"It stops by itself, at most {REACH:g} mm after it was held last, 0." in text
    assert jog.end is not None
    assert jog.end.reason is Reason.COMMUNICATION
    wire.rest()
    assert not wire.moving()
    assert wire.position() - held <= REACH * 100 + 1


def test_a_line_cut_before_the_release_is_told_too() -> None:
    wire, mic = ready()

    def cut() -> None:
        with mic.axis(1).jog(5.0) as jog:
            jog.hold()
            wire.severed = True

    with pytest.raises(Unconfirmed, match=r"M1 cannot be stopped: the controller cannot be reached .* It stops by itself"):
        cut()
    wire.rest()
    assert not wire.moving()


def test_one_lost_frame_is_not_felt() -> None:
    wire, mic = ready()
    with mic.axis(1).jog(5.0) as jog:
        for number in range(30):
            wire.put(Fault("to master" if number % 2 else "to twin", number, "drop"))
            assert jog.hold()
            if number:
                assert speed(wire) == pytest.approx(5.0)


def test_a_line_cut_when_it_is_to_begin_leaves_it_in_doubt() -> None:
    wire, mic = ready()

    def cut(frame: bytes) -> None:
        wire.severed = wire.severed or (frame[1] == 16 and "VMAX" not in mic._driver._unit.wording.request(frame[1:-2]))

    wire.before_each = cut
    jog = mic.axis(1).jog(5.0)
    with pytest.raises(Unconfirmed, match=rf"^M1 may have begun to jog: .*most {REACH:g} mm after it was held last, 0.00 s ago"):
        jog.__enter__()
    wire.before_each, wire.severed = None, False
    wire.rest()
    assert not wire.moving()


def test_one_that_was_not_released_in_time_is_not_stopped_afterwards() -> None:
    """It is at rest by then, and may be moved by another program."""
    wire, mic = ready()
    with mic.axis(1).jog(5.0) as jog:
        assert jog.hold()
        wire.sleep(5.0)
        wire.sent.clear()
    assert jog.end is not None
    assert (jog.end.reason, jog.end.axis, jog.end.unit) == (Reason.NOT_HELD, 1, "mm")
    assert jog.end.after_s == pytest.approx(5.0, abs=0.2)
    assert str(jog.end) == f"M1: not held ({jog.end.after_s:.2f} s since it was held)"
    assert all("VEL_ABS" not in mic._driver._unit.wording.request(frame[1:-2]) for _, frame in wire.sent)


def test_one_that_another_program_has_moved_on_is_not_held_any_more() -> None:
    _, mic = ready()
    with mic.axis(1).jog(5.0) as jog:
        assert jog.hold()
        mic.set("M1_POS_REL", 0.0)
        assert mic.axis(1).wait().ok
        assert not jog.hold()
    assert jog.end is not None
    assert jog.end.reason is Reason.NOT_HELD


def test_what_goes_wrong_in_the_block_does_not_hide_that_it_cannot_be_stopped() -> None:
    wire, mic = ready()

    def cut() -> None:
        with mic.axis(1).jog(5.0):
            wire.severed = True
            raise ValueError("in the block")

    with pytest.raises(Unconfirmed, match="M1 cannot be stopped") as caught:
        cut()
    context = caught.value.__context__
    while context is not None and not isinstance(context, ValueError):
        context = context.__context__
    assert str(context) == "in the block"


def test_after_a_jog_that_was_left_alone_its_end_can_be_waited_for() -> None:
    wire, mic = ready()
    jog = mic.axis(1).jog(5.0)
    jog.__enter__()
    end = mic.axis(1).wait()
    assert end.reason is Reason.TARGET
    assert end.position_u == pytest.approx(REACH)
    assert not wire.moving()


@pytest.mark.parametrize("hold_s", [0.2, 2.0])
def test_hold_times(hold_s: float) -> None:
    wire, mic = ready()
    jog = mic.axis(1).jog(5.0, hold_s=hold_s)
    jog.__enter__()
    wire.rest()
    assert wire.position() == pytest.approx((5.0 * hold_s + 5.0**2 / (2 * 50.0)) * 100, abs=1)


@pytest.mark.parametrize("hold_s", [0.19, 2.01, float("nan")])
def test_hold_times_that_are_none(hold_s: float) -> None:
    _, mic = ready()
    with pytest.raises(Misuse, match=r"a hold time of .* s is outside 0.2 to 2 s"):
        mic.axis(1).jog(5.0, hold_s=hold_s)


def test_a_limit_ends_it() -> None:
    wire, mic = ready()
    with mic.axis(1).jog(-20.0) as jog:
        while jog.hold():
            pass
    assert jog.end is not None
    assert jog.end.reason is Reason.LIMIT_L
    assert str(jog.end) == "M1: stopped at limit L"
    assert wire.position() == -1000


@pytest.mark.parametrize(
    ("stop", "reason"), [(lambda m: m.axis(1).stop(), Reason.STOPPED), (lambda m: m.disable(1), Reason.STOPPED)]
)
def test_a_stop_ends_it_for_good(stop: Callable[[Mic488], None], reason: Reason) -> None:
    wire, mic = ready()
    with mic.axis(1).jog(5.0) as jog:
        jog.hold()
        stop(mic)
        stood = wire.position()
        assert not jog.hold()
    assert jog.end is not None
    assert jog.end.reason in (reason, Reason.DISABLED)
    wire.rest()
    assert wire.position() == stood


def test_a_stop_between_two_tasks() -> None:
    """One task holds, another stops: after the stop nothing is renewed. It comes at any moment of a request of the hold."""
    wire = Wire()
    details = set()

    async def main() -> None:
        async with async_driver(task_line(wire), wire) as mic:
            await mic.enable(1)

            async def hold() -> None:
                async with mic.axis(1).jog(5.0) as jog:
                    while await jog.hold():
                        pass
                assert jog.end is not None
                assert jog.end.reason is Reason.STOPPED
                details.add(jog.end.detail)

            for delay in range(0, 400, 7):
                task = asyncio.create_task(hold())
                await asyncio.sleep(0.2 + delay / 1000)
                await mic.axis(1).stop()
                assert not wire.moving()
                await task
                assert not wire.moving()

    run_virtual(wire, main())
    assert details == {"by this program", "on at rest"}


def test_somebody_else_is_noticed() -> None:
    wire, mic = ready()
    with pytest.raises(NotReady, match="M1 is no longer jogged"), mic.axis(1).jog(5.0) as jog:  # noqa: PT012
        jog.hold()
        mic.set("AXIS_CTR_MODE", 1)
        jog.hold()
    mic.set("AXIS_CTR_MODE", 0)
    wire.rest()
    assert not wire.moving()


def test_what_is_no_jog() -> None:
    _, mic = ready()
    with pytest.raises(Misuse, match="a jog of M1 at 0 mm/s does not move"):
        mic.axis(1).jog(0.0)
    with pytest.raises(Misuse, match=r"a hold time of 3 s is outside 0.2 to 2 s"):
        mic.axis(1).jog(1.0, hold_s=3.0)
    with pytest.raises(Misuse, match="a jog is held inside its with block"):
        mic.axis(1).jog(1.0).hold()
    mic.axis(1).disable()
    with pytest.raises(NotReady, match="M1 of unit 1 is switched off"), mic.axis(1).jog(1.0):
        pass


def test_the_hold_time_is_a_choice() -> None:
    wire, mic = ready()
    with mic.axis(1).jog(5.0, hold_s=1.0) as jog:
        assert jog.reach_u == pytest.approx(5.25)
        before = wire.now
        jog.hold()
        assert wire.now - before == pytest.approx(SECOND // 4, abs=50 * MILLISECOND)


MAP = register_map("1.70")


def by_another_master(wire: Wire, request: pdu.ModbusRequest) -> None:
    wire.twin.execute(pdu.encode_request(request), wire.now)


def jog_moves(wire: Wire) -> int:
    """How many times a jog told the axis to move on."""
    head = pdu.encode_request(pdu.WriteRegistersRequest(MAP.of("POS_REL", 1).address, (0, 0)))[:3]
    return sum(frame[1:].startswith(head) for _, frame in wire.sent)


STOPS: dict[str, tuple[pdu.ModbusRequest, Reason]] = {
    "M1_STOP": (pdu.WriteCoilRequest(MAP.of("STOP", 1).address, True), Reason.STOPPED),
    "M_STOP": (pdu.WriteRegisterRequest(MAP.of("M_STOP").address, 1), Reason.STOPPED),
    "M1_EN": (pdu.WriteCoilRequest(MAP.of("EN", 1).address, False), Reason.DISABLED),
    "M1_VEL_ABS, still braking": (pdu.WriteRegistersRequest(MAP.of("VEL_ABS", 1).address, (0, 0)), Reason.DIVERTED),
    "M1_HOME": (pdu.WriteRegistersRequest(MAP.of("HOME", 1).address, (0, 0x40A0)), Reason.DIVERTED),
}


@pytest.mark.parametrize("stop", STOPS)
def test_what_another_master_tells_the_axis_ends_the_jog_and_nothing_more_is_sent(stop: str) -> None:
    request, reason = STOPS[stop]
    wire, mic = ready()
    mic.axis(1).set_ramp(dec=10.0)  # braking takes half a second
    with mic.axis(1).jog(5.0) as jog:
        assert jog.hold()
        assert jog_moves(wire) == 2
        wire.sleep(0.09)
        by_another_master(wire, request)
        assert not jog.hold()
        assert not jog.hold()
        assert jog.end is not None
        assert jog.end.reason is reason
    assert jog_moves(wire) == 2
    if reason is not Reason.DIVERTED:
        stood = wire.position()
        wire.rest(10.0)
        assert wire.position() == stood


def test_a_program_that_is_suspended_while_it_reads_the_status_does_not_move_the_axis_again() -> None:
    """The answer says that the axis moves; it is seconds old when the program goes on."""
    wire, mic = ready()
    with mic.axis(1).jog(5.0) as jog:
        assert jog.hold()
        wire.before_read = lambda: wire.sleep(5.0)
        assert not jog.hold()
        wire.before_read = None
        stood = wire.position()
        assert str(jog.end).startswith("M1: not held (5.")
        assert not jog.hold()
    assert jog_moves(wire) == 2
    wire.rest(10.0)
    assert (wire.moving(), wire.position()) == (False, stood)
    assert mic.get("M1_VMAX") == {"M1_VMAX": 25.0}


@pytest.mark.parametrize("holds", [0, 1])
@pytest.mark.parametrize(("before_ms", "runs_on"), [(15, True), (5, False)])
def test_the_hold_time_counts_from_the_answer(holds: int, before_ms: int, *, runs_on: bool) -> None:
    """It comes some milliseconds after the request; the next one is the second of two (100 frames a second)."""
    wire, mic = ready()
    with mic.axis(1).jog(5.0, hold_s=0.4) as jog:
        for _ in range(holds):
            assert jog.hold()
        moved = wire.sent[-1][0]
        wire.sleep((moved + (400 - before_ms) * MILLISECOND - wire.now) / SECOND)
        assert jog.hold() is runs_on
    assert jog_moves(wire) == 1 + holds + runs_on


@pytest.mark.parametrize(
    ("hold_s", "away_s", "begins"), [(0.4, 0.9, True), (0.4, 1.1, False), (1.0, 1.5, True), (1.0, 1.7, False)]
)
def test_a_jog_begins_within_its_hold_time_and_two_time_outs_or_not_at_all(hold_s: float, away_s: float, begins: bool) -> None:
    """Whoever is suspended while it is prepared does not find the axis moving afterwards."""
    wire, mic = ready()

    def away(_: bytes) -> None:
        wire.before_each = None
        wire.sleep(away_s)

    wire.before_each = away
    jog = mic.axis(1).jog(5.0, hold_s=hold_s)
    if begins:
        jog.__enter__()
        assert wire.moving()
    else:
        with pytest.raises(TooLate):
            jog.__enter__()
        wire.rest()
        assert wire.position() == 0


def stopping_at(wire: Wire, mic: Mic488, what: str) -> None:
    """Another thread requests a stop while something is sent for the first time from now on."""
    address = register_map().of(what, 1).address.to_bytes(2, "big")

    def stop(frame: bytes) -> None:
        if frame[2:4] == address:
            mic._driver._unit.shared.stops[1] += 1

    wire.before_each = stop


def test_a_stop_before_a_jog_has_begun() -> None:
    wire, mic = ready()
    stopping_at(wire, mic, "VMAX")
    with mic.axis(1).jog(5.0) as jog:
        assert jog.end is not None
        assert (jog.end.reason, jog.end.detail) == (Reason.STOPPED, "by this program")
        assert not jog.hold()
    wire.rest()
    assert wire.position() == 0
    assert mic.get("M1_VMAX") == {"M1_VMAX": 25.0}


def test_a_pause_of_the_program_does_not_end_a_jog_that_has_begun() -> None:
    """What a pause holds up is the program; before the first move it may be the program that is meant."""
    wire, mic = ready()
    with mic.axis(1).jog(5.0) as jog:
        mic.program.pause()
        wire.sleep(0.1)
        assert jog.hold()
    assert jog.end is not None
    assert jog.end.reason is Reason.RELEASED


def test_a_stop_while_a_jog_is_released() -> None:
    _, mic = ready()
    jog = mic.axis(1).jog(5.0)
    jog.__enter__()
    assert jog.hold()
    mic._driver._unit.shared.stops[1] += 1
    jog.release()
    assert jog.end is not None
    assert (jog.end.reason, jog.end.detail) == (Reason.STOPPED, "by this program")


def test_with_dint_a_jog_moves_and_ends_in_pulses() -> None:
    wire = Wire()
    mic = driver(wire, observe=True)
    mic.enable(1)
    mic.set("DATA_TYPE", 1)
    with mic.axis(1).jog(5.0) as jog:
        assert jog.hold()
        assert speed(wire) == pytest.approx(5.0)
    assert mic.axis(1).wait().ok
    wire.rest()
    assert 0 < wire.position() <= (REACH + 0.5) * 100
    assert mic.get("M1_VMAX") == {"M1_VMAX": 25.0}
