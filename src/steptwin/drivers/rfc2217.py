"""serialx' network serial port, for servers that do not confirm all requests.

When it opens a port serialx sends SET-MODEMSTATE-MASK and SET-LINESTATE-MASK and waits until each is confirmed. ser2net
(seen with 4.3.11) answers the first by NOTIFY-MODEMSTATE and never confirms it, so that no port of it could be opened;
pyserial, which sends no masks, opens them. Neither mask is needed here, so they are sent without waiting.
"""

from __future__ import annotations

from serialx.platforms.serial_rfc2217 import RFC2217Serial, RFC2217SerialTransport
from serialx.platforms.serial_rfc2217.types import Rfc2217Command, SetLinestateMaskCmd, SetModemstateMaskCmd

_MASKS = (SetModemstateMaskCmd, SetLinestateMaskCmd)


class NetworkSerial(RFC2217Serial):
    """For threads."""

    def _send_and_wait(self, cmd: Rfc2217Command) -> Rfc2217Command:
        if isinstance(cmd, _MASKS):
            self._send_command(cmd)
            return cmd
        return super()._send_and_wait(cmd)


class NetworkSerialTransport(RFC2217SerialTransport):
    """For tasks."""

    async def _send_and_wait(self, cmd: Rfc2217Command) -> Rfc2217Command:
        if isinstance(cmd, _MASKS):
            self._send_command(cmd)
            return cmd
        return await super()._send_and_wait(cmd)
