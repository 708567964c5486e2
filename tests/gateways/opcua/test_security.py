"""Options of the server that cannot be used."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from asyncua.server.server import Server
from cryptography.hazmat.primitives.serialization import (
    BestAvailableEncryption,
    Encoding,
    PrivateFormat,
    load_pem_private_key,
)
from tokens import tokens_file

from steptwin.errors import Misuse
from steptwin.files.certificate import make_certificate
from steptwin.gateways.kinds import read_gateways
from steptwin.gateways.opcua.options import OpcUaSpec
from steptwin.gateways.opcua.security import Security
from steptwin.simulation.describe.description import read_world

OWN = 'certificate = "certificate.pem"\nkey = "key.pem"\n'


def security(folder: Path, keys: str, *, is_local: bool = True) -> Security:
    (spec,) = read_gateways(read_world("hall.toml", f'[[mic488]]\nname = "table"\n[gateway.opcua]\n{keys}').text)
    assert isinstance(spec, OpcUaSpec)
    return Security(spec, folder, is_local=is_local)


def test_others_need_security_and_tokens(tmp_path: Path) -> None:
    tokens_file(tmp_path, "viewer screen 0123456789abcdef\n")
    for keys in ("", 'tokens = "tokens"\n', f'security = "encrypt"\n{OWN}'):
        with pytest.raises(Misuse, match="others can reach this address"):
            security(tmp_path, keys, is_local=False)
    security(tmp_path, f'tokens = "tokens"\nsecurity = "encrypt"\n{OWN}', is_local=False)


def test_encryption_needs_a_certificate(tmp_path: Path) -> None:
    with pytest.raises(Misuse, match="security = 'sign' needs certificate and key"):
        security(tmp_path, 'security = "sign"\n')


def test_a_folder_without_certificates_would_admit_nobody(tmp_path: Path) -> None:
    make_certificate(tmp_path, [], 2)
    wanted = security(tmp_path, f'trusted = "clients"\n{OWN}')
    with pytest.raises(Misuse, match=r"trusted: .*clients has no certificate"):
        asyncio.run(wanted.apply(Server()))
    _, key = make_certificate(tmp_path / "clients", [], 2)
    with pytest.raises(Misuse, match=r"clients has a file that is not a certificate"):
        asyncio.run(wanted.apply(Server()))
    key.unlink()
    server = Server()
    asyncio.run(wanted.apply(server))
    assert server.iserver.certificate_validator is not None


def test_a_file_that_is_no_certificate(tmp_path: Path) -> None:
    for name in ("certificate.pem", "key.pem"):
        (tmp_path / name).write_text("text")
    with pytest.raises(Misuse, match=r"\[gateway.opcua\]: certificate.pem, key.pem: "):
        asyncio.run(security(tmp_path, OWN).apply(Server()))


def test_a_key_that_is_encrypted(tmp_path: Path) -> None:
    _, key = make_certificate(tmp_path, [], 2)
    own = load_pem_private_key(key.read_bytes(), None)
    key.write_bytes(own.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, BestAvailableEncryption(b"secret")))
    with pytest.raises(Misuse, match=r"\[gateway.opcua\]: certificate.pem, key.pem: .*encrypted"):
        asyncio.run(security(tmp_path, OWN).apply(Server()))
