"""Print and save the descriptions of worlds that commands make from their options."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from steptwin.errors import Misuse
from steptwin.files.textfiles import check_folder, write_bytes
from steptwin.files.writing import is_written_directly
from steptwin.inputfiles import read_bytes
from steptwin.simulation.describe.description import read_world

Named: TypeAlias = Callable[[Path], str]
"""The name of a file in a description."""
DescribeNamed: TypeAlias = Callable[[Named], str]


def print_world(text: str, name: str) -> None:
    """Print the description, and to standard error the files it needs from outside this folder."""
    sys.stdout.write(text)
    folder = Path.cwd().resolve()
    for file, _ in read_world(name, text).files():
        if not (folder / file).resolve().is_relative_to(folder):
            sys.stderr.write(f"{file} is outside this folder: --save-world FILE copies it, 'up --allow-outside' reads it\n")


def save_world(describe: DescribeNamed, where: Path) -> None:
    """Write the description to a file, and copy the files it names beside it. Raises `Misuse` if another file is in the way."""
    if is_written_directly(where):
        raise Misuse(
            f"--save-world {where}: not a regular file, beside which others can lie; --print-world prints the description"
        )
    check_folder(where)
    name = str(where)
    given, text = describe(str), describe(lambda path: path.name)
    copies: dict[Path, Path] = {}
    for (own, _), (copied, _) in zip(read_world(name, given).files(), read_world(name, text).files(), strict=True):
        source, target = Path(own), where.parent / copied
        content = read_bytes(source)
        if copies.get(target, source) != source or (target.exists() and read_bytes(target) != content):
            raise Misuse(f"--save-world {where}: {target} is another file than {source}: choose another folder")
        copies[target] = source
    for target, source in copies.items():
        if not target.exists():
            write_bytes(target, read_bytes(source))
            sys.stdout.write(f"wrote {target}\n")
    write_bytes(where, text.encode())
    sys.stdout.write(f"wrote {where}\n")
