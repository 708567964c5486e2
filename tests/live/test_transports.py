"""Every key of ``[[line]]`` that opens it is opened by its transport: one table, which is complete."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from steptwin.errors import LineFailure, Misuse
from steptwin.live import ptys
from steptwin.live.clients import Clients
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.rfc2217 import TwinLine
from steptwin.live.transports import TRANSPORTS, LinkArguments, OpenLink
from steptwin.mic488.device import Mic488Device
from steptwin.simulation.kinds.links import LINK_KEYS
from steptwin.simulation.kinds.registry import line_kinds
from steptwin.wire.slave import RtuSlavePort

Run = Callable[..., Any]
Make = Callable[[], tuple[RealTimeDriver, Mic488Device]]

INPUTS = bytes.fromhex("010213880008FD62")
INPUTS_ANSWER = bytes.fromhex("01020100A188")
PLAIN = [key for key, transport in TRANSPORTS.items() if transport.is_address and key != "tls_tcp"]
"""Those that listen; the encrypted one has tests of its own (`test_tls`)."""
SET_BAUD = bytes((255, 251, 44, 255, 250, 44, 1, 0, 0, 0x25, 0x80, 255, 240))  # RFC 2217: WILL COM-PORT-OPTION, 9600 bit/s


def opened(run: Run, make_realtime: Make, key: str, where: str, play: Callable[[OpenLink], Any], **changes: Any) -> Any:
    async def scene() -> Any:
        realtime, device = make_realtime()
        opening = LinkArguments(
            where=where, make_port=lambda: RtuSlavePort({1: device}), line=TwinLine(), realtime=realtime, clients=Clients()
        )
        found = await TRANSPORTS[key].open(replace(opening, **changes))
        try:
            return await play(found)
        finally:
            await found.link.close()
            realtime.close()

    return run(scene())


async def asked(found: OpenLink, request: bytes, count: int) -> bytes:
    host, _, port = found.place.rpartition(":")
    reader, writer = await asyncio.open_connection(host, int(port))
    writer.write(request)
    answer = await reader.readexactly(count)
    writer.close()
    return answer


def test_there_is_one_for_every_key_and_lines_name_no_others() -> None:
    assert set(TRANSPORTS) == set(LINK_KEYS)
    assert {key for kind in line_kinds().values() for key in kind.links} <= set(TRANSPORTS)
    assert len({transport.kind for transport in TRANSPORTS.values()}) == len(TRANSPORTS)


@pytest.mark.parametrize("key", PLAIN)
def test_those_that_listen_say_where_and_answer_there(run: Run, make_realtime: Make, key: str) -> None:
    async def play(found: OpenLink) -> tuple[str, dict[str, Any], bytes]:
        return found.place, dict(found.details), await asked(found, INPUTS, len(INPUTS_ANSWER))

    place, details, answer = opened(run, make_realtime, key, "127.0.0.1:0", play)
    assert place == f"127.0.0.1:{details['port']}"
    assert answer == INPUTS_ANSWER


@pytest.mark.parametrize("key", PLAIN)
def test_those_that_listen_need_permission_for_other_networks(run: Run, make_realtime: Make, key: str) -> None:
    async def play(found: OpenLink) -> str:
        return found.place

    with pytest.raises(Misuse, match="is not a loopback address"):
        opened(run, make_realtime, key, "0.0.0.0:0", play)
    assert opened(run, make_realtime, key, "0.0.0.0:0", play, listen_any=True).startswith("0.0.0.0:")


def test_settings_of_a_network_serial_port_are_compared_with_the_line(run: Run, make_realtime: Make) -> None:
    notices: list[str] = []

    async def play(found: OpenLink) -> None:
        await asked(found, SET_BAUD + INPUTS, 3 + 9 + len(INPUTS_ANSWER))

    opened(run, make_realtime, "rfc2217", "127.0.0.1:0", play, line=TwinLine(lambda: 38400, False, notices.append))
    assert [notice.partition(":")[2] for notice in notices] == [
        " 9600 bit/s 8N1 is set by its client, the line has 38400 bit/s 8N1: served all the same, as line timing is off"
    ]


def test_a_pseudo_terminal_is_a_path(run: Run, make_realtime: Make, tmp_path: Path) -> None:
    path = tmp_path / "line"

    async def play(found: OpenLink) -> tuple[str, object, bool]:
        return found.place, found.details, path.is_symlink()

    assert opened(run, make_realtime, "pty", str(path), play) == (str(path), {"path": str(path)}, True)


def test_a_system_without_pseudo_terminals(
    run: Run, make_realtime: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ptys, "HAS_PTYS", False)

    async def play(found: OpenLink) -> None: ...

    with pytest.raises(Misuse, match=r"they exist on Linux and macOS only; use TCP, RTU over TCP or a network serial port"):
        opened(run, make_realtime, "pty", str(tmp_path / "line"), play)


def test_a_serial_port_has_the_rate_of_its_line(run: Run, make_realtime: Make) -> None:
    async def play(found: OpenLink) -> None: ...

    with pytest.raises(LineFailure, match="cannot open serial port /dev/none at 4800 bit/s"):
        opened(run, make_realtime, "serial", "/dev/none", play, line=TwinLine(lambda: 4800))
