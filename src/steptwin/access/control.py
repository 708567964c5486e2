"""Control of a subject, which at most one viewer holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from steptwin.access.roles import Permit, Role
from steptwin.errors import Refusal
from steptwin.messages import Message


@dataclass(frozen=True, slots=True)
class Viewer:
    """A connected client, or a client of REST. ``number`` is never reused."""

    number: int
    name: str
    role: Role

    def __str__(self) -> str:
        place = f"viewer {self.number}"
        return place if self.name == place else f"{self.name} ({place})"


class ControlChange(NamedTuple):
    """The holder of control before and after a change."""

    before: Viewer | None
    after: Viewer | None


CONTROL_IS_HELD = Message("access.control-is-held", "{holder} holds control: take it over first")


class Control:
    """The control of a subject; ``holder`` is None if it is free."""

    def __init__(self) -> None:
        self.holder: Viewer | None = None

    def take(self, viewer: Viewer, *, over: bool) -> ControlChange:
        """Give control to ``viewer``. Raises `Refusal` if another viewer holds it, unless ``over``."""
        before = self.holder
        if before is not None and before.number != viewer.number and not over:
            raise Refusal(CONTROL_IS_HELD(holder=before))
        self.holder = viewer
        return ControlChange(before, viewer)

    def release(self, viewer: Viewer) -> ControlChange:
        """Release control, if ``viewer`` holds it."""
        before = self.holder
        if before is not None and before.number == viewer.number:
            self.holder = None
        return ControlChange(before, self.holder)


NEEDS_A_HIGHER_ROLE = Message("access.needs-a-higher-role", "{request} is for the role {role}; {viewer} has the role {own_role}")
NEEDS_CONTROL = Message("access.needs-control", "{request} needs control, which {holder} holds: take it over first")


def check(name: str, permit: Permit, viewer: Viewer, control: Control) -> bool:
    """Whether ``viewer`` must first take control, which is free, to execute the command ``name``.

    Raises `Refusal` if the role is insufficient, or another viewer holds control.
    """
    if viewer.role < permit.role:
        raise Refusal(NEEDS_A_HIGHER_ROLE(request=name, role=permit.role.title, viewer=viewer.name, own_role=viewer.role.title))
    holder = control.holder
    if not permit.control or (holder is not None and holder.number == viewer.number):
        return False
    if holder is not None:
        raise Refusal(NEEDS_CONTROL(request=name, holder=holder))
    return True
