"""Roles of clients of Modbus/TCP Security (MB-TCP-Security, section 8.3): in their certificates, and what each may ask."""

from __future__ import annotations

from steptwin.access.roles import ACT, LOOK, ROLES, Permit, Role
from steptwin.wire.pdu import READS

ROLE_OID = "1.3.6.1.4.1.50316.802.1"
"""Identifier of the extension of a certificate; its value is a UTF8String."""
_UTF8_STRING = 0x0C
LONGEST_ROLE = 127
"""Bytes, so that the length takes one."""


def role_value(role: str) -> bytes:
    """The value of the extension (DER)."""
    text = role.encode()
    return bytes((_UTF8_STRING, len(text))) + text


def role_of(value: bytes) -> Role | None:
    """The role in the value of the extension; None for another text, or what is no such value."""
    if len(value) < 2 or value[0] != _UTF8_STRING or value[1] > LONGEST_ROLE or len(value) != 2 + value[1]:
        return None
    return ROLES.get(value[2:].decode("utf-8", "replace").lower())


def permit_of(function: int) -> Permit:
    """Permission that a request with this function code needs: reading is looking, all else acts on the controller."""
    return LOOK if function in READS else ACT


def may_ask(role: Role | None, function: int) -> bool:
    """Whether a client may send a request with this function code; without a role none."""
    return role is not None and role >= permit_of(function).role
