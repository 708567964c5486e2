"""Tables of gateways in a description."""

from __future__ import annotations

import pytest

from steptwin.machine import MILLISECOND
from steptwin.world.description import describe, read_world
from steptwin.world.gateways import OpcUaSpec
from steptwin.world.reader import WorldError

HALL = '[[mic488]]\nname = "table"\n'


def test_a_gateway_is_described() -> None:
    (gateway,) = read_world("hall.toml", HALL + '[gateway.prometheus]\nlisten = "127.0.0.1:9100"\n').gateways
    assert (gateway.kind, gateway.listen) == ("prometheus", "127.0.0.1:9100")


def test_without_keys_it_listens_on_its_usual_port() -> None:
    (gateway,) = read_world("hall.toml", HALL + "[gateway.prometheus]\n").gateways
    assert gateway.listen == "127.0.0.1:9488"


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("[gateway.promteheus]\n", "there is no [gateway.promteheus] (did you mean 'prometheus'?)"),
        ("[gateway.prometheus]\nport = 1\n", "[gateway.prometheus] has no 'port'"),
        ('[gateway.prometheus]\nlisten = "9100"\n', "[gateway.prometheus]: listen: '9100' is not an address"),
        ("gateway = 1\n", "[gateway] is 1"),
        ("[gateway]\nprometheus = 1\n", "[gateway.prometheus] is 1"),
        ("[[gateway]]\n", "[gateway] is [{}]"),
    ],
)
def test_mistakes_are_reported(table: str, message: str) -> None:
    with pytest.raises(WorldError) as error:
        read_world("hall.toml", table + HALL)
    assert message in str(error.value)


def test_a_world_without_gateways_has_none() -> None:
    assert describe("hall.toml", HALL).gateways == ()


def test_what_an_opc_ua_gateway_is_without_keys_and_with_all_of_them() -> None:
    (plain,) = read_world("hall.toml", HALL + "[gateway.opcua]\n").gateways
    assert isinstance(plain, OpcUaSpec)
    assert (plain.listen, plain.interval, plain.registers, plain.security) == ("127.0.0.1:4840", 100 * MILLISECOND, (), "none")
    assert (plain.certificate, plain.key, plain.trusted, plain.tokens) == (None, None, None, None)
    text = (
        '[gateway.opcua]\nlisten = "127.0.0.1:0"\ninterval = "250 ms"\nregisters = ["table.USER_REGISTER[5]"]\n'
        'security = "sign"\ncertificate = "c.pem"\nkey = "k.pem"\ntrusted = "clients"\ntokens = "t.txt"\n'
    )
    (whole,) = read_world("hall.toml", HALL + text).gateways
    assert isinstance(whole, OpcUaSpec)
    assert (whole.listen, whole.interval, whole.security) == ("127.0.0.1:0", 250 * MILLISECOND, "sign")
    assert whole.registers == ("table.USER_REGISTER[5]",)
    assert (whole.certificate, whole.key, whole.trusted, whole.tokens) == ("c.pem", "k.pem", "clients", "t.txt")
