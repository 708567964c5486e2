"""Modbus/TCP Security: who is admitted, and what each may ask. The clients are pymodbus', the certificates from elsewhere."""

from __future__ import annotations

import asyncio
import ssl
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from pymodbus.client import AsyncModbusTlsClient
from pymodbus.server import ModbusTlsServer
from pymodbus.simulator import DataType, SimData, SimDevice
from tests.conftest import until
from tls_files import Authority

from steptwin.access.roles import Role
from steptwin.controller import SECOND
from steptwin.drivers.blocking import finish
from steptwin.drivers.exchange import Job
from steptwin.drivers.mic488.driver import AsyncMic488
from steptwin.drivers.mic488.lines import ThreadModbusLine
from steptwin.drivers.modbus import ModbusQuery
from steptwin.errors import LineFailure, Misuse, Refusal
from steptwin.files.certificate import make_certificate
from steptwin.live.clients import Clients
from steptwin.live.rfc2217 import TwinLine
from steptwin.live.transports import TRANSPORTS, LinkArguments
from steptwin.mic488.device import Mic488Device
from steptwin.simulation.kinds.links import TlsFiles
from steptwin.wire.pdu import ReadRequest
from steptwin.wire.slave import TcpSlavePort

ILLEGAL_FUNCTION = 1


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Certificates of an authority, of which a twin trusts the clients, and of a stranger."""
    folder = tmp_path_factory.mktemp("tls")
    authority = Authority(folder)
    for name, role in (("viewer", "viewer"), ("operator", "Operator"), ("engineer", "engineer"), ("cleaner", "cleaner")):
        authority.sign(name, role=role)
    authority.sign("nobody")
    authority.sign("twin")
    authority.sign("expired", role="engineer", days=(-3, -1))
    authority.sign("future", role="engineer", days=(1, 3))
    (folder / "other").mkdir()
    Authority(folder / "other").sign("stranger", role="engineer")
    (folder / "clients").mkdir()
    (folder / "clients" / "ca.pem").write_bytes((folder / "ca.pem").read_bytes())
    return folder


def files_in(folder: Path) -> TlsFiles:
    return TlsFiles(str(folder / "twin.pem"), str(folder / "twin.key"), str(folder / "clients"))


def context_of(folder: Path, name: str | None) -> ssl.SSLContext:
    context = ssl.create_default_context(cafile=str(folder / "ca.pem"))
    if name is not None:
        context.load_cert_chain(folder / f"{name}.pem", folder / f"{name}.key")
    return context


@pytest.fixture
def audited() -> list[tuple[Any, ...]]:
    """What the audit log has been told: who, role, what, fields, outcome."""
    return []


@pytest.fixture
def served(run: Any, make_realtime: Any, folder: Path, audited: list[tuple[Any, ...]]) -> Callable[..., Any]:
    """``served(play)``: the value of ``await play(port, device)`` beside a twin whose line is encrypted, and its notices."""

    def serve(play: Callable[[int, Mic488Device], Any], files: TlsFiles | None = None, most: int = 10) -> tuple[Any, list[str]]:
        notices: list[str] = []
        audited.clear()

        async def scene() -> Any:
            realtime, device = make_realtime()
            clients = Clients(most, notices.append)
            opened = await TRANSPORTS["tls_tcp"].open(
                LinkArguments(
                    where="127.0.0.1:0",
                    make_port=lambda: TcpSlavePort({1: device}),
                    line=TwinLine(),
                    realtime=realtime,
                    clients=clients,
                    tls=files or files_in(folder),
                    audit=lambda who, do, fields, outcome: audited.append((str(who), who.role, do, dict(fields), outcome)),
                    line_name="bus",
                )
            )
            try:
                return await play(int(str(opened.details["port"])), device)
            finally:
                await opened.link.close()
                realtime.close()
                assert not clients.present

        return run(scene()), notices

    return serve


async def asked_with(context: ssl.SSLContext, port: int) -> tuple[list[int] | int, int | None]:
    """What pymodbus reads, and the exception that it gets for a write."""
    client = AsyncModbusTlsClient("127.0.0.1", port=port, sslctx=context, retries=0)
    assert await client.connect()
    read = await client.read_holding_registers(0, count=2, device_id=1)
    written = await client.write_register(0, 7, device_id=1)
    client.close()
    return read.exception_code if read.isError() else list(read.registers), written.exception_code if written.isError() else None


@pytest.mark.parametrize(
    ("name", "expected", "value"),
    [
        ("viewer", ([0, 0], ILLEGAL_FUNCTION), 0),
        ("operator", ([0, 0], None), 7),
        ("engineer", ([0, 0], None), 7),
        ("nobody", (ILLEGAL_FUNCTION, ILLEGAL_FUNCTION), 0),
        ("cleaner", (ILLEGAL_FUNCTION, ILLEGAL_FUNCTION), 0),
    ],
)
def test_a_role_permits_requests(served: Any, folder: Path, name: str, expected: Any, value: int) -> None:
    async def play(port: int, device: Mic488Device) -> tuple[Any, bytes]:
        return await asked_with(context_of(folder, name), port), device.execute(bytes.fromhex("0300000001"), device.now)

    (seen, after), notices = served(play)
    assert (seen, after[-1]) == (expected, value)
    assert [f"client {name} (" in notice for notice in notices] == [True] * sum(code == 1 for code in expected)


@pytest.mark.parametrize(
    ("name", "role", "outcome"),
    [("operator", Role.OPERATOR, "done"), ("viewer", Role.VIEWER, "refusal"), ("nobody", None, "refusal")],
)
def test_writes_are_in_the_audit_log(
    served: Any, folder: Path, audited: list[tuple[Any, ...]], name: str, role: Role | None, outcome: str
) -> None:
    async def play(port: int, device: Mic488Device) -> None:
        await asked_with(context_of(folder, name), port)

    served(play)
    writes = [entry for entry in audited if entry[3]["pdu"] == "0600000007"]
    assert [(one[1:]) for one in writes] == [(role, "request", {"line": "bus", "unit": 1, "pdu": "0600000007"}, outcome)]
    assert writes[0][0].startswith(f"{name} (")
    assert ", 127.0.0.1:" in writes[0][0]
    assert len(audited) == (2 if role is None else 1)  # who has no role may not even read


def test_requests_that_come_together_are_answered_in_their_order(served: Any, folder: Path) -> None:
    """A read, a write and a read of a viewer, the last with the bytes in two records."""

    async def play(port: int, device: Mic488Device) -> bytes:
        reader, writer = await asyncio.open_connection("127.0.0.1", port, ssl=context_of(folder, "viewer"))
        frames = "000100000006010300000001" + "000200000006010600000005" + "000300000006010300"
        writer.write(bytes.fromhex(frames))
        await writer.drain()
        writer.write(bytes.fromhex("000001"))
        answer = await reader.readexactly(11 + 9 + 11)
        writer.close()
        return answer

    answer, _ = served(play)
    assert answer.hex() == "0001000000050103020000" + "000200000003018601" + "0003000000050103020000"


@pytest.mark.parametrize(("name", "alert"), [("expired", "CERTIFICATE_EXPIRED"), ("other/stranger", "UNKNOWN_CA")])
@pytest.mark.parametrize("version", [ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3])
def test_who_is_not_admitted_is_told_why(served: Any, folder: Path, name: str, alert: str, version: ssl.TLSVersion) -> None:
    """By an alert of TLS. With TLS 1.3 it comes after the end of the client's own handshake."""

    async def play(port: int, device: Mic488Device) -> str:
        context = context_of(folder, name)
        context.minimum_version = context.maximum_version = version
        try:
            reader, writer = await asyncio.open_connection("127.0.0.1", port, ssl=context)
            await reader.read(1)
            writer.close()
        except ssl.SSLError as error:
            return str(error)
        return "no alert"

    told, _ = served(play)
    assert f"ALERT_{alert}" in told


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("expired", "certificate has expired"),
        ("future", "certificate is not yet valid"),
        ("other/stranger", "unable to get local issuer certificate"),
        (None, "peer did not return a certificate"),
    ],
)
@pytest.mark.parametrize("version", [ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3])
def test_who_is_not_admitted(served: Any, folder: Path, name: str | None, why: str, version: ssl.TLSVersion) -> None:
    async def play(port: int, device: Mic488Device) -> bytes:
        context = context_of(folder, name)
        context.minimum_version = context.maximum_version = version
        try:  # with TLS 1.3 the handshake of the client is over before the server has looked
            reader, writer = await asyncio.open_connection("127.0.0.1", port, ssl=context)
            writer.write(bytes.fromhex("000100000006010300000001"))
            answer = await reader.read(100)
            writer.close()
        except OSError:
            return b""
        return answer

    answer, notices = served(play)
    assert answer == b""
    assert len(notices) == 1
    assert why in notices[0]


def test_old_versions_are_refused(served: Any, folder: Path) -> None:
    async def play(port: int, device: Mic488Device) -> None:
        context = context_of(folder, "engineer")
        context.set_ciphers("ALL:@SECLEVEL=0")
        with pytest.warns(DeprecationWarning, match="TLSv1_1"):
            context.minimum_version = context.maximum_version = ssl.TLSVersion.TLSv1_1
        with pytest.raises(ssl.SSLError, match="ALERT_PROTOCOL_VERSION"):
            await asyncio.open_connection("127.0.0.1", port, ssl=context)

    _, notices = served(play)
    assert ["not admitted: unsupported protocol" in notice for notice in notices] == [True]


def test_a_client_that_says_nothing_is_let_go(served: Any) -> None:
    async def play(port: int, device: Mic488Device) -> bytes:
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        answer = await reader.read(1)
        writer.close()
        return answer

    answer, notices = served(play)
    assert answer == b""
    assert ["ssl handshake is taking longer than 10.0 seconds" in notice for notice in notices] == [True]


def test_clients_in_the_handshake_count_too(served: Any, folder: Path) -> None:
    async def play(port: int, device: Mic488Device) -> None:
        _, waiting = await asyncio.open_connection("127.0.0.1", port)
        with pytest.raises(ConnectionError):
            await asyncio.open_connection("127.0.0.1", port, ssl=context_of(folder, "viewer"))
        waiting.close()

    _, notices = served(play, most=1)
    assert "more than 1 clients at once are turned away" in notices


def test_certificates_that_the_command_makes_and_nobody_signs_for_another(served: Any, folder: Path, tmp_path: Path) -> None:
    """The owner of a viewer's certificate cannot issue one for an engineer."""
    own, key = make_certificate(tmp_path / "own", [], 2)
    viewer, viewers_key = make_certificate(tmp_path / "viewer", [], 2, role="viewer", name="screen 3")
    (tmp_path / "clients").mkdir()
    (tmp_path / "clients" / "screen.pem").write_bytes(viewer.read_bytes())
    files = TlsFiles(str(own), str(key), str(tmp_path / "clients"))
    Authority.owner_of(tmp_path, viewer, viewers_key).sign("forged", role="engineer")

    async def play(port: int, device: Mic488Device) -> Any:
        context = ssl.create_default_context(cafile=str(own))
        context.load_cert_chain(viewer, viewers_key)
        as_viewer = await asked_with(context, port)
        chain = (tmp_path / "forged.pem").read_bytes() + viewer.read_bytes()
        (tmp_path / "chain.pem").write_bytes(chain)
        context = ssl.create_default_context(cafile=str(own))
        context.load_cert_chain(tmp_path / "chain.pem", tmp_path / "forged.key")
        reader, writer = await asyncio.open_connection("127.0.0.1", port, ssl=context)
        with pytest.raises(ssl.SSLError, match="ALERT"):
            await reader.read(1)
        writer.close()
        return as_viewer

    seen, notices = served(play, files)
    assert seen == ([0, 0], ILLEGAL_FUNCTION)
    assert notices[0].startswith("client screen 3 (viewer, 127.0.0.1:")
    assert notices[0].endswith("): a request with function 6 is refused")
    assert "not admitted: " in notices[1]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"trusted": "nothing"}, "trusted: nothing has no certificate"),
        ({"certificate": "/dev/null"}, r"/dev/null, .*twin.key: "),
        ({"key": "viewer.key"}, "viewer.key: key values mismatch"),
    ],
)
def test_files_that_cannot_be_used(served: Any, folder: Path, changes: dict[str, str], message: str) -> None:
    async def play(port: int, device: Mic488Device) -> None: ...

    if "key" in changes:
        changes = {"key": str(folder / changes["key"])}
    with pytest.raises(Misuse, match=message):
        served(play, files_in(folder)._replace(**changes))


def address(folder: Path, port: int, name: str, trusted: str = "ca.pem") -> str:
    files = f"certificate={folder / name}.pem&key={folder / name}.key&trusted={folder / trusted}"
    return f"tls://127.0.0.1:{port}?{files}"


def test_a_driver_at_an_encrypted_twin(served: Any, folder: Path) -> None:
    async def play(port: int, device: Mic488Device) -> tuple[bool, str, str]:
        async with AsyncMic488(address(folder, port, "operator")) as mic:
            await mic.enable(1)
            is_on = device.axes[0].enabled
        async with AsyncMic488(address(folder, port, "viewer"), observe=True) as mic:
            with pytest.raises(Refusal) as refused:
                await mic.enable(1)
        with pytest.raises(LineFailure) as stranger:
            async with AsyncMic488(address(folder, port, "operator", "other/ca.pem")):
                pass
        return is_on, str(refused.value), str(stranger.value)

    (is_on, refused, stranger), _ = served(play)
    assert is_on
    assert "exception 01" in refused
    assert "cannot connect to tls://127.0.0.1:" in stranger
    assert "self-signed certificate in certificate chain" in stranger


@pytest.fixture
def other_server(folder: Path) -> Iterator[int]:
    """The port of pymodbus' server, which wants a certificate of its authority."""
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH, cafile=str(folder / "ca.pem"))
    context.verify_mode = ssl.CERT_REQUIRED
    context.load_cert_chain(folder / "twin.pem", folder / "twin.key")
    ports: list[int] = []
    loop = asyncio.new_event_loop()
    ended = asyncio.Event()

    async def serve() -> None:
        device = SimDevice(1, simdata=[SimData(0, count=8, values=42, datatype=DataType.REGISTERS)])
        server = ModbusTlsServer(device, address=("127.0.0.1", 0), sslctx=context)
        await server.serve_forever(background=True)
        listening: Any = server.transport
        ports.append(listening.sockets[0].getsockname()[1])
        await ended.wait()
        await server.shutdown()

    thread = threading.Thread(target=loop.run_until_complete, args=(serve(),))
    thread.start()
    until(lambda: ports, "pymodbus listens")
    yield ports[0]
    loop.call_soon_threadsafe(ended.set)
    thread.join()
    loop.close()


def test_a_driver_for_threads_at_another_server(other_server: int, folder: Path) -> None:
    line = ThreadModbusLine(address(folder, other_server, "viewer"))
    finish(line.open())
    answer = finish(line.exchange(Job(ModbusQuery(1, ReadRequest(3, 2, 3)), 5 * SECOND)))
    finish(line.close())
    assert answer.hex() == "0306002a002a002a"
