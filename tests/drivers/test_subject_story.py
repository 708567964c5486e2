"""One story, told to a world in this process, in another one, and to a device behind a driver: the answers are the same."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from device_rig import CELL, Rig
from tests.conftest import STEPTWIN, until

from steptwin.controller import SECOND
from steptwin.controllerstate import ControllerState
from steptwin.errors import Misuse, Refusal
from steptwin.files.world import World
from steptwin.jsonvalues import read
from steptwin.live.remote import RemoteSubject
from steptwin.simulation.script import steps as do
from steptwin.subject import commands as command
from steptwin.subject.contract import UNKNOWN, Reading, Subject
from steptwin.subject.world import WorldSubject


@pytest.fixture
def rig() -> Iterator[Rig]:
    rig = Rig()
    with rig.mic, rig.chip:
        yield rig


class Way(NamedTuple):
    """A subject, and how time goes on there."""

    subject: Subject
    advance: Callable[[int], object]


@contextmanager
def in_this_process(directory: Path) -> Generator[Way]:
    subject = WorldSubject(World.from_toml(CELL))
    yield Way(subject, lambda ns: subject.do(command.Advance(duration=ns)))


@contextmanager
def in_another_process(directory: Path) -> Generator[Way]:
    (directory / "cell.toml").write_text(CELL)
    environment = {**os.environ, "TERM": "dumb"}
    started = [STEPTWIN, "up", "cell.toml", "--speed", "0", "--ready-file", "ready.json"]
    with (directory / "out").open("w") as out:
        process = subprocess.Popen(started, cwd=directory, env=environment, stdout=out, stderr=out)
    try:
        ready = directory / "ready.json"
        until(lambda: ready.exists() or process.poll() is not None, "the ready file is there")
        with RemoteSubject(json.loads(ready.read_text())["name"]) as subject:
            yield Way(subject, lambda ns: subject.do(command.Advance(duration=ns)))
    finally:
        process.terminate()
        process.wait(60)


@contextmanager
def behind_a_driver(directory: Path) -> Generator[Way]:
    rig = Rig()
    with rig.mic:
        yield Way(rig.mic.subject("table"), lambda ns: rig.time.sleep(ns / SECOND))


WAYS = {"in this process": in_this_process, "in another process": in_another_process, "behind a driver": behind_a_driver}


AXIS_POINTS = ("position", "velocity", "status", "encoder", "enabled", "moving")


POINTS = (
    *(f"table.M1.{name}" for name in AXIS_POINTS),
    *("table.status", "table.program", "table.IN1", "table.OUT2", "table.M1_EN", "table.AIN1", "table.ERR"),
    *("table.M1_ACC", "table.hr:10020", "table.M1_HOME", "table.USER_REGISTER[12]:real"),
)


UNKNOWN_PINS = {"AIN1", "AIN2", "ERR"}


UNKNOWN_TO_DRIVERS = {"table.AIN1", "table.ERR", "table.M1_HOME"}


STORY: tuple[command.Command | int, ...] = (
    command.Move("table", 1, to=5.0),  # the drive is off
    command.Enable("table", 1),
    command.Home("table", 1, -20.0),
    20 * SECOND,
    command.Move("table", 1, to=30.0),
    3 * SECOND,
    command.Move("table", 1, by=-10.5),
    3 * SECOND,
    do.Write((("table", "M1_ACC", 250.0), ("table", "OUT2", 1.0))),
    do.Write((("table", "M1_STATUS", 1.0),)),
    do.Write((("table", "NOTHING", 1.0),)),
    command.Jog("table", 1, 4.0),
    1 * SECOND,
    command.Move("table", 1, to=20.0),
    3 * SECOND,
    command.StopAxes("table", 1),
    command.StopAxes("table"),
    command.Enable("table", 7),
    command.Enable("tabel", 1),
    command.ReadPins("table"),
    command.ReadPins("tabel"),
    command.ReadState("table"),
    command.ReadState("tabel"),
    command.Encoders("table"),
    command.ReadPoints(("table.M1.position", "table.nothing")),
    command.ReadPoints(("nothing.M1.position",)),
    command.Enable("table", 1, on=False),
    command.ControlProgram("table", "stop"),
)


def answer_of(subject: Subject, wanted: command.Command) -> Any:
    """What a command gives, or the family of its error."""
    try:
        return subject.do(wanted).value
    except Misuse:
        return "misuse"
    except Refusal:
        return "refusal"


class Step(NamedTuple):
    answer: Any
    points: dict[str, Reading]


def told_by(way: Way) -> list[Step]:
    """What each step of the story gave, and the points after it."""
    told: list[Step] = []
    for each in STORY:
        answer = None
        if isinstance(each, int):
            way.advance(each)
        else:
            answer = answer_of(way.subject, each)
        told.append(Step(answer, {reading.point: reading for reading in way.subject.read(*POINTS)}))
    return told


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Step]]:
    found = {}
    for name, way in WAYS.items():
        with way(tmp_path_factory.mktemp("way")) as one:
            found[name] = told_by(one)
    return found


def test_a_world_in_another_process_answers_the_same(told: dict[str, list[Step]]) -> None:
    assert told["in another process"] == told["in this process"]
    assert [step.answer for step in told["in this process"]].count("misuse") == 8


def test_a_device_answers_the_same_but_for_what_it_cannot_know_or_refuses(told: dict[str, list[Step]]) -> None:
    different: dict[int, tuple[Any, Any]] = {}
    for number, (world, device) in enumerate(zip(told["in this process"], told["behind a driver"], strict=True)):
        if device.answer != world.answer:
            different[number] = world.answer, device.answer
        assert {point for point, reading in device.points.items() if reading.quality == UNKNOWN} == UNKNOWN_TO_DRIVERS
        if world.points["table.M1.moving"].value == 0.0:  # the exchanges of a driver take time
            for point in set(POINTS) - UNKNOWN_TO_DRIVERS:
                assert device.points[point].value == pytest.approx(world.points[point].value, abs=1e-6), (number, point)
        assert [reading.unit for reading in device.points.values()] == [reading.unit for reading in world.points.values()]
    differing = STORY[0], command.ReadPins("table"), command.Encoders("table"), command.ReadState("table")
    refused, pins, encoders, state = map(STORY.index, differing)
    assert different.keys() == {refused, pins, encoders, state}
    # The controller ignores a motion while the drive is off (MIC-8): the driver refuses it before anything is sent.
    assert different[refused] == (None, "refusal")
    levels, known = different[pins]
    assert known == {pin: None if pin.split(".")[1] in UNKNOWN_PINS else level for pin, level in levels.items()}
    counts, known = different[encoders]
    assert known == [{**one, "turned_by": None} for one in counts]
    present, shown = different[state]
    for axis, seen, count in zip(present["axes"], shown["axes"], counts, strict=True):
        position = pytest.approx(axis["position"], abs=1e-6)
        assert seen == {**axis, "position": position, "encoder": count["counts"]}
    assert shown["program"] == present["program"]
    assert shown["pins"] == {pin: None if pin in UNKNOWN_PINS else level for pin, level in present["pins"].items()}
    assert shown["details"] == {**present["details"], "user_registers": None}
    assert read(ControllerState, shown).time_s is None
    for key in ("kind", "variant", "status"):
        assert shown[key] == present[key]
