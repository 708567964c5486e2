"""The monitor's values: those of a twin that is followed are those that polling its line gives, and cost no frame."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Generator, Mapping
from typing import Any

import pytest

from steptwin.errors import LineFailure, Misuse
from steptwin.live.remote import RemoteSubject
from steptwin.live.twins import controller_of
from steptwin.machine import MILLISECOND, SECOND
from steptwin.monitor.session import session_at
from steptwin.monitor.values import FollowedValues, MonitorReading, PolledValues
from steptwin.subject import commands as command
from steptwin.subject.following import filter_of
from steptwin.world import script as do

NAMES = ("M1_POS_ACT", "M1_ACC", "M1_DEC", "USER_REGISTER[3]", "DATA_TYPE", "M1_HOME")


class Counted(RemoteSubject):
    """Counts what is sent."""

    sent: list[object]

    def _send(self, message: Mapping[str, object]) -> None:
        self.sent.append(message["do"])
        super()._send(message)


@pytest.fixture
def twin(serve: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> Generator[RemoteSubject]:
    served = serve("--demo")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(served.directory))
    Counted.sent = []
    with RemoteSubject("mic488") as twin:
        twin.do(command.Pause())
        yield twin


def values() -> FollowedValues:
    controller = controller_of("mic488")
    assert controller is not None
    return FollowedValues(controller, Counted)


def test_a_twin_that_is_followed_shows_what_polling_shows(twin: RemoteSubject) -> None:
    async def both() -> tuple[MonitorReading, MonitorReading]:
        session = session_at("mic488", 5.0)
        async with session.mic:
            polled = await PolledValues(session.mic).look(NAMES[:5])
        followed = values()
        try:
            return polled, await followed.look(NAMES)
        finally:
            await followed.close()

    twin.do(command.Enable("mic488", 1))
    twin.do(do.Write((("mic488", "OUT3", 1.0), ("mic488", "USER_REGISTER[3]", 7.0))))
    twin.do(do.Set((("mic488", "IN9", 1.0),)))
    twin.do(command.Move("mic488", 1, to=12.0))
    twin.do(command.Advance(duration=300 * MILLISECOND))
    polled, followed = asyncio.run(both())
    assert polled.status.axes == (3, 0, 0, 0)
    for name in ("axes", "inputs", "outputs", "controller", "program"):
        assert getattr(followed.status, name) == getattr(polled.status, name), name
    assert followed.status.positions == pytest.approx(polled.status.positions, abs=0.011)  # a pulse
    assert followed.status.velocities == pytest.approx(polled.status.velocities, rel=1e-6)
    assert followed.values.keys() == polled.values.keys(), "M1_HOME can only be written"
    for name, (value, _) in polled.values.items():
        assert followed.values[name][0] == pytest.approx(value, abs=0.011), name
    assert (followed.status.units[0], polled.status.units[0]) == ("mm", "mm")


def test_a_motion_costs_neither_frames_nor_reads(twin: RemoteSubject) -> None:
    """Of a twin whose time is paused, the moment is read; positions are computed."""
    followed = values()
    twin.do(command.Enable("mic488", 1))
    twin.do(command.Move("mic488", 1, to=40.0))
    asyncio.run(followed.look(()))
    twin.do(command.Advance(duration=SECOND))
    asyncio.run(followed.look(()))
    asyncio.run(followed.look(()))
    frames = twin.follow_from_now(filter_of(["frame"]), 100)[0]
    Counted.sent.clear()
    positions = []
    for _ in range(3):
        twin.do(command.Advance(duration=100 * MILLISECOND))
        positions.append(asyncio.run(followed.look(())).status.positions[0])
    assert Counted.sent == ["time"] * 3
    assert frames.take().events == []
    assert positions[0] < positions[1] < positions[2]
    assert positions[2] == twin.read("mic488.M1.position")[0].value
    asyncio.run(followed.close())


def test_other_registers_are_followed_from_then_on(twin: RemoteSubject) -> None:
    followed = values()
    assert asyncio.run(followed.look(("M1_ACC",))).values.keys() == {"M1_ACC"}
    assert asyncio.run(followed.look(("M2_ACC", "OUT1"))).values.keys() == {"M2_ACC", "OUT1"}
    twin.do(do.Write((("mic488", "M2_ACC", 11.0),)))
    twin.do(command.Advance(duration=SECOND))
    assert asyncio.run(followed.look(("M2_ACC", "OUT1"))).values["M2_ACC"][0] == 11.0
    asyncio.run(followed.close())


def test_a_twin_that_has_ended_is_a_failure_and_found_again(serve: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    served = serve("--demo")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(served.directory))
    followed = values()
    asyncio.run(followed.look(()))
    served.end()
    for _ in range(2):
        with pytest.raises((LineFailure, Misuse)):
            asyncio.run(followed.look(()))
