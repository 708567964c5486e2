"""Options of ``steptwin studio``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from steptwin.access.roles import Role
from steptwin.options import Option, OptionGroup

_NAMED = re.compile(r"([A-Za-z_][A-Za-z0-9_-]*)=(.*)")


@dataclass(frozen=True, kw_only=True)
class StudioOptions(OptionGroup):
    """The page and its service."""

    heading = "Options of the page"

    http: Annotated[
        str | None, Option("Address of the page. Default: 127.0.0.1:8488, or the next free port.", metavar="HOST:PORT")
    ] = None
    remote: Annotated[bool, Option("Permit an --http address that others can reach, without TLS; with tokens.")] = False
    certificate: Annotated[Path | None, Option("TLS: the certificate (PEM).", metavar="FILE")] = None
    key: Annotated[Path | None, Option("TLS: its key (PEM).", metavar="FILE")] = None
    tokens: Annotated[
        Path | None,
        Option(
            "Lines ROLE NAME TOKEN; roles are viewer, operator, engineer. Nobody else may read it. "
            "Default: a file of this user, made by the first studio.",
            metavar="FILE",
        ),
    ] = None
    open_to_local_users: Annotated[bool, Option("Ask for no token: every user of this computer is engineer.")] = False
    audit: Annotated[
        Path | None, Option("Append every command and its user to a file of JSON lines.", metavar="FILE", is_written=True)
    ] = None
    device: Annotated[
        tuple[str, ...],
        Option(
            "A device to show, as for the other commands: /dev/ttyUSB0,unit=2, HOST:PORT, /dev/ttyUSB1,kind=m1486,chip=7. "
            "Repeatable. Without MACHINE.toml there is no world then, nor with NAME=, a controller of MACHINE.toml: devices move "
            "its picture.",
            metavar="[NAME=]DEVICE",
            flags=("--device", "-d"),
            completion="devices",
        ),
    ] = ()
    view: Annotated[bool, Option("Show a recording as it was: paused at its end, and nothing can be changed.")] = False
    browser: Annotated[bool, Option("Open the page where there is a desktop.")] = True
    is_demo: bool = False
    """Whether no file of the user is behind it: only what reaches a device needs a token."""

    @property
    def devices(self) -> tuple[tuple[str | None, str], ...]:
        """The name that each is given, and its address."""
        found = (_NAMED.fullmatch(text) for text in self.device)
        return tuple((None, text) if one is None else (one[1], one[2]) for one, text in zip(found, self.device, strict=True))

    @property
    def has_no_world(self) -> bool:
        """Whether devices take the places of controllers that are described."""
        return any(name is not None for name, _ in self.devices)

    @property
    def highest(self) -> Role:
        """No viewer has a higher role."""
        return Role.VIEWER if self.view else Role.ENGINEER
