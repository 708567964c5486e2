"""Certificates for servers and their clients: an authority, and what it has signed."""

from __future__ import annotations

import ipaddress
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Self

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID


class Authority:
    """Writes ``NAME.pem`` and ``NAME.key`` into ``folder``; its own are ``ca``."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._key = ec.generate_private_key(ec.SECP256R1())
        self._name = _name("authority")
        builder = self._builder("authority", self._key).add_extension(
            x509.BasicConstraints(ca=True, path_length=None), critical=True
        )
        usage = x509.KeyUsage(*(number in (5, 6) for number in range(9)))
        builder = builder.add_extension(usage, critical=True)
        builder = builder.add_extension(x509.SubjectKeyIdentifier.from_public_key(self._key.public_key()), critical=False)
        self._write("ca", self._key, builder)

    @classmethod
    def owner_of(cls, folder: Path, certificate: Path, key: Path) -> Self:
        """Who has a certificate and signs with it, whether or not he may."""
        found = cls.__new__(cls)
        found._folder = folder
        found._key = serialization.load_pem_private_key(key.read_bytes(), None)  # type: ignore[assignment]
        found._name = x509.load_pem_x509_certificate(certificate.read_bytes()).subject
        return found

    def sign(self, name: str, *, role: str | None = None, days: tuple[int, int] = (-1, 1)) -> None:
        """For 127.0.0.1, as server and as client; valid from and until so many days from now. ``role``: of a client of
        Modbus/TCP Security."""
        key = ec.generate_private_key(ec.SECP256R1())
        names = x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address("127.0.0.1"))])
        builder = self._builder(name, key, days).add_extension(names, critical=False)
        if role is not None:
            value = b"\x0c" + bytes([len(role)]) + role.encode()  # a UTF8String
            oid = x509.ObjectIdentifier("1.3.6.1.4.1.50316.802.1")
            builder = builder.add_extension(x509.UnrecognizedExtension(oid, value), critical=False)
        builder = builder.add_extension(
            x509.AuthorityKeyIdentifier.from_issuer_public_key(self._key.public_key()), critical=False
        )
        self._write(name, key, builder)

    def _builder(self, name: str, key: ec.EllipticCurvePrivateKey, days: tuple[int, int] = (-1, 1)) -> x509.CertificateBuilder:
        now = datetime.now(UTC)
        builder = x509.CertificateBuilder().subject_name(_name(name)).issuer_name(self._name).public_key(key.public_key())
        builder = builder.serial_number(x509.random_serial_number())
        return builder.not_valid_before(now + timedelta(days=days[0])).not_valid_after(now + timedelta(days=days[1]))

    def _write(self, name: str, key: ec.EllipticCurvePrivateKey, builder: x509.CertificateBuilder) -> None:
        pem = builder.sign(self._key, hashes.SHA256()).public_bytes(serialization.Encoding.PEM)
        (self._folder / f"{name}.pem").write_bytes(pem)
        (self._folder / f"{name}.key").write_bytes(
            key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
        )


def _name(text: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text)])
