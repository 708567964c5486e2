"""Roles, and the rights that commands require."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple


class Role(IntEnum):
    """A higher role may do what a lower one may."""

    VIEWER = 1
    """May view and stop."""
    OPERATOR = 2
    """Moves axes, sets inputs, starts and stops programs, changes the pace of time."""
    ENGINEER = 3
    """Also writes programs and files, sends raw requests, switches faults and power."""

    @property
    def title(self) -> str:
        return self.name.lower()


ROLES = {role.title: role for role in Role}


class Permit(NamedTuple):
    """The rights that a command requires: a role, and whether the client must hold control."""

    role: Role
    control: bool = False


LOOK = Permit(Role.VIEWER)
"""Changes nothing; also a stop, which everybody may give at any time."""
ACT = Permit(Role.OPERATOR, control=True)
"""Changes something that can be seen at the machine."""
TAKE = Permit(Role.OPERATOR)
"""Takes control, which cannot need it."""
KEEP = Permit(Role.OPERATOR)
"""Writes a file for later, and changes nothing at the machine."""
SERVICE = Permit(Role.ENGINEER, control=True)
"""Reaches below the commands of an operator, or outside of the subject."""
