"""``steptwin certificate``: signed by itself, with its key: of this computer for servers, or of a client with a role."""

from __future__ import annotations

import socket
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path

from steptwin.access.modbusroles import ROLE_OID, role_value
from steptwin.access.roles import ROLES
from steptwin.errors import Misuse
from steptwin.extras import missing
from steptwin.files.writing import PRIVATE, new_content
from steptwin.system import reason

CERTIFICATE, KEY = "certificate.pem", "key.pem"
ALWAYS = ("localhost", "127.0.0.1", "::1")
DAYS = (1, 7300)
APPLICATION_URI = "urn:steptwin:opcua"
"""A certificate of an OPC UA server names the application that it is for (OPC 10000-6, 6.2.2)."""

LONGEST_NAME = 64
"""Characters of a common name (X.520)."""


def make_certificate(
    folder: Path, hosts: Sequence[str], days: int, *, role: str | None = None, name: str = "steptwin"
) -> tuple[Path, Path]:
    """Write certificate and key into ``folder``, for this computer and the names and addresses in ``hosts``.

    ``role``: that of a client of Modbus/TCP Security. It cannot sign others: no owner raises his role.

    Raises `Misuse` for files that are there already or cannot be written, and where the package cryptography is missing.
    """
    if not DAYS[0] <= days <= DAYS[1]:
        raise Misuse(f"--days {days}: permitted are {DAYS[0]} to {DAYS[1]}")
    if role is not None and role not in ROLES:
        raise Misuse(f"--role {role}: roles are {', '.join(ROLES)}")
    if not 1 <= len(name) <= LONGEST_NAME:
        raise Misuse(f"--name has {len(name)} characters: permitted are 1 to {LONGEST_NAME}")
    files = folder / CERTIFICATE, folder / KEY
    for file in files:
        if file.exists():
            raise Misuse(f"{file} is there already; remove it, or name another folder")
    certificate, key = _make(dict.fromkeys([*ALWAYS, socket.gethostname(), *hosts]), days, name, role)
    try:
        with new_content(files[1], PRIVATE) as file:
            file.write(key)
        with new_content(files[0]) as file:
            file.write(certificate)
    except OSError as error:
        raise Misuse(f"{folder}: {reason(error)}") from error
    return files


def _make(hosts: Iterable[str], days: int, common_name: str, role: str | None) -> tuple[bytes, bytes]:
    """Both as PEM."""
    try:
        from cryptography import x509
        from cryptography.hazmat.primitives import hashes
        from cryptography.hazmat.primitives.asymmetric import rsa
        from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
        from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID
    except ImportError:
        raise missing("a certificate", "tls") from None

    def names() -> Iterator[x509.GeneralName]:
        yield x509.UniformResourceIdentifier(APPLICATION_URI)
        for host in hosts:
            try:
                yield x509.IPAddress(ip_address(host))
            except ValueError:
                yield x509.DNSName(host)

    key = rsa.generate_private_key(public_exponent=65537, key_size=2048)
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name)])
    usage = x509.KeyUsage(
        digital_signature=True,
        content_commitment=True,
        key_encipherment=True,
        data_encipherment=True,
        key_cert_sign=role is None,
        key_agreement=False,
        crl_sign=False,
        encipher_only=False,
        decipher_only=False,
    )
    now = datetime.now(UTC)
    builder = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(minutes=5))
        .not_valid_after(now + timedelta(days=days))
        .add_extension(x509.BasicConstraints(ca=role is None, path_length=0 if role is None else None), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .add_extension(usage, critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]), critical=False)
        .add_extension(x509.SubjectAlternativeName(list(names())), critical=False)
    )
    if role is not None:
        extension = x509.UnrecognizedExtension(x509.ObjectIdentifier(ROLE_OID), role_value(role))
        builder = builder.add_extension(extension, critical=False)
    certificate = builder.sign(key, hashes.SHA256())
    private = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    return certificate.public_bytes(Encoding.PEM), private
