"""What serialx has for the serial ports of Windows, for `other_system`: COM3 leads to the address in ``OTHER_SYSTEM_COM3``."""

from __future__ import annotations

import os
from dataclasses import fields
from typing import Any

from serialx.common import SerialPortInfo, register_uri_handler
from serialx.platforms.serial_socket import SocketSerial, SocketSerialTransport

PREFIX = "OTHER_SYSTEM_"


def _leads_to(port: str) -> str:
    address = os.environ.get(PREFIX + port)
    if address is None:
        raise FileNotFoundError(2, "The system cannot find the file specified")
    return f"socket://{address}"


class ComPort(SocketSerial):
    def __init__(self, path: str, *arguments: Any, **named: Any) -> None:
        super().__init__(_leads_to(path), *arguments, **named)


class ComPortTransport(SocketSerialTransport):
    async def _connect(self, *, path: str, **named: Any) -> None:
        await super()._connect(path=_leads_to(path), **named)


def ports() -> list[SerialPortInfo]:
    return [_port(name.removeprefix(PREFIX)) for name in os.environ if name.startswith(PREFIX)]


def _port(name: str) -> SerialPortInfo:
    known: dict[str, Any] = dict.fromkeys(field.name for field in fields(SerialPortInfo))
    known.update(device=name, resolved_device=name)
    return SerialPortInfo(**known)


register_uri_handler(
    scheme="device://",
    unique_scheme="windows://",
    sync_cls=ComPort,
    async_transport_cls=ComPortTransport,
    list_serial_ports_func=ports,
    strip_uri_scheme=True,
)
