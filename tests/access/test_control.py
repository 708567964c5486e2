"""Who holds control, and what commands need of whoever gives them."""

from __future__ import annotations

import pytest

from steptwin.access.control import Control, Viewer, check
from steptwin.access.roles import ACT, LOOK, SERVICE, Role
from steptwin.errors import Refusal

ANNA = Viewer(1, "Anna", Role.ENGINEER)
PIOTR = Viewer(2, "Piotr", Role.OPERATOR)
GUEST = Viewer(3, "guest", Role.VIEWER)


def test_one_holds_control_and_another_takes_it_only_by_saying_so() -> None:
    control = Control()
    assert control.take(ANNA, over=False) == (None, ANNA)
    with pytest.raises(Refusal, match=r"Anna \(viewer 1\) holds control: take it over first"):
        control.take(PIOTR, over=False)
    assert control.take(PIOTR, over=True) == (ANNA, PIOTR)
    assert control.release(ANNA) == (PIOTR, PIOTR)
    assert control.release(PIOTR) == (PIOTR, None)


def test_viewers_of_one_name_are_others() -> None:
    control = Control()
    control.take(ANNA, over=False)
    with pytest.raises(Refusal):
        control.take(Viewer(9, "Anna", Role.ENGINEER), over=False)


def test_what_commands_need() -> None:
    control = Control()
    assert check("read", LOOK, GUEST, control) is False
    assert check("move", ACT, PIOTR, control) is True
    control.take(PIOTR, over=False)
    assert check("move", ACT, PIOTR, control) is False
    assert check("stop", LOOK, GUEST, control) is False
    with pytest.raises(Refusal, match="move needs control, which Piotr"):
        check("move", ACT, ANNA, control)
    with pytest.raises(Refusal, match="move is for the role operator; guest has the role viewer"):
        check("move", ACT, GUEST, control)
    with pytest.raises(Refusal, match="save is for the role engineer"):
        check("save", SERVICE, PIOTR, control)
