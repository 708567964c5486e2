"""``steptwin state``: the state of a running twin.

From Python: `steptwin.live.remote.RemoteSubject`.
"""

from __future__ import annotations

import typer

from steptwin.cli.device import Json, Twin
from steptwin.cli.selected import print_data, selected


def command(twin: Twin = None, json: Json = False) -> None:
    """Show the state of a running twin."""
    from steptwin.subject.commands import ReadState

    with selected(twin) as there:
        name = there.one()
        found = there.do(ReadState(name))
    if json:
        print_data(found)
        return
    from steptwin.cli.state_text import lines
    from steptwin.controllerstate import read_state

    typer.echo("\n".join(lines(read_state(found), there.sheet(name))))
