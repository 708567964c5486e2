"""What comes from outside."""

from __future__ import annotations

import pytest
from world_rig import small

from steptwin.errors import Misuse
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.inputs import Bytes, Download, ExternalInput, Leave, size_of


@pytest.mark.parametrize(
    ("what", "size"),
    [(Bytes("bus", "p", "tcp", b"12"), 2), (Download("m", "P", "abc"), 3), (Leave("bus", "p"), 0), (do.Press("go"), 0)],
)
def test_how_much_a_program_outside_has_given(what: ExternalInput, size: int) -> None:
    assert size_of(what) == size


def test_what_only_scripts_can_do_does_not_come_from_outside() -> None:
    with pytest.raises(Misuse, match="only scripts can execute this step"):
        small().perform(do.Wait(1))
