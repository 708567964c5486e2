"""Whatever is requested of a twin: exactly one answer, never an internal error. For each kind of twin that is served."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from steptwin.commands.up_world import LiveWorld
from steptwin.files.world import World
from steptwin.live.cell import Cell
from steptwin.live.clock import Clock
from steptwin.live.control import ControlEndpoint, Handler
from steptwin.live.pace import Pace
from steptwin.live.world_control import WorldControl
from steptwin.m1486.variants import variant
from steptwin.mic488.config import ControllerConfig
from steptwin.served.m1486 import ChainOptions, M1486Line
from steptwin.served.mic488 import Mic488Line

EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"


def mic488() -> dict[str, Handler]:
    line = Mic488Line(ControllerConfig(), [1, 2], "1.70")
    return line.handlers(Cell(line.kernel, Clock()))


def m1486() -> dict[str, Handler]:
    line = M1486Line(ChainOptions(variant=variant("E2"), addresses=(1, 7)))
    return line.handlers(Cell(line.kernel, Clock()))


def world() -> dict[str, Handler]:
    live = LiveWorld(World.load(EXAMPLES / "feeder.toml"))
    cell = Cell(live, Clock())
    pace = Pace(live, cell, lambda _: None, has_clients=True)
    return {**WorldControl(cell, live).handlers(), **pace.handlers()}


TWINS = {"mic488": mic488, "m1486": m1486, "world": world}

WORDS = [
    *("1", "2", "7", "A", "M1", "IN1", "AIN1", "B3", "table", "drum", "table.IN3", "drum.B3", "start", "START", "x", "", "."),
    *("crc", "crc nth=1", "stall axis=1 machine=1", "stuck pin=IN1", "wear", "supply-drop off_ms=1e9", "busy unit=1 name=a", "a"),
    *(
        "max",
        "0",
        "1e999",
        "nan",
        "table.IN3",
        "x.position > 0",
        "((((",
        "drive",
        "free",
        "blocked",
        "true",
        "\0",
        "\udcff",
        "ß",
        "٣",
    ),
    *("/", "/nowhere/s.json", "s.json", "9" * 400, "x" * 5000, "0x" + "f" * 5000),
]
TEXTS = st.sampled_from(WORDS) | st.text(max_size=8)
NUMBERS = st.sampled_from([0, 1, -1, 2, 5, 10**9, 2**31, 2**63, -(2**63), 10**400, 0.5, 1e308, float("nan"), float("inf")])
VALUES = st.recursive(
    st.none() | st.booleans() | NUMBERS | st.integers() | st.floats() | TEXTS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS, inner, max_size=3),
    max_leaves=6,
)
REQUESTS = st.fixed_dictionaries(
    {"do": st.sampled_from(["pin", "encoder", "fault", "state", "power-cycle", "pause", "resume", "step", "save"]) | TEXTS},
    optional={
        "unit": st.sampled_from([None, 1, 2, 0, 7, "7", "table", "drum"]) | VALUES,
        "set": VALUES | st.dictionaries(TEXTS, VALUES, max_size=3) | st.lists(TEXTS, max_size=3),
        "clear": st.booleans() | VALUES | st.lists(TEXTS, max_size=3),
        "speed": VALUES,
        "until": VALUES,
        # A step that is granted goes on for as long as a part lasts.
        "for_ns": st.integers(-1, 10**6) | st.just("1"),
        "to_ns": st.integers(-1, 10**6) | st.just([1]),
        "file": VALUES,
    },
)


@contextmanager
def silent_loop(troubles: list[dict[str, Any]]) -> Generator[None]:
    asyncio.get_running_loop().set_exception_handler(lambda _, context: troubles.append(context))
    yield


async def answered(path: Path, line: bytes) -> list[bytes]:
    reader, writer = await asyncio.open_unix_connection(str(path))
    writer.write(line)
    lines = (await reader.read()).splitlines()
    writer.close()
    return lines


def check(kind: str, lines: list[bytes]) -> None:
    """Each line of request has exactly one answer that says something, and the twin lives."""
    troubles: list[dict[str, Any]] = []

    async def scene() -> list[list[bytes]]:
        with silent_loop(troubles):
            endpoint = ControlEndpoint("fuzz", TWINS[kind]())
            await endpoint.open()
            try:
                return [await answered(endpoint.path, line) for line in [*lines, b'{"do": "nothing"}\n']]
            finally:
                await endpoint.close()

    for line, answers in zip([*lines, b"the last"], asyncio.run(scene()), strict=True):
        assert len(answers) == 1, (line, answers)
        answer: Mapping[str, Any] = json.loads(answers[0])
        assert set(answer) <= {"ok", "error", "misuse"}, (line, answer)
        assert "internal error" not in str(answer.get("error")), (line, answer)
    assert troubles == []


def requested(request: Mapping[str, Any]) -> bytes:
    return json.dumps(request).encode() + b"\n"


@pytest.mark.parametrize("kind", TWINS)
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@example(requests=[{"do": "pin", "set": [1]}, {"do": "encoder", "set": {"M1": 1}}, {"do": "pin", "set": 5}])
@example(requests=[{"do": "pin", "set": {"IN1": 10**400}}, {"do": "pin", "unit": "table", "set": {"IN1": 10**400}}])
@example(requests=[{"do": "fault", "set": [f"stuck pin=IN1 count={10**400}"]}, {"do": "fault", "clear": ["a", "a"]}])
@example(requests=[{"do": "fault", "set": ["busy unit=1 name=a"]}, {"do": "fault", "clear": ["a", "a"], "set": ["crc", "crc"]}])
@example(requests=[{"do": "save", "file": f"/tmp/{'x' * 3000}.json"}, {"do": "save", "file": "/tmp/\0.json"}])
@example(requests=[{"do": "encoder", "unit": "table", "set": {"1": 2**40}}, {"do": "encoder", "unit": 1, "set": {"٣": True}}])
@given(requests=st.lists(REQUESTS, min_size=1, max_size=6))
def test_every_request_has_one_answer(
    kind: str, requests: list[dict[str, Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    check(kind, [requested(request) for request in requests])


@pytest.mark.parametrize("kind", TWINS)
@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(lines=st.lists(st.binary(max_size=60).map(lambda data: data.replace(b"\n", b"") + b"\n"), min_size=1, max_size=4))
def test_every_line_has_one_answer(kind: str, lines: list[bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    check(kind, lines)
