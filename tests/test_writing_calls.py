"""No module of the package writes a file in another way than `steptwin.files.writing`, which replaces it as a whole."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import steptwin

PACKAGE = Path(steptwin.__file__).parent
PERMITTED = {
    "files/writing.py: replace": "the one place",
    "files/writing.py: os.open": "the file beside, and pipes and devices",
    "files/ownership.py: os.ftruncate": "a lock file has no content that could be lost",
    "live/pty.py: replace": "a symbolic link to a pseudo terminal",
    "live/pty.py: os.open": "a pseudo terminal",
    "live/studio/owntokens.py: os.open": "a file of tokens is made where there is none (O_EXCL)",
    "live/studio/owntokens.py: open": "the same",
    "files/auditfile.py: replace": "the log that is full gets another name",
}
WRITERS = {"write_bytes", "write_text"}
"""Methods of paths. What appends or makes a new file (modes ``a`` and ``x``) overwrites nothing."""
OF_LIBRARIES = {"savefig", "ParquetWriter", "to_parquet", "to_csv", "tofile"}
"""They get an open file, ``file``, not its path."""
OVERWRITING = {"O_WRONLY", "O_RDWR", "O_TRUNC", "WRITE_FLAGS", "PIPE_FLAGS"}
OF_MODULES = {
    "os": {"replace", "rename", "renames", "truncate", "ftruncate"},
    "shutil": {"copy", "copy2", "copyfile", "copytree", "move"},
    "tempfile": {"NamedTemporaryFile", "mkstemp"},
}


NAMES = {"replace", "rename", "open", "fdopen", *WRITERS, *OF_LIBRARIES}.union(*OF_MODULES.values())
MAY_WRITE = re.compile(rf"\b(?:{'|'.join(NAMES)})\s*\(")
"""Modules without it need not be parsed."""


def writing_calls(text: str) -> Iterator[str]:
    """What writes files in a module."""
    if not MAY_WRITE.search(text):
        return
    for call in ast.walk(ast.parse(text)):
        if isinstance(call, ast.Call) and (found := _writing(call)):
            yield found


def _writing(call: ast.Call) -> str:
    of = call.func
    last = of.attr if isinstance(of, ast.Attribute) else of.id if isinstance(of, ast.Name) else ""
    owner = of.value.id if isinstance(of, ast.Attribute) and isinstance(of.value, ast.Name) else ""
    if last in OF_MODULES.get(owner, set()):
        return f"{owner}.{last}"
    if (owner, last) == ("os", "open"):
        flags = set(ast.unparse(call.args[1]).replace("os.", "").split(" | "))
        return "os.open" if flags & OVERWRITING and "O_APPEND" not in flags else ""
    if last in OF_LIBRARIES:
        return last if ast.unparse(call.args[0]) != "file" else ""
    if last in WRITERS and isinstance(of, ast.Attribute):
        return last
    if last in {"replace", "rename"} and isinstance(of, ast.Attribute) and len(call.args) == 1 and not call.keywords:
        return last  # that of a text takes two arguments
    if last in {"open", "fdopen"}:
        modes = [*call.args, *(key.value for key in call.keywords if key.arg == "mode")]
        texts = [one.value for one in modes if isinstance(one, ast.Constant) and isinstance(one.value, str)]
        return "open" if any(set(text) <= set("rwxabt+") and set(text) & set("w+") for text in texts) else ""
    return ""


def test_every_module_writes_through_one_function() -> None:
    found = {
        f"{path.relative_to(PACKAGE).as_posix()}: {call}"
        for path in PACKAGE.rglob("*.py")
        for call in writing_calls(path.read_text("utf-8"))
    }
    assert found - {"files/writing.py: open"} == set(PERMITTED)


@pytest.mark.parametrize(
    "text",
    [
        "path.write_bytes(data)",
        "(folder / name).write_text(text)",
        'path.open("w")',
        'open(path, mode="wb")',
        'path.open("r+b")',
        "os.open(path, os.O_WRONLY | os.O_CREAT)",
        "path.replace(other)",
        "os.replace(one, other)",
        "figure.savefig(path, format='png')",
        "shutil.copyfile(one, other)",
    ],
)
def test_a_call_that_writes_is_found(text: str) -> None:
    assert len(list(writing_calls(text))) == 1


@pytest.mark.parametrize("text", ['path.open("a")', 'path.open("rb")', 'text.replace("w", "r")', "write_bytes(path, data)"])
def test_other_calls_are_none(text: str) -> None:
    assert list(writing_calls(text)) == []
