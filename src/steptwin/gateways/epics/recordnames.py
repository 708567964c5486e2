"""Names of records, and the commands that have one."""

from __future__ import annotations

from collections.abc import Iterator

from steptwin.gateways.methods import CONTROLLER_METHODS, PROGRAM_METHODS, MethodRow, methods_of
from steptwin.subject.contract import ControllerDescription


def record_name(prefix: str, *path: str) -> str:
    return f"{prefix}{':'.join(path)}"


def commands_of(part: ControllerDescription) -> Iterator[tuple[tuple[str, ...], MethodRow]]:
    """The commands without arguments, by path under the controller."""
    for path, rows in (((), CONTROLLER_METHODS), (("program",), PROGRAM_METHODS)):
        for row in methods_of(part, rows, None):
            yield (*path, row.name), row
