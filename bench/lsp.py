"""The editor server as a process, in a program of 4000 lines: from a letter typed to its diagnostics, and to completions."""

from __future__ import annotations

import json
import random
import re
import subprocess
import sys
from pathlib import Path
from time import perf_counter
from typing import Any

from bench.__main__ import cpu_ns

EXAMPLES = Path(__file__).parent.parent / "examples"
LINES = 4000
CHIP_LINES = 250
"""More commands than the largest chip holds."""
TYPED = "\nspeed = count + 1"
EDITS = 20
DIAGNOSTICS_GOAL_MS = 20.0
COMPLETION_GOAL_MS = 10.0


def program() -> str:
    """The example of a machine again and again, each time with labels of its own."""
    example = (EXAMPLES / "mic488" / "pick_and_place.prg").read_text()
    labels = "|".join(re.findall(r"^([A-Z]+):", example, re.MULTILINE))
    lines = [line for line in example.splitlines() if line.startswith("#")]
    body = [line for line in example.splitlines() if not line.startswith("#")]
    while len(lines) < LINES:
        number = len(lines)
        lines += [re.sub(rf"\b({labels})\b", rf"\g<1>{number}", line) for line in body]
    return "\n".join([*lines[:LINES], ""])


def chip() -> str:
    """Moves, waits and conditions, as large as programs of the M1486 are."""
    body = [f"@{n % 70 + 1}\nF{6400 * (n % 9 + 1)}\nR\nI2H{n * 7 % 70 + 1}\nW250\nV{500 + n}" for n in range(CHIP_LINES // 6)]
    return "\n".join(["[", *body, "]", ""])


class Editor:
    """A client that knows just enough of the protocol."""

    def __init__(self, server: subprocess.Popen[bytes]) -> None:
        if server.stdin is None or server.stdout is None:
            raise RuntimeError("the server has no pipes")
        self._out, self._in = server.stdin, server.stdout
        self.process = server.pid
        self._id = 0
        self._version = 1
        self._looked_at: dict[str, int] = {}
        """The version of each text to which diagnostics came last."""
        self.request("initialize", {"processId": None, "rootUri": None, "capabilities": {}})
        self.send("initialized", {})

    def send(self, method: str, params: object, **more: object) -> None:
        body = json.dumps({"jsonrpc": "2.0", "method": method, "params": params, **more}).encode()
        self._out.write(b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
        self._out.flush()

    def receive(self) -> dict[str, Any]:
        size = 0
        while line := self._in.readline().strip():
            size = int(line.partition(b": ")[2]) if line.startswith(b"Content-Length") else size
        message = json.loads(self._in.read(size))
        if message.get("method") == "textDocument/publishDiagnostics":
            self._looked_at[message["params"]["uri"]] = message["params"]["version"]
        return message

    def request(self, method: str, params: object) -> Any:
        self._id += 1
        self.send(method, params, id=self._id)
        while (message := self.receive()).get("id") != self._id:
            pass
        return message["result"]

    def diagnostics(self, uri: str, version: int) -> None:
        """Wait for those of a version of a text."""
        while self._looked_at.get(uri) != version:
            self.receive()

    def open(self, uri: str, language: str, text: str) -> None:
        document = {"uri": uri, "languageId": language, "version": 1, "text": text}
        self.send("textDocument/didOpen", {"textDocument": document})
        self.diagnostics(uri, 1)

    def type(self, uri: str, line: int, column: int, text: str) -> int:
        self._version += 1
        place = {"line": line, "character": column}
        change = {"range": {"start": place, "end": place}, "text": text}
        document = {"uri": uri, "version": self._version}
        self.send("textDocument/didChange", {"textDocument": document, "contentChanges": [change]})
        return self._version

    def complete(self, uri: str, line: int, column: int) -> None:
        place = {"line": line, "character": column}
        self.request("textDocument/completion", {"textDocument": {"uri": uri}, "position": place})


Times = list[tuple[float, float]]
"""Milliseconds, and those of processor time."""


def measure(editor: Editor, uri: str, text: str) -> tuple[Times, Times]:
    """From each letter of a new line, somewhere, to its diagnostics, and to completions."""
    chance = random.Random(0)
    lines = text.split("\n")
    diagnostics: Times = []
    completions: Times = []
    for _ in range(EDITS):
        line = chance.randrange(len(lines) - 1)
        column = len(lines[line])
        for number, letter in enumerate(TYPED):
            begin, cpu = perf_counter(), cpu_ns(editor.process)
            version = editor.type(uri, line, column, letter)
            line, column = (line + 1, 0) if letter == "\n" else (line, column + 1)
            if number % 2:
                editor.complete(uri, line, column)
                completions.append(((perf_counter() - begin) * 1e3, (cpu_ns(editor.process) - cpu) / 1e6))
                editor.diagnostics(uri, version)
            else:
                editor.diagnostics(uri, version)
                diagnostics.append(((perf_counter() - begin) * 1e3, (cpu_ns(editor.process) - cpu) / 1e6))
        lines.insert(line, TYPED[1:])
    return diagnostics, completions


def row(name: str, times: Times, goal: float) -> None:
    p50, p95 = (tuple(sorted(kind)[len(times) * part // 100] for kind in zip(*times, strict=True)) for part in (50, 95))
    print(
        f"{name}: p50 {p50[0]:.1f} ms, p95 {p95[0]:.1f} ms (goal {goal:g} ms); of the processor {p50[1]:.1f} and {p95[1]:.1f} ms"
    )


def main() -> None:
    table = (EXAMPLES / "mic488" / "pick_and_place.csv").read_text()
    command = [sys.executable, "-m", "steptwin", "lsp"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as server:
        editor = Editor(server)
        editor.open("file:///bench.csv", "mic488-positions", table)
        for title, uri, language, text in (
            (f"WBC, {LINES} lines", "file:///bench.prg", "wbc", program()),
            (f"M1486, {CHIP_LINES} lines", "file:///bench.m1486", "m1486", chip()),
        ):
            editor.open(uri, language, text)
            diagnostics, completions = measure(editor, uri, text)
            row(f"{title}: diagnostics after a letter", diagnostics, DIAGNOSTICS_GOAL_MS)
            row(f"{title}: completions after a letter", completions, COMPLETION_GOAL_MS)
        editor.request("shutdown", None)
        editor.send("exit", None)


if __name__ == "__main__":
    main()
