"""A twin is watched without being polled: what is sent to it, and that the values are those that it shows."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from typing import Any

import pytest

from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import Misuse
from steptwin.live.remote import RemoteSubject
from steptwin.live.watching import TwinWatch
from steptwin.simulation.script import steps as do
from steptwin.subject import commands as command

PATHS = ("M1_POS_ACT", "M1.velocity", "M1_STATUS", "M1.encoder", "OUT3", "IN9", "M1_HOME")


class Counted(RemoteSubject):
    """Counts what is sent."""

    sent: list[object]

    def _send(self, message: Mapping[str, object]) -> None:
        self.sent.append(message["do"])
        super()._send(message)


class Scene:
    """A twin whose time is in the hands of the test, and somebody who watches."""

    def __init__(self, name: str) -> None:
        Counted.sent = []
        self.twin = RemoteSubject(name)
        self.twin.do(command.Pause())
        self.watching = Counted(name)
        self.wall = 0
        self.watch = TwinWatch(self.watching, "mic488", PATHS, lambda: self.wall)

    def values(self) -> tuple[Any, ...]:
        return tuple(value for value, _ in self.watch.look().values())

    def shown(self) -> tuple[float | None, ...]:
        return tuple(reading.value for reading in self.twin.read(*(f"mic488.{path}" for path in PATHS)))

    def step(self, nanos: int) -> None:
        self.twin.do(command.Advance(duration=nanos))

    def sent(self) -> list[object]:
        sent, self.watching.sent[:] = list(self.watching.sent), []
        return sent


@pytest.fixture
def scene(serve: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> Generator[Scene]:
    served = serve("--demo")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(served.directory))
    scene = Scene("mic488")
    with scene.twin, scene.watching:
        yield scene


def test_values_are_those_that_the_twin_shows(scene: Scene) -> None:
    scene.twin.do(command.Enable("mic488", 1))
    scene.twin.do(command.Move("mic488", 1, to=12.0))
    moved = set()
    for _ in range(12):
        scene.step(200 * MILLISECOND)
        assert scene.values() == pytest.approx(scene.shown(), abs=1e-9)
        moved.add(scene.shown()[0])
    assert len(moved) > 4
    assert 12.0 in moved
    scene.twin.do(do.Write((("mic488", "OUT3", 1.0), ("mic488", "M1_POS_ACT", 3.0))))
    scene.twin.do(do.Set((("mic488", "IN9", 1.0),)))
    for _ in range(4):
        scene.step(30 * MILLISECOND)
        scene.values()
    assert scene.values() == scene.shown() == (3.0, 0.0, 4.0, scene.shown()[3], 1.0, 1.0, None)
    assert [type(value) for value in scene.values()][2:6] == [int, float, bool, bool]


def test_a_twin_at_rest_is_asked_nothing(scene: Scene) -> None:
    scene.twin.do(command.Resume(0.001))
    for _ in range(3):
        scene.wall += 200 * SECOND
        scene.values()
    scene.sent()
    for _ in range(5):
        scene.wall += 1000 * SECOND
        scene.values()
    assert scene.sent() == []


def test_a_motion_is_one_event(scene: Scene) -> None:
    """While it goes on nothing is read but what the plan does not say."""
    scene.twin.do(command.Enable("mic488", 1))
    only = TwinWatch(scene.watching, "mic488", ["M1_POS_ACT", "M1_STATUS"], lambda: scene.wall)
    scene.twin.do(command.Move("mic488", 1, to=100.0))
    scene.step(300 * MILLISECOND)
    only.look()
    scene.step(300 * MILLISECOND)
    before = only.look()["M1_POS_ACT"][0]
    scene.sent()
    scene.step(500 * MILLISECOND)
    after = only.look()["M1_POS_ACT"][0]
    assert before is not None
    assert after is not None
    assert after > before
    assert scene.sent() == ["time"]  # it stands: the moment is asked for


def test_a_follower_that_was_too_slow_begins_anew(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("steptwin.live.watching.BOUND", 2)
    watch = TwinWatch(scene.watching, "mic488", ["M1_POS_ACT", "OUT3"], lambda: scene.wall)
    scene.twin.do(command.Enable("mic488", 1))
    for to in (5.0, 10.0):
        for number in range(1, 9):
            scene.twin.do(do.Write((("mic488", f"OUT{number}", float(to > 5.0)),)))
        scene.twin.do(command.Move("mic488", 1, to=to))
        scene.step(5 * SECOND)
        for _ in range(2):
            watch.look()
        assert watch.look() == {"M1_POS_ACT": (to, "mm"), "OUT3": (to > 5.0, "")}


def test_a_controller_that_is_not_there(scene: Scene) -> None:
    with pytest.raises(Misuse, match="mic488 has no controller 'mic'"):
        TwinWatch(scene.watching, "mic", PATHS)


def test_a_chip_that_moves_is_watched_without_a_command(serve_m1486: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    served = serve_m1486("--variant", "B")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(served.directory))
    paths = ("position", "velocity", "counter", "variable")
    with RemoteSubject("m1486") as twin, RemoteSubject("m1486") as watching:
        twin.do(command.Pause())
        (chip,) = (part.name for part in twin.description.controllers)
        watch = TwinWatch(watching, chip, paths, lambda: 0)
        twin.do(command.Move(chip, 1, by=64_000))
        seen = set()
        for _ in range(8):
            twin.do(command.Advance(duration=100 * MILLISECOND))
            found = tuple(value for value, _ in watch.look().values())
            assert found == pytest.approx([reading.value for reading in twin.read(*(f"{chip}.{path}" for path in paths))])
            seen.add(found[0])
        assert len(seen) > 4
