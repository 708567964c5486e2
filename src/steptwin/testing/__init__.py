"""For tests of programs that drive a MIC488 or an M1486: the pytest plugin's fixtures give these rigs.

def test_homing(mic488: Mic488Rig) -> None:
    mic488.driver.enable(1)
    mic488.driver.axis(1).home(-10.0)
    mic488.driver.axis(1).wait()
    assert mic488.axis(1).position == 0.0
"""

from __future__ import annotations

from steptwin.testing.m1486 import M1486Rig
from steptwin.testing.mic488 import Mic488Rig, TwinAxis
from steptwin.testing.rig import FaultSeen, TwinEvent
from steptwin.testing.world import WorldAxis, WorldRig

__all__ = ["FaultSeen", "M1486Rig", "Mic488Rig", "TwinAxis", "TwinEvent", "WorldAxis", "WorldRig"]
