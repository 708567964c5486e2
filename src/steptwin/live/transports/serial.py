"""A real serial port. serialx is imported when one is opened."""

from __future__ import annotations

from steptwin.live.transports.contract import LinkArguments, OpenLink, Transport


async def _open(opening: LinkArguments) -> OpenLink:
    from steptwin.live.serialport import SerialLink

    device, baud = opening.where, opening.line.baud()
    link = SerialLink(opening.realtime, device, baud, opening.make_port, opening.line.notice)
    await link.open()
    return OpenLink(link, f"{device} at {baud} bit/s", {"device": device, "baud": baud})


SERIAL = Transport(kind="serial", is_address=False, has_several=False, open=_open)
