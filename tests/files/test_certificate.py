"""``steptwin certificate``."""

from __future__ import annotations

import ssl
from pathlib import Path

import pytest

from steptwin.errors import Misuse
from steptwin.files.certificate import make_certificate


def test_a_certificate_for_servers_of_this_computer(tmp_path: Path) -> None:
    certificate, key = make_certificate(tmp_path / "new" / "own", ["press.example", "192.0.2.7"], 30)
    ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key)
    context = ssl.create_default_context(cafile=str(certificate))
    (found,) = context.get_ca_certs()
    names = {name for kind, name in found["subjectAltName"]}  # type: ignore[index]
    assert {"urn:steptwin:opcua", "press.example", "192.0.2.7", "localhost", "127.0.0.1"} <= names
    begin, end = (ssl.cert_time_to_seconds(str(found[key])) for key in ("notBefore", "notAfter"))
    assert end - begin == 30 * 86400 + 300
    assert key.stat().st_mode & 0o777 == 0o600


def test_files_are_never_replaced(tmp_path: Path) -> None:
    (tmp_path / "key.pem").write_text("mine")
    with pytest.raises(Misuse, match=r"key\.pem is there already"):
        make_certificate(tmp_path, [], 30)
    assert [file.name for file in tmp_path.iterdir()] == ["key.pem"]


@pytest.mark.parametrize("days", [0, 7301])
def test_days_have_a_range(days: int, tmp_path: Path) -> None:
    with pytest.raises(Misuse, match=f"--days {days}: permitted are 1 to 7300"):
        make_certificate(tmp_path, [], days)


@pytest.mark.parametrize(
    ("options", "message"),
    [({"role": "cook"}, "--role cook: roles are viewer, operator, engineer"), ({"name": "x" * 65}, "--name has 65 characters")],
)
def test_roles_and_names_that_are_not_permitted(options: dict[str, str], message: str, tmp_path: Path) -> None:
    with pytest.raises(Misuse, match=message):
        make_certificate(tmp_path, [], 30, **options)


def test_a_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(Misuse, match="not a directory"):
        make_certificate(tmp_path / "file" / "own", [], 30)
