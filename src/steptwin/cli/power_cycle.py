"""``steptwin power-cycle``: the power of a running twin.

From Python: `steptwin.live.remote.RemoteSubject`.
"""

from __future__ import annotations

from steptwin.cli.device import Twin
from steptwin.cli.selected import selected


def command(twin: Twin = None) -> None:
    """Switch a running twin off and on again."""
    from steptwin.simulation.script.steps import PowerCycle

    with selected(twin) as there:
        for controller in there.shown:
            there.do(PowerCycle(controller))
