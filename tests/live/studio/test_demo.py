"""The demo machine: values of its description are overridden as those of any other."""

from __future__ import annotations

import pytest

from steptwin.errors import Misuse
from steptwin.files.worldoptions import WorldRunOptions
from steptwin.live.options import UpOptions
from steptwin.live.studio.demo import demo_world


def test_values_of_the_demo_machine_can_be_overridden() -> None:
    world = demo_world(UpOptions(world=None, run=WorldRunOptions(with_=("x.start=9",))), free_ports=True)
    assert world.read("x.position") == 9.0


def test_an_override_of_nothing_is_refused() -> None:
    with pytest.raises(Misuse, match=r"override 'nosuch.thing': there is no 'nosuch'"):
        demo_world(UpOptions(world=None, run=WorldRunOptions(with_=("nosuch.thing=4",))), free_ports=True)
