"""Whatever is requested of a twin: exactly one answer, never an internal error."""

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

from steptwin.files.world import World
from steptwin.live.clock import Clock
from steptwin.live.control import ControlEndpoint
from steptwin.live.pace import Pace
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.world import LiveWorld
from steptwin.live.world_control import WorldControl
from steptwin.subject.commands import COMMANDS

EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"


def world() -> WorldControl:
    live = LiveWorld(World.load(EXAMPLES / "feeder.toml"))
    realtime = RealTimeDriver(live, Clock())
    return WorldControl(realtime, live, Pace(live, realtime, lambda _: None, has_clients=True), list)


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


@st.composite
def requests_of(draw: st.DrawFn) -> dict[str, Any]:
    """A command with fields as they should be, or not."""
    name = draw(st.sampled_from(list(COMMANDS)) | TEXTS)
    fields = [field.name for field in COMMANDS[name].fields] if name in COMMANDS else []
    request: dict[str, Any] = {key: draw(VALUES) for key in fields if draw(st.booleans())}
    if name == "step":  # one that is granted goes on for as long as a part lasts
        request = {"for_ns": draw(st.integers(-1, 10**6) | st.just("1")), "until": draw(st.none() | TEXTS)}
    return {"do": name, **request, **draw(st.dictionaries(st.sampled_from(["id", "version", "x"]), VALUES, max_size=1))}


@contextmanager
def silent_loop(troubles: list[dict[str, Any]]) -> Generator[None]:
    asyncio.get_running_loop().set_exception_handler(lambda _, context: troubles.append(context))
    yield


async def answered(path: Path, line: bytes) -> list[bytes]:
    reader, writer = await asyncio.open_unix_connection(str(path))
    writer.write(line)
    writer.write_eof()
    lines = (await reader.read()).splitlines()
    writer.close()
    return lines


def check(lines: list[bytes]) -> None:
    """Each line of request has exactly one answer that says something, and the twin lives."""
    troubles: list[dict[str, Any]] = []

    async def scene() -> list[list[bytes]]:
        with silent_loop(troubles):
            endpoint = ControlEndpoint("fuzz", world())
            await endpoint.open()
            try:
                return [await answered(endpoint.path, line) for line in [*lines, b'{"do": "nothing"}\n']]
            finally:
                await endpoint.close()

    for line, answers in zip([*lines, b"the last"], asyncio.run(scene()), strict=True):
        assert len(answers) == 1, (line, answers)
        answer: Mapping[str, Any] = json.loads(answers[0])
        assert ("ok" in answer) is not ("error" in answer), (line, answer)
        assert answer.get("error", {}).get("code") in (None, "misuse", "refusal"), (line, answer)
    assert troubles == []


def requested(request: Mapping[str, Any]) -> bytes:
    return json.dumps(request).encode() + b"\n"


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@example(requests=[{"do": "set", "levels": [1]}, {"do": "turn", "controller": "table", "axis": 1, "counts": 2**40}])
@example(requests=[{"do": "set", "levels": {"table.IN1": 10**400}}, {"do": "resume", "speed": 10**400}])
@example(requests=[{"do": "fault", "fault": f"stuck pin=IN1 count={10**400}"}, {"do": "clear_fault", "name": "a"}])
@example(requests=[{"do": "fault", "fault": "busy unit=1 name=a"}, {"do": "fault", "fault": "busy unit=1 name=a"}])
@example(requests=[{"do": "save", "file": f"/tmp/{'x' * 3000}.json"}, {"do": "save", "file": "/tmp/\0.json"}])
@example(
    requests=[{"do": "subscribe", "id": []}, {"do": "subscribe", "id": 1, "bound": 1}, {"do": "unsubscribe", "subscription": 1}]
)
@given(requests=st.lists(requests_of(), min_size=1, max_size=6))
def test_every_request_has_one_answer(requests: list[dict[str, Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    check([requested(request) for request in requests])


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(lines=st.lists(st.binary(max_size=60).map(lambda data: data.replace(b"\n", b"") + b"\n"), min_size=1, max_size=4))
def test_every_line_has_one_answer(lines: list[bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    check(lines)
