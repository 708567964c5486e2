"""Encryption, certificates and users of the server."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from asyncua import Server, ua
from asyncua.crypto.truststore import TrustStore
from asyncua.crypto.validator import CertificateValidator, CertificateValidatorOptions
from asyncua.server.user_managers import UserManager
from cryptography.hazmat.primitives.serialization import load_pem_private_key
from cryptography.x509 import load_pem_x509_certificate

from steptwin.access.roles import Role
from steptwin.access.tokens import AccessGate
from steptwin.errors import Misuse, Refusal
from steptwin.files.tokenfiles import tokens_in
from steptwin.gateways.clients import GatewayClient
from steptwin.gateways.opcua.options import OpcUaSpec
from steptwin.gateways.opcua.session import GatewayUser
from steptwin.inputfiles import read_bytes

_SIGNED = (
    ua.SecurityPolicyType.Basic256Sha256_Sign,
    ua.SecurityPolicyType.Aes128Sha256RsaOaep_Sign,
    ua.SecurityPolicyType.Aes256Sha256RsaPss_Sign,
)
_ENCRYPTED = (
    ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt,
    ua.SecurityPolicyType.Aes128Sha256RsaOaep_SignAndEncrypt,
    ua.SecurityPolicyType.Aes256Sha256RsaPss_SignAndEncrypt,
)


def present() -> datetime:
    return datetime.now(UTC)


class Security(UserManager):
    """Users are admitted by tokens: the name of the user is free, the password is the token. Without tokens everybody on this
    computer is an engineer."""

    def __init__(self, options: OpcUaSpec, folder: Path, *, is_local: bool) -> None:
        """Files are relative to ``folder``. Raises `Misuse` for options and files that cannot be used."""
        self._options = options
        self._folder = folder
        self.began = datetime.now(UTC)
        self._loaded: tuple[bytes, ...] = ()
        """Certificate and key, as they were read."""
        self.valid_until: datetime | None = None
        """The end of its certificate; None without one."""
        if not is_local and (options.security == "none" or options.tokens is None):
            raise Misuse("[gateway.opcua]: others can reach this address: give security = 'encrypt', certificate, key and tokens")
        if options.security != "none" and options.certificate is None:
            raise Misuse(f"[gateway.opcua]: security = {options.security!r} needs certificate and key: see steptwin certificate")
        tokens = () if options.tokens is None else tokens_in(folder / options.tokens)
        self._gate = AccessGate(tokens, open_to=None if tokens else Role.ENGINEER)

    @property
    def policies(self) -> Sequence[ua.SecurityPolicyType]:
        """Permitted policies: at least what ``security`` names."""
        if self._options.certificate is None:
            return (ua.SecurityPolicyType.NoSecurity,)
        least = self._options.security
        signed = _SIGNED if least != "encrypt" else ()
        return (*((ua.SecurityPolicyType.NoSecurity,) if least == "none" else ()), *_ENCRYPTED, *signed)

    def _files(self) -> tuple[bytes, ...]:
        """Raises `Misuse`."""
        return tuple(
            read_bytes(self._folder / name) for name in (self._options.certificate, self._options.its_key) if name is not None
        )

    def is_renewed(self) -> bool:
        """Whether the files of certificate and key are others than those in use. Raises `Misuse` for what cannot be used, such as
        a certificate whose key has not been written yet."""
        found = self._files()
        if found == self._loaded:
            return False
        names = f"[gateway.opcua]: {self._options.certificate}, {self._options.its_key}: "
        try:
            own = load_pem_private_key(found[1], None).public_key()
            certified = load_pem_x509_certificate(found[0]).public_key()
        except (ValueError, TypeError) as error:
            raise Misuse(f"{names}{error}") from None
        if own != certified:
            raise Misuse(f"{names}they do not belong together")
        return True

    def trouble(self) -> str | None:
        """Why clients refuse its certificate; None while they do not."""
        until = self.valid_until
        if until is None or present() < until:
            return None
        return f"{self._options.certificate} has expired on {until:%Y-%m-%d %H:%M} UTC: clients refuse it; renew it"

    async def apply(self, server: Server) -> None:
        """Raises `Misuse` for a certificate that cannot be used."""
        options = self._options
        server.set_security_policy(list(self.policies))
        asks = self._gate.asks
        server.set_identity_tokens([ua.UserNameIdentityToken] if asks else [ua.AnonymousIdentityToken, ua.UserNameIdentityToken])
        if options.certificate is not None and options.its_key is not None:
            try:
                self._loaded = self._files()
                await server.load_certificate(self._loaded[0], "PEM")
                await server.load_private_key(self._loaded[1], format="PEM")
                self.valid_until = load_pem_x509_certificate(self._loaded[0]).not_valid_after_utc
            except (ValueError, TypeError) as error:  # TypeError: a key that is encrypted
                raise Misuse(f"[gateway.opcua]: {options.certificate}, {options.its_key}: {error}") from None
        checks = CertificateValidatorOptions.BASIC_VALIDATION | CertificateValidatorOptions.PEER_CLIENT
        trusted: TrustStore | None = None
        if options.trusted is not None:
            where = self._folder / options.trusted
            if not any(where.glob("*.pem")) and not any(where.glob("*.der")):
                raise Misuse(f"[gateway.opcua]: trusted: {where} has no certificate (.pem, .der), so no client would be admitted")
            trusted = TrustStore([where], [])
            try:
                await trusted.load()
            except ValueError as error:
                raise Misuse(f"[gateway.opcua]: trusted: {where} has a file that is not a certificate: {error}") from None
            checks |= CertificateValidatorOptions.TRUSTED
        if options.certificate is not None:
            server.set_certificate_validator(CertificateValidator(checks, trusted))

    def get_user(
        self, iserver: object, username: str | None = None, password: str | None = None, certificate: Any = None
    ) -> GatewayUser | None:
        try:
            role, name = self._gate.enter(password)
        except Refusal:
            return None
        return GatewayUser(client=GatewayClient(name or username or "anonymous", role))
