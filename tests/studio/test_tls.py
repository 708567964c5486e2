"""TLS and IPv6 of the service, asked by clients that share nothing with it: curl, and the ssl module of Python.

The certificate is made by openssl, for this computer.
"""

from __future__ import annotations

import json
import socket
import ssl
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tests.conftest import run_command
from tests.studio.conftest import Process
from websockets.sync.client import connect

Start = Callable[..., Process]


@pytest.fixture
def certificate(require_peer: Callable[[str], str], tmp_path: Path) -> tuple[Path, Path]:
    files = tmp_path / "cert.pem", tmp_path / "key.pem"
    names = "subjectAltName=DNS:localhost,IP:127.0.0.1,IP:::1"
    make = ["req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2"]
    made = ["-subj", "/CN=localhost", "-addext", names, "-out", str(files[0]), "-keyout", str(files[1])]
    subprocess.run([require_peer("openssl"), *make, *made], check=True, capture_output=True)
    return files


def options(certificate: tuple[Path, Path]) -> tuple[str, ...]:
    return "--certificate", str(certificate[0]), "--key", str(certificate[1])


def token_of(studio: Process) -> str:
    """Of the engineer, as the studio prints it."""
    return studio.token


def curl(program: str, *arguments: str) -> tuple[int, str]:
    """Exit code; status and body."""
    ran = subprocess.run([program, "-s", "-w", "\n%{http_code}", *arguments], capture_output=True, text=True, check=False)
    return ran.returncode, ran.stdout


def test_curl_over_tls_at_all_addresses(
    start_studio: Start, certificate: tuple[Path, Path], require_peer: Callable[[str], str]
) -> None:
    """TLS permits other addresses without --remote; tokens are asked for there."""
    program = require_peer("curl")
    studio = start_studio("--http", "0.0.0.0:0", *options(certificate))
    address = f"https://127.0.0.1:{studio.end_points['http']['port']}"
    trusting = ("--cacert", str(certificate[0]))
    assert curl(program, *trusting, f"{address}/api/describe")[1].endswith("\n401")
    bearer = ("-H", f"authorization: Bearer {token_of(studio)}")
    code, text = curl(program, *trusting, *bearer, f"{address}/api/describe")
    assert code == 0
    assert json.loads(text.removesuffix("\n200"))["ok"]["name"] == "hall"
    assert curl(program, *bearer, f"{address}/api/describe")[0] == 60  # an issuer that curl does not know
    assert curl(program, address.replace("https", "http"))[0] in (1, 52, 56)  # nothing is said without TLS
    assert curl(program, *trusting, "--tls-max", "1.1", f"{address}/")[0] == 35


def test_a_socket_over_tls(start_studio: Start, certificate: tuple[Path, Path]) -> None:
    studio = start_studio(*options(certificate))  # at a loopback address: TLS, and no token
    trust = ssl.create_default_context(cafile=certificate[0])
    port = studio.end_points["http"]["port"]
    with (
        socket.create_connection(("127.0.0.1", port)) as plain,
        trust.wrap_socket(plain, server_hostname="127.0.0.1") as secure,
    ):
        assert secure.version() == "TLSv1.3"
        secure.sendall(f"GET /api/state HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n".encode())
        answer = b""
        while piece := secure.recv(65536):
            answer += piece
    assert answer.startswith(b"HTTP/1.1 200")
    assert b'"table"' in answer
    origin: Any = f"https://127.0.0.1:{port}"
    with connect(f"wss://127.0.0.1:{port}/ws", ssl=trust, origin=origin) as opened:
        opened.send('{"do": "hello", "version": 2, "id": 1}')
        assert json.loads(opened.recv(30))["ok"]["role"] == "engineer"
    other: Any = f"http://127.0.0.1:{port}"
    with pytest.raises(Exception, match="403"):
        connect(f"wss://127.0.0.1:{port}/ws", ssl=trust, origin=other)


def test_a_client_that_talks_no_tls_disturbs_nobody(start_studio: Start, certificate: tuple[Path, Path]) -> None:
    studio = start_studio(*options(certificate))
    port = studio.end_points["http"]["port"]
    for rubbish in (b"GET / HTTP/1.1\r\n\r\n", b"\x16\x03\x01\xff\xff" + bytes(300), b""):
        with socket.create_connection(("127.0.0.1", port)) as plain:
            plain.sendall(rubbish)
    trust = ssl.create_default_context(cafile=certificate[0])
    with socket.create_connection(("127.0.0.1", port)) as plain, trust.wrap_socket(plain, server_hostname="127.0.0.1") as secure:
        secure.sendall(f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n".encode())
        assert secure.recv(100).startswith(b"HTTP/1.1 200")


@pytest.fixture
def ipv6() -> str:
    try:
        with socket.create_server(("::1", 0), family=socket.AF_INET6):
            return "::1"
    except OSError:
        pytest.skip("this computer has no IPv6")


def test_the_loopback_address_of_ipv6(start_studio: Start, require_peer: Callable[[str], str], ipv6: str) -> None:
    program = require_peer("curl")
    studio = start_studio("--http", f"[{ipv6}]:0")
    assert studio.url.startswith("http://[::1]:")
    code, text = curl(program, "-g", f"{studio.url}/api/points?names=time")
    assert (code, text[-4:]) == (0, "\n200")
    body = ("-H", "content-type: application/json", "-d", '{"controller": "table", "axis": 1}')
    assert curl(program, "-g", *body, f"{studio.url}/api/do/enable")[1].endswith("\n200")
    assert curl(program, "-g", "-H", "host: evil.example", f"{studio.url}/api/describe")[1].endswith("\n403")
    with studio.connect(origin=studio.url) as opened:
        opened.send('{"do": "hello", "version": 2, "id": 1}')
        assert json.loads(opened.recv(30))["ok"]["role"] == "engineer"


def test_all_addresses_of_ipv6_are_remote(start_studio: Start, ipv6: str, require_peer: Callable[[str], str]) -> None:
    refused = run_command(["studio", "--http", "[::]:0"], {})
    assert refused.returncode == 2
    assert "others can reach this address" in refused.stderr
    studio = start_studio("--http", "[::]:0", "--remote")
    address = f"http://[{ipv6}]:{studio.end_points['http']['port']}"
    program = require_peer("curl")
    assert curl(program, "-g", f"{address}/api/describe")[1].endswith("\n401")
    bearer = ("-H", f"authorization: Bearer {token_of(studio)}")
    assert curl(program, "-g", *bearer, f"{address}/api/describe")[1].endswith("\n200")


@pytest.mark.parametrize("broken", ["certificate", "key"])
def test_files_that_are_no_certificate_are_named(certificate: tuple[Path, Path], broken: str, tmp_path: Path) -> None:
    (tmp_path / "rubbish.pem").write_text("rubbish\n")
    files = {"certificate": certificate[0], "key": certificate[1], broken: tmp_path / "rubbish.pem"}
    given = [part for name, path in files.items() for part in (f"--{name}", str(path))]
    ran = run_command(["studio", "--http", "127.0.0.1:0", "--no-browser", *given], {"XDG_STATE_HOME": str(tmp_path)})
    assert ran.returncode != 0
    assert "cannot use the certificate" in ran.stderr
    assert "Traceback" not in ran.stderr
