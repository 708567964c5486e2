"""The frames of lines as a capture file: pcapng (IETF draft-ietf-opsawg-pcapng), little endian, moments in ns of virtual time.

Modbus TCP is put into IPv4 and TCP packets at port 502, so that Wireshark decodes it at once. What went over a serial line is
kept as it was, with its checksum, as a capture of an RTAC (link type 250); its protocol is chosen in Wireshark.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from struct import pack
from typing import NamedTuple

from steptwin.controller import MICROSECOND, SECOND, Nanos

RAW_IP = 101
RTAC_SERIAL = 250
MODBUS_PORT = 502
_FIRST_CLIENT_PORT = 50_000
_SERVER = bytes([127, 0, 0, 1])
_CLIENT = bytes([127, 0, 0, 2])
_IP_AND_TCP = 40
_TRANSMITTED, _RECEIVED = 3, 4
"""Events of an RTAC capture: the end of data from the master, and from the slave. A record has the moment at which a frame was
whole; with line timing its first character came earlier."""
_TCP, _SERIAL = 0, 1
"""Numbers of the interfaces."""


class CapturedFrame(NamedTuple):
    """A frame of a line between a client and its units."""

    time: Nanos
    line: str
    client: str
    is_request: bool
    data: bytes


def capture(frames: Iterable[CapturedFrame]) -> Iterator[bytes]:
    """The blocks of a capture file; without frames it is complete, too. Empty frames are left out."""
    yield _block(0x0A0D0D0A, pack("<IHHq", 0x1A2B3C4D, 1, 0, -1))
    yield _interface(RAW_IP, b"Modbus TCP")
    yield _interface(RTAC_SERIAL, b"serial lines")
    streams: dict[str, _TcpStream] = {}
    for time, line, client, is_request, data in frames:
        if is_modbus_tcp(data):
            stream = streams.setdefault(f"{line}/{client}", _TcpStream(_FIRST_CLIENT_PORT + len(streams) % 10_000))
            yield _packet(_TCP, time, stream.packet(data, is_request=is_request))
        elif data:
            yield _packet(_SERIAL, time, _rtac(data, time, is_request=is_request))


def is_modbus_tcp(data: bytes) -> bool:
    """Whether these are the bytes of a Modbus TCP frame: protocol 0, and the length of what follows."""
    return len(data) >= 8 and data[2:4] == b"\0\0" and int.from_bytes(data[4:6], "big") == len(data) - 6


@dataclass(slots=True)
class _TcpStream:
    """A TCP connection: the port of its client, and the sequence numbers of both directions."""

    port: int
    requests: int = 1
    answers: int = 1

    def packet(self, data: bytes, *, is_request: bool) -> bytes:
        source, target = (_CLIENT, _SERVER) if is_request else (_SERVER, _CLIENT)
        ports = (self.port, MODBUS_PORT) if is_request else (MODBUS_PORT, self.port)
        numbers = (self.requests, self.answers) if is_request else (self.answers, self.requests)
        head = pack(">BBHHHBBH4s4s", 0x45, 0, _IP_AND_TCP + len(data), 0, 0, 64, 6, 0, source, target)
        head = head[:10] + pack(">H", _checksum(head)) + head[12:]
        push_and_acknowledge = 0x18
        head += pack(">HHIIBBHHH", *ports, *(n & 0xFFFF_FFFF for n in numbers), 0x50, push_and_acknowledge, 0xFFFF, 0, 0)
        if is_request:
            self.requests += len(data)
        else:
            self.answers += len(data)
        return head + data


def _rtac(data: bytes, moment: Nanos, *, is_request: bool) -> bytes:
    seconds, rest = divmod(moment, SECOND)
    return pack(">IIBBH", seconds & 0xFFFF_FFFF, rest // MICROSECOND, _TRANSMITTED if is_request else _RECEIVED, 0, 0) + data


def _checksum(head: bytes) -> int:
    total = sum(int.from_bytes(head[at : at + 2], "big") for at in range(0, len(head), 2))
    while total > 0xFFFF:
        total = (total & 0xFFFF) + (total >> 16)
    return ~total & 0xFFFF


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)


def _block(kind: int, body: bytes) -> bytes:
    length = 12 + len(_padded(body))
    return pack("<II", kind, length) + _padded(body) + pack("<I", length)


def _interface(link_type: int, name: bytes) -> bytes:
    name_option = pack("<HH", 2, len(name)) + _padded(name)
    in_nanoseconds = pack("<HHB3x", 9, 1, 9)
    return _block(1, pack("<HHI", link_type, 0, 0) + name_option + in_nanoseconds + bytes(4))


def _packet(interface: int, moment: Nanos, data: bytes) -> bytes:
    return _block(6, pack("<IIIII", interface, moment >> 32, moment & 0xFFFF_FFFF, len(data), len(data)) + data)
