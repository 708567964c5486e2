"""TCP: Modbus TCP, RTU over TCP, raw characters, records of vision systems."""

from __future__ import annotations

from steptwin.live.tcp import TcpLink
from steptwin.live.transports.contract import LinkArguments, OpenLink, Transport
from steptwin.simulation.toml.addresses import parse_address


async def listen(opening: LinkArguments) -> OpenLink:
    address = parse_address(opening.where, listen_any=opening.listen_any)
    link = TcpLink(opening.realtime, address, opening.make_port, opening.clients)
    listening = await link.open()
    return OpenLink(link, str(listening), {"host": listening.host, "port": listening.port})


def over_tcp(kind: str) -> Transport:
    """Bytes of every client are those of the line."""
    return Transport(kind=kind, is_address=True, has_several=True, open=listen)


TCP = over_tcp("tcp")
RTU_TCP = over_tcp("rtu-tcp")
VISION = over_tcp("vision")
