"""Roots of chains that a run can be repeated without."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

from steptwin.controller import Nanos
from steptwin.simulation.world.inputs import ExternalInput


class Act(NamedTuple):
    """An action of a script; from outside if ``script`` is empty. ``order``: as that of a `steptwin.why.log.Change`. ``by``: the
    script of the description that led to it, as that which presses a button for some time releases it. ``fault``: the name that
    the fault got that it sets."""

    time: Nanos
    script: str
    what: ExternalInput
    order: int
    by: str
    fault: str = ""


class SetFault(NamedTuple):
    """A fault by its name. ``time``: not after it acted first; ``by``: the act that set it; None: its description does, or it was
    set before what is known."""

    time: Nanos
    name: str
    by: Act | None = None


class Sent(NamedTuple):
    """A request that a program outside sent from its place on a line."""

    time: Nanos
    line: str
    place: str


Root: TypeAlias = Act | SetFault | Sent
