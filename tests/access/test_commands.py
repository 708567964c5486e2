"""What commands need, by role."""

from __future__ import annotations

import pytest

from steptwin.access.commands import PERMITS
from steptwin.access.roles import ROLES, Role
from steptwin.subject.commands import COMMANDS


def test_every_command_has_a_permit() -> None:
    assert set(PERMITS) == set(COMMANDS)


def test_everybody_may_stop_without_control() -> None:
    assert PERMITS["stop"] == (Role.VIEWER, False)


LOOKING = ["describe", "read", "pins", "state", "encoders", "faults", "time", "end_points", "subscribe", "unsubscribe"]


@pytest.mark.parametrize("name", LOOKING)
def test_looking_needs_nothing(name: str) -> None:
    assert PERMITS[name] == (Role.VIEWER, False)


@pytest.mark.parametrize("name", ["move", "jog", "home", "enable", "write", "set", "program", "resume"])
def test_acting_needs_an_operator_who_holds_control(name: str) -> None:
    assert PERMITS[name] == (Role.OPERATOR, True)


@pytest.mark.parametrize("name", ["send", "request", "power_cycle", "fault", "clear_fault", "save"])
def test_what_reaches_below_needs_an_engineer(name: str) -> None:
    assert PERMITS[name] == (Role.ENGINEER, True)


def test_roles_are_in_order() -> None:
    assert sorted(ROLES.values()) == [ROLES["viewer"], ROLES["operator"], ROLES["engineer"]]
