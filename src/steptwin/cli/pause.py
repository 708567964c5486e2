"""``steptwin pause``: a running world, until 'resume'.

From Python: `steptwin.World`, which advances only on request.
"""

from __future__ import annotations

from steptwin.cli.device import Json, Twin
from steptwin.cli.selected import ask_twin
from steptwin.cli.worldtime import print_time


def command(twin: Twin = None, json: Json = False) -> None:
    """Pause a running world."""
    from steptwin.subject.commands import Pause

    print_time(ask_twin(twin, Pause()), json)
