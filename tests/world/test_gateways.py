"""Tables of gateways in a description."""

from __future__ import annotations

import pytest

from steptwin.world.description import describe, read_world
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
