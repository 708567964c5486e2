"""Options of commands, declared beside the code that takes them.

A group is a frozen dataclass whose fields are ``name: Annotated[type, Option(...)] = default``. `steptwin.cli.optiongroups` makes
options of the shell of it; a Python program gives the group itself.
"""

from __future__ import annotations

from dataclasses import Field, fields
from typing import Any, ClassVar, NamedTuple

from steptwin.errors import Misuse


class Option(NamedTuple):
    """The text of an option in the shell.

    A ``tuple[str, ...]`` is repeatable; a ``bool`` that is False by default has no ``--no-…``.
    """

    help: str
    metavar: str | None = None
    flags: tuple[str, ...] = ()
    """Its names; without any, that of the field."""
    completion: str | None = None
    """The function of `steptwin.cli.completion` that proposes values."""
    is_written: bool = False
    """Whether it names a file that the command writes."""


class OptionGroup:
    """Base of the groups. A field whose option is a word of Python, such as ``--from``, ends in ``_``."""

    heading: ClassVar[str] = "Options"
    """Title of its section in the help of a command."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def given(self) -> dict[str, Any]:
        """The values of the fields that have another value than their default."""
        return {field.name: value for field in fields(self) if (value := getattr(self, field.name)) != field.default}

    def refuse(self, what: str) -> None:
        """Raises `Misuse` if an option has been given, because the options do not apply to ``what``."""
        for name in self.given():
            raise Misuse(f"{option_of(name)} is not for {what}")


def option_of(name: str) -> str:
    """``start_stop`` → ``--start-stop``."""
    return f"--{name.strip('_').replace('_', '-')}"
