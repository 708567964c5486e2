"""Options of ``steptwin studio``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from steptwin.access.roles import Role


@dataclass(frozen=True, slots=True, kw_only=True)
class StudioOptions:
    """The command's own options as given; see ``steptwin studio --help``."""

    http: str | None = None
    remote: bool = False
    """Whether others may reach it without TLS."""
    certificate: Path | None = None
    key: Path | None = None
    tokens: Path | None = None
    open_to_local_users: bool = False
    """Whether no token is asked for, at an address of this computer."""
    audit: Path | None = None
    browser: bool = True
    devices: Sequence[str] = ()
    """Addresses of devices. With them there is no demo machine."""
    view: bool = False
    """Whether a session is shown as it was, and everybody has the role viewer."""
    is_demo: bool = False
    """Whether no file of the user is behind it: only what reaches a device needs a token."""

    @property
    def highest(self) -> Role:
        """No viewer has a higher role."""
        return Role.VIEWER if self.view else Role.ENGINEER
