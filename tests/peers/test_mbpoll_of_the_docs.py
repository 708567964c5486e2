"""What the pages for newcomers have them type into mbpoll, typed against the demo."""

from __future__ import annotations

import re
import shlex
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pages import only

ROOT = Path(__file__).parents[2]


def commands(page: str, program: str) -> list[list[str]]:
    """The command lines of a page that run ``program``."""
    blocks = re.findall(r"^```sh\n(.*?)^```", (ROOT / page).read_text(), re.MULTILINE | re.DOTALL)
    lines = [shlex.split(line, comments=True) for block in blocks for line in block.splitlines()]
    return [line for line in lines if line and Path(line[0]).name == program]


def values(output: str) -> list[float]:
    return [float(value) for value in re.findall(r"^\[\d+\]: \t(\S+)", output, re.MULTILINE)]


def poll(command: list[str], enough: int) -> list[float]:
    """The values that a polling command printed, ended by Ctrl-C."""
    with subprocess.Popen(["stdbuf", "-oL", *command], stdout=subprocess.PIPE, text=True) as process:
        lines = []
        while len(values("".join(lines))) < enough and process.stdout is not None:
            lines.append(process.stdout.readline())
            assert lines[-1], "it ended by itself"
        process.send_signal(signal.SIGINT)
        return values("".join(lines))


def test_the_pty_as_the_page_about_serve_polls_it(require_peer: Callable[[str], str], serve: Callable[..., Any]) -> None:
    pty = str(serve("--demo").pty)
    _, *arguments = only(commands("docs/serve.md", "mbpoll"), "mbpoll commands of docs/serve.md")
    assert poll([require_peer("mbpoll"), *arguments[:-1], pty], 2) == [0.0, 0.0]


def test_the_panel_of_the_tutorial(
    require_peer: Callable[[str], str], serve: Callable[..., Any], connect: Callable[..., Any]
) -> None:
    twin = serve("--demo")
    master = connect(twin.tcp_port)
    master.dynamics(1, acc=2000.0, dec=2000.0, vmax=200.0)
    mbpoll = require_peer("mbpoll")
    real = {"5020": str(twin.tcp_port), "./mic488": str(twin.pty)}
    read, enable, move, status, stop, serial = (
        [mbpoll, *(real.get(word, word) for word in line[1:])] for line in commands("docs/tutorials/panel.md", "mbpoll")
    )

    def type_it(line: list[str]) -> list[float]:
        return values(subprocess.run(line, capture_output=True, text=True, check=True).stdout)

    assert type_it(read) == [0.0]
    type_it(enable)
    type_it(move)
    assert type_it(status) in ([3.0], [4.0])
    assert master.follow(1, 3)[-1][2:] == (40.0, 0.0, 4)
    type_it(stop)
    assert master.status(1) == 1
    assert type_it(serial) == [40.0]


def test_every_option_of_serve_is_in_the_reference(serve: Callable[..., Any]) -> None:
    helped = serve().command("serve", "mic488", "--help").stdout
    offered = set(re.findall(r"^  (--[a-z-]+)", helped, re.MULTILINE)) - {"--help"}
    controllers, _, _ = (ROOT / "docs/reference/serve.md").read_text().partition("## Chips")
    rows = re.findall(r"^\| (`--.*?) \|", controllers, re.MULTILINE)
    assert {option for row in rows for option in re.findall(r"`(--[a-z-]+)", row)} == offered
