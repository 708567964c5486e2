"""Who holds control of a subject: one viewer at most, or nobody."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from steptwin.access.roles import Permit, Role
from steptwin.errors import Refusal


@dataclass(frozen=True, slots=True)
class Viewer:
    """Somebody who is connected, or asks over REST. ``number`` is not used again."""

    number: int
    name: str
    role: Role

    def __str__(self) -> str:
        return f"{self.name} (viewer {self.number})"


class Taken(NamedTuple):
    """What taking control has changed."""

    before: Viewer | None
    after: Viewer | None


class Control:
    """Held by ``holder``."""

    def __init__(self) -> None:
        self.holder: Viewer | None = None

    def take(self, viewer: Viewer, *, over: bool) -> Taken:
        """``viewer`` holds it from now on; from another one only with ``over``. Raises `Refusal`."""
        before = self.holder
        if before is not None and before.number != viewer.number and not over:
            raise Refusal(f"{before} holds control: take_control with over = true takes it")
        self.holder = viewer
        return Taken(before, viewer)

    def release(self, viewer: Viewer) -> Taken:
        """``viewer`` holds it no more; nothing where it does not."""
        before = self.holder
        if before is not None and before.number == viewer.number:
            self.holder = None
        return Taken(before, self.holder)


def check(name: str, permit: Permit, viewer: Viewer, control: Control) -> bool:
    """Whether ``viewer`` has to take control, which nobody holds, to do what ``name`` is the name of.

    Raises `Refusal` where the role is too low, or another one holds control.
    """
    if viewer.role < permit.role:
        raise Refusal(f"{name} is for the role {permit.role.title}; {viewer.name} has the role {viewer.role.title}")
    holder = control.holder
    if not permit.control or (holder is not None and holder.number == viewer.number):
        return False
    if holder is not None:
        raise Refusal(f"{name} needs control, which {holder} holds: take_control with over = true takes it")
    return True
