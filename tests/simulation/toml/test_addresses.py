"""Where lines listen."""

from __future__ import annotations

import pytest

from steptwin.errors import Misuse
from steptwin.simulation.toml.addresses import Address, check_addresses, parse_address


@pytest.mark.parametrize(
    ("text", "address", "shown"),
    [
        ("127.0.0.1:5020", ("127.0.0.1", 5020), "127.0.0.1:5020"),
        (":0", ("127.0.0.1", 0), "127.0.0.1:0"),
        ("localhost:65535", ("127.0.0.1", 65535), "127.0.0.1:65535"),
        ("[::1]:80", ("::1", 80), "[::1]:80"),
        ("127.9.9.9:1", ("127.9.9.9", 1), "127.9.9.9:1"),
    ],
)
def test_loopback_addresses_are_taken(text: str, address: tuple[str, int], shown: str) -> None:
    for listen_any in (False, True):
        found = parse_address(text, listen_any=listen_any)
        assert found == Address(*address)
        assert str(found) == shown


@pytest.mark.parametrize("text", ["", "5020", "127.0.0.1", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:65536", "127.0.0.1:-1"])
def test_what_is_no_address(text: str) -> None:
    with pytest.raises(Misuse, match=r"is not an address: expected HOST:PORT with a port from 0 to 65535"):
        parse_address(text, listen_any=True)


@pytest.mark.parametrize("text", ["0.0.0.0:80", "10.1.2.3:80", "machine.local:80", "[::]:80"])
def test_other_addresses_need_permission(text: str) -> None:
    with pytest.raises(Misuse, match=r"is not a loopback address: .*--listen-any permits it"):
        parse_address(text, listen_any=False)
    assert str(parse_address(text, listen_any=True)) == text


def test_a_permission_that_no_address_needs_is_refused() -> None:
    check_addresses([None, "127.0.0.1:1"], listen_any=False)
    check_addresses(["127.0.0.1:1", "0.0.0.0:2"], listen_any=True)
    with pytest.raises(Misuse, match=r"there is none \(addresses: 127\.0\.0\.1:1, \[::1\]:2\)"):
        check_addresses(["127.0.0.1:1", None, "[::1]:2"], listen_any=True)
    with pytest.raises(Misuse, match=r"there is none \(addresses: none\)"):
        check_addresses([None], listen_any=True)
    with pytest.raises(Misuse, match="not a loopback address"):
        check_addresses(["127.0.0.1:1", "0.0.0.0:2"], listen_any=False)
