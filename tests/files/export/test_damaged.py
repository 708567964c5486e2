"""A trace that was damaged, or made up, is refused with its place or can be exported; nothing else happens."""

from __future__ import annotations

import json
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from damage import VALUES, WAYS, damaged
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.files.export import axis_views, read_trace, write_trace
from steptwin.files.world import World
from steptwin.simulation.scheduler.trace import Trace

EXAMPLES = Path(__file__).parents[3] / "examples" / "worlds"


@cache
def recorded() -> list[str]:
    """The lines of a short run with moves, levels, frames and inputs."""
    import tempfile

    world = World.load(EXAMPLES / "feeder.toml")
    world.run(for_=3)
    with tempfile.TemporaryDirectory() as folder:
        (path,) = write_trace(world.trace, Path(folder) / "t.jsonl", views=axis_views(world), ended=world.now)
        return path.read_text().splitlines()


def check_that_it_is_refused_or_exported(path: Path) -> None:
    """Whatever cannot be done is a `Misuse` that names the file; what was exported is there."""
    refusal, saved = "", None
    try:
        saved = read_trace(path)
    except Misuse as refused:
        refusal = str(refused)
    assert saved is not None or str(path) in refusal
    if saved is not None:
        for name in ("vcd", "html", "csv"):
            target = path.with_suffix(f".{name}")
            with suppress(Misuse):
                written = write_trace(saved.trace, target, views=saved.views, title=saved.title, ended=saved.until, period=10**8)
                assert all(file.exists() for file in written)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@example(way=[3], value=10**18)
@example(way=[5, 0, 4], value=0)
@example(way=[5, 0, 5], value={"phases": ["a", "b"]})
@given(way=WAYS, value=VALUES)
def test_a_head_with_another_value_is_refused_or_exported(way: list[int], value: Any, tmp_path: Path) -> None:
    lines = recorded()
    path = tmp_path / "t.jsonl"
    path.write_text("\n".join([json.dumps(damaged(json.loads(lines[0]), way, value)), *lines[1:]]))
    check_that_it_is_refused_or_exported(path)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(number=st.integers(0, 10**6), way=WAYS, value=VALUES)
def test_a_record_with_another_value_and_the_right_digest_is_refused_or_exported(
    number: int, way: list[int], value: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = list(recorded())
    at = 1 + number % (len(lines) - 1)
    lines[at] = json.dumps(damaged(json.loads(lines[at]), way, value))
    path = tmp_path / "t.jsonl"
    path.write_text("\n".join(lines))
    digest = json.loads(lines[0])["digest"]
    whole = Trace.digest

    def right(trace: Trace) -> str:
        whole(trace)
        return digest

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Trace, "digest", right)
        check_that_it_is_refused_or_exported(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"\xff\xfe\n", ":1: not the first line of a trace"),
        (b"[" * 100_000, ":1: not the first line of a trace"),
        (b"9" * 5000, ":1: not the first line of a trace"),
        (b" " * (5 << 20), ":1: a line of more than"),
        (b"[]\n", ":1: not the first line of a trace"),
        (b"null\n", ":1: not the first line of a trace"),
        (b'{"steptwin_trace": 1}\n', ":1: a trace of format 1: this version reads format 2"),
    ],
)
def test_what_is_no_trace(content: bytes, message: str, tmp_path: Path) -> None:
    path = tmp_path / "t.jsonl"
    path.write_bytes(content)
    with pytest.raises(Misuse, match=message):
        read_trace(path)
