"""A pseudo terminal, where the system has them."""

from __future__ import annotations

from pathlib import Path

from steptwin.live.ptys import pty_link
from steptwin.live.transports.contract import LinkArguments, OpenLink, Transport


async def _open(opening: LinkArguments) -> OpenLink:
    link = pty_link(opening.realtime, Path(opening.where), opening.make_port)
    path = str(await link.open())
    return OpenLink(link, path, {"path": path})


PTY = Transport(kind="pty", is_address=False, has_several=False, open=_open)
