"""Options of the table: passwords, certificates, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import pytest
from tls_files import Authority

from steptwin.errors import Misuse
from steptwin.gateways.kinds import read_gateways
from steptwin.gateways.mqtt.gateway import broker_of
from steptwin.gateways.mqtt.options import MqttSpec
from steptwin.simulation.describe.description import read_world
from steptwin.simulation.toml.reader import WorldError


def mqtt(keys: str) -> MqttSpec:
    (found,) = read_gateways(read_world("hall.toml", f'[[mic488]]\nname = "table"\n[gateway.mqtt]\n{keys}').text)
    assert isinstance(found, MqttSpec)
    return found


def test_without_keys_it_is_the_broker_of_this_computer(tmp_path: Path) -> None:
    found = broker_of(mqtt(""), tmp_path)
    assert (found.address, found.keep_alive_s, found.user, found.password, found.tls) == (
        ("127.0.0.1", 1883),
        15,
        None,
        None,
        None,
    )


def test_passwords_come_from_a_file_or_the_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "password").write_text("a secret\n")
    assert broker_of(mqtt('user = "u"\npassword_file = "password"'), tmp_path).password == "a secret"
    monkeypatch.setenv("OUR_PASSWORD", "another")
    assert broker_of(mqtt('user = "u"\npassword_variable = "OUR_PASSWORD"'), tmp_path).password == "another"
    monkeypatch.delenv("OUR_PASSWORD")
    with pytest.raises(Misuse, match="the environment has no OUR_PASSWORD"):
        broker_of(mqtt('user = "u"\npassword_variable = "OUR_PASSWORD"'), tmp_path)
    (tmp_path / "password").write_text("two\nlines\n")
    with pytest.raises(Misuse, match="password has 2 lines"):
        broker_of(mqtt('user = "u"\npassword_file = "password"'), tmp_path)


def test_certificates_that_cannot_be_used(tmp_path: Path) -> None:
    authority = Authority(tmp_path)
    authority.sign("client")
    authority.sign("other")
    (tmp_path / "text").write_text("nothing")
    good = 'tls = true\nca = "ca.pem"\ncertificate = "client.pem"\nkey = "client.key"'
    assert broker_of(mqtt(good), tmp_path).tls is not None
    for wrong, place in (
        (good.replace("client.key", "other.key"), "client.pem, other.key"),
        (good.replace("client.pem", "none.pem"), "none.pem"),
        (good.replace("ca.pem", "text"), "ca: text"),
        (good.replace("ca.pem", "none"), "ca: none: no such file"),
    ):
        with pytest.raises(Misuse, match=place):
            broker_of(mqtt(wrong), tmp_path)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('broker = "here"', "is not an address"),
        ('broker = "127.0.0.1:0"', "the port of a broker is 1 to 65535"),
        ('topic = "a/#"', "a topic has no + and #"),
        ('topic = "/a"', "begins and ends without /"),
        ('keep_alive = "1500ms"', "permitted are whole seconds from 1s to 3600s"),
        ('password_file = "x"', "password_file means nothing without user"),
        ('user = "u"\npassword_file = "x"\npassword_variable = "y"', "exclude each other"),
        ('ca = "x"', "ca means nothing without tls"),
        ('role = "boss"', "permitted are viewer, operator, engineer"),
        ('password = "x"', "has no 'password'"),
        ('sparkplug = "x"', "expected { group"),
        ('sparkplug = { group = "a" }', "node is missing"),
        ('sparkplug = { group = "a", node = "b/c" }', "an id of Sparkplug has no"),
        ('sparkplug = { group = "a", node = "b", hots = "c" }', "there is no 'hots'"),
        ('sparkplug = { group = "a", node = "b" }\ntopic = "x"', "exclude each other"),
    ],
)
def test_mistakes_are_reported(keys: str, message: str) -> None:
    with pytest.raises(WorldError) as error:
        mqtt(keys)
    assert message in str(error.value)
