"""A C program on libmodbus moves three axes."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

SOURCE = Path(__file__).with_name("three_axes.c")


@pytest.fixture(scope="module")
def three_axes(
    require_peer: Callable[[str], str], require_library: Callable[[str], list[str]], tmp_path_factory: pytest.TempPathFactory
) -> str:
    program = tmp_path_factory.mktemp("c") / "three_axes"
    compiler = [require_peer("cc"), "-std=c99", "-Wall", "-Werror", "-O1"]
    subprocess.run([*compiler, str(SOURCE), "-o", str(program), *require_library("libmodbus")], check=True)
    return str(program)


@pytest.mark.parametrize("way", ["tcp", "rtu"])
def test_three_axes_arrive(three_axes: str, serve: Callable[..., Any], way: str) -> None:
    twin = serve("--demo")
    where = str(twin.tcp_port) if way == "tcp" else str(twin.pty)
    run = subprocess.run([three_axes, way, where], capture_output=True, text=True, check=False, timeout=100)
    assert run.returncode == 0, run.stderr
    polls = [[axis.split() for axis in line.split("  ")] for line in run.stdout.splitlines()]
    positions = [[float(position) for _, position in poll] for poll in polls]
    assert positions[-1] == [42.5, 85.0, -7.5]
    assert {status for poll in polls for status, _ in poll} == {"3", "4"}
    for one, two in pairwise(positions):
        assert one[0] <= two[0]
        assert one[1] <= two[1]
        assert one[2] >= two[2]
    assert len({tuple(poll) for poll in positions}) > 3
