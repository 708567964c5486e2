"""A serial port over the network: TCP whose clients may set rate and parity (RFC 2217)."""

from __future__ import annotations

from dataclasses import replace

from steptwin.live.rfc2217 import over_network
from steptwin.live.transports.contract import LinkArguments, OpenLink, Transport
from steptwin.live.transports.tcp import listen


async def _open(opening: LinkArguments) -> OpenLink:
    return await listen(replace(opening, make_port=lambda: over_network(opening.make_port(), opening.line)))


RFC2217 = Transport(kind="rfc2217", is_address=True, has_several=True, open=_open)
