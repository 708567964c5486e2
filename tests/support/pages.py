"""Code blocks of the documentation, and a reader who does what they say.

A block that cannot be run has the reason in a comment on the line before: ``<!-- not run: needs a serial port -->``.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from types import TracebackType
from typing import Self, TypeVar

T = TypeVar("T")

ROOT = Path(__file__).parents[2]
BIN = Path(sys.executable).parent
PAGES = ("README.md", "CONTRIBUTING.md", *sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").rglob("*.md")))
RUN = ("sh", "console", "python", "toml", "json")
"""Languages of blocks that are run. ``text`` is output and excerpts; names in braces are directives of Sphinx."""

_BLOCK = re.compile(
    r"(?:^<!-- not run: (?P<reason>.*?) -->\n)?^```(?P<language>[^\n]*)\n(?P<code>.*?)^```$", re.MULTILINE | re.DOTALL
)
_SAVED = re.compile(r"\b[Ss]ave this (?:one )?as `([^`]+)`(?:[^\n]|\n(?!\n))*\n\n\Z")
"""The paragraph before a block that is a file."""
_PROMISE = re.compile(r"^ *print\(.*\)  # ((?:M|chip )\d.*)$", re.MULTILINE)
"""What a Python block says that it prints."""
_QUOTED = re.compile(r"'[^']*'|\"[^\"$`\\]*\"|\s#.*$")
"""Of a line what no shell looks into, and its comment."""
LIMIT_S = 100.0
PYTEST_OF_USERS = tuple(f"-pno:{name}" for name in ("cacheprovider", "asyncio", "hypothesispytest", "pytest-lsp", "schemathesis"))
"""Options without what only these tests have, and what takes a second to import."""


@dataclass(frozen=True)
class Block:
    page: str
    line: int
    language: str
    code: str
    reason: str | None
    """Why it is not run."""
    saved: str | None = None
    """The file that a reader makes of it."""

    @property
    def is_done(self) -> bool:
        """Whether a reader does something with it."""
        return self.reason is None and (self.language in RUN or self.saved is not None)

    def commands(self) -> list[str]:
        return [line for line in self.code.splitlines() if shlex.split(line, comments=True)]


def blocks(page: str) -> list[Block]:
    text = (ROOT / page).read_text()
    found_blocks = []
    for found in _BLOCK.finditer(text):
        saved = _SAVED.search(text, max(0, found.start() - 400), found.start())
        line = text.count("\n", 0, found.start("code"))
        found_blocks.append(Block(page, line, found["language"], found["code"], found["reason"], saved and saved[1]))
    return found_blocks


def only(found: Sequence[T], what: str) -> T:
    """The one element; the test fails with `what` where there are none or several."""
    assert len(found) == 1, f"{what}: expected one, found {found}"
    return found[0]


class Reader:
    """A directory with the examples, a demo that runs as README says, and what the page starts besides.

    Ports in the text are replaced by those that the twins really have. Commands are run one after the other; `serve` and `up`
    go on while the following ones are run, until another one takes their place.
    """

    def __init__(self, directory: Path) -> None:
        self._directory = directory
        self._running: dict[str, subprocess.Popen[str]] = {}
        self._ports = {"5020": "5020", "5021": "5021", "5022": "5022"}
        self._cwd = directory / "steptwin"
        for name in ("examples", "README.md"):
            copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copyfile
            self._cwd.mkdir(exist_ok=True)
            copy(ROOT / name, self._cwd / name)
        for world in (self._cwd / "examples/worlds").glob("*.toml"):
            world.write_text(re.sub(r"127\.0\.0\.1:\d+", "127.0.0.1:0", world.read_text()))
        (self._cwd / ".venv").mkdir()
        (self._cwd / ".venv/bin").symlink_to(BIN)
        runtime = directory / "run"
        runtime.mkdir(mode=0o700)
        self._environment = {
            **os.environ,
            "PATH": f"{BIN}:{os.environ['PATH']}",
            "XDG_RUNTIME_DIR": str(runtime),
            "COLUMNS": "200",
            "TERM": "dumb",
            "PYTEST_ADDOPTS": shlex.join(PYTEST_OF_USERS),
        }
        self._environment.pop("STEPTWIN_DEVICE", None)

    def __enter__(self) -> Self:
        self.command("steptwin serve mic488 --demo")
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        for name in list(self._running):
            self._end(name)

    def read(self, page: Sequence[Block]) -> None:
        """Run the blocks of a page in their order; tests that follow each other in one run of pytest, whose start is slow."""
        for are_tests, together in groupby(page, lambda block: block.language == "python" and "def test_" in block.code):
            if are_tests:
                self._tests(list(together))
            else:
                for block in together:
                    self.do(block)

    def do(self, block: Block) -> None:
        """Run a block. Raises `AssertionError` with page, line and output for what fails."""
        try:
            if block.saved is not None:
                (self._cwd / block.saved).write_text(block.code)
            if block.language == "sh":
                for line in block.commands():
                    self.command(line)
            elif block.language == "console":
                self._console(block.code)
            elif block.language == "python":
                self._python(block.code)
            elif block.language == "toml":
                self._world(block.code, grows="/tutorials/" in block.page)
            elif block.language == "json":
                for line in block.code.splitlines():
                    json.loads(line)
        except (AssertionError, ValueError) as error:
            raise AssertionError(f"{block.page}:{block.line}: {error}") from None

    def _console(self, code: str) -> None:
        """Commands behind ``$``, each followed by what it prints; what stands before the first is printed by a block before."""
        _, *commands = re.split(r"^\$ ", code, flags=re.MULTILINE)
        for text in commands:
            line, _, promised = text.partition("\n")
            printed = self.command(line)
            assert promised in printed, f"{line}\nprinted\n{printed}\ninstead of\n{promised}"

    def command(self, line: str) -> str:
        """Do a line of a shell and give what it printed."""
        for documented, real in self._ports.items():
            line = line.replace(f":{documented}", f":{real}").replace(f"-p {documented}", f"-p {real}")
        words = shlex.split(line, comments=True)
        program = Path(words[0]).name
        if program == "cd":
            self._cwd /= words[1]
        elif program == "export":
            name, _, value = words[1].partition("=")
            self._environment[name] = value
        elif program == "steptwin" and words[1] in ("serve", "up") and not {"--help", "--keys"} & set(words):
            self._start(words)
        else:
            if program == "steptwin" and words[1] in ("replay", "run", "export"):
                self._end("up")  # what it has recorded is written at its end
            is_alone = program == "steptwin" and not {*"|<>&;$*?"}.intersection(_QUOTED.sub("", line))
            return self._check([str(BIN / "steptwin"), *words[1:]] if is_alone else ["bash", "-c", line])
        return ""

    def _check(self, command: list[str]) -> str:
        ended = subprocess.run(
            command, cwd=self._cwd, env=self._environment, capture_output=True, text=True, timeout=LIMIT_S, check=False
        )
        output = f"{shlex.join(command)}\nexit code {ended.returncode}\n{ended.stdout[-2000:]}{ended.stderr[-2000:]}"
        assert ended.returncode == 0, output
        assert "Traceback" not in ended.stderr, output
        return ended.stdout

    def _python(self, code: str) -> None:
        for documented, real in self._ports.items():
            code = code.replace(f":{documented}", f":{real}")
        path = self._cwd / "block.py"
        path.write_text(code)
        printed = self._check([str(BIN / "python"), str(path)])
        for promised in _PROMISE.findall(code):
            assert f"{promised}\n" in printed, f"the program printed\n{printed}without\n{promised}"

    def _tests(self, together: Sequence[Block]) -> None:
        """Each block is a file named by its page and line, as a failure shows it."""
        files = []
        for block in together:
            file = self._cwd / f"test_{re.sub(r'[^a-z0-9]+', '_', block.page.lower())}_{block.line}.py"
            file.write_text(block.code if "import pytest" in block.code else f"import pytest\n{block.code}")
            files.append(str(file))
        self._check([str(BIN / "python"), "-m", "pytest", "-q", *files])

    def _world(self, text: str, *, grows: bool) -> None:
        """A description, or a part of one that is added to an example, or to what the page has so far (``grows``);
        ``machine.toml`` from then on."""
        if "[[mic488]]" not in text:
            before = self._cwd / ("machine.toml" if grows else "examples/worlds/feeder.toml")
            text = f"{before.read_text()}\n{text}"
        (self._cwd / "machine.toml").write_text(text)
        self._check([str(BIN / "steptwin"), "run", "machine.toml", "--for", "100ms"])

    def _start(self, words: list[str]) -> None:
        name = words[2] if words[1] == "serve" else "up"
        for other in {"up": ("up", "mic488"), "mic488": ("up", "mic488")}.get(name, (name,)):
            self._end(other)  # they listen on the same port
        ready = self._directory / f"{name}.json"
        options = ["--ready-file", str(ready)]
        if name != "up" and not {"--tcp", "--pty", "--serial", "--rtu-tcp", "--rfc2217"} & set(words):
            anywhere = "0.0.0.0:0" if "--listen-any" in words else "127.0.0.1:0"
            options += ["--pty", str(self._directory / "run" / name), "--tcp", anywhere]
            options += ["--rtu-tcp", anywhere] if name == "mic488" else []
        process = subprocess.Popen(
            [str(BIN / "steptwin"), *words[1:], *options],
            cwd=self._cwd,
            env=self._environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._running[name] = process
        deadline = time.monotonic() + LIMIT_S
        while not ready.exists() and process.poll() is None:
            assert time.monotonic() < deadline, f"{shlex.join(words)}: not ready after {LIMIT_S} s"
            time.sleep(0.01)
        assert process.poll() is None, f"{shlex.join(words)}\n{process.communicate()[0]}"
        for point in json.loads(ready.read_text())["end_points"]:
            documented = {"tcp": "5022" if name == "m1486" else "5020", "rtu-tcp": "5021"}.get(point["kind"])
            if documented is not None:
                self._ports[documented] = str(point["port"])
        if name == "mic488":
            self._environment["STEPTWIN_DEVICE"] = f"tcp://127.0.0.1:{self._ports['5020']}"

    def _end(self, name: str) -> None:
        process = self._running.pop(name, None)
        if process is None:
            return
        process.send_signal(signal.SIGINT)
        try:
            output = process.communicate(timeout=LIMIT_S)[0]
        except subprocess.TimeoutExpired:
            process.kill()
            output = process.communicate()[0] + "\n(killed: Ctrl-C did not end it)"
        assert process.returncode == 0, f"{shlex.join(process.args)}\n{output}"  # type: ignore[arg-type]
