"""Tables of gateways in a description."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module
from importlib.metadata import packages_distributions

import pytest

from steptwin.controller import MILLISECOND, SECOND
from steptwin.extras import libraries_of
from steptwin.gateways.epics.options import EpicsSpec
from steptwin.gateways.kinds import KINDS, read_gateways
from steptwin.gateways.modbus.options import ModbusSpec
from steptwin.gateways.mqtt.options import MqttSpec, SparkplugSpec
from steptwin.gateways.opcua.options import OpcUaSpec
from steptwin.gateways.options import GatewaySpec, name_of
from steptwin.gateways.prometheus.options import PrometheusSpec
from steptwin.simulation.describe.description import describe, read_world
from steptwin.simulation.toml.reader import WorldError

HALL = '[[mic488]]\nname = "table"\n'


def test_a_gateway_is_described() -> None:
    (gateway,) = read_gateways(read_world("hall.toml", HALL + '[gateway.prometheus]\nlisten = "127.0.0.1:9100"\n').text)
    assert (gateway.kind, gateway.listen) == ("prometheus", "127.0.0.1:9100")


PLAIN = (
    PrometheusSpec(path=("gateway", "prometheus"), listen="127.0.0.1:9488", file="hall.toml"),
    OpcUaSpec(
        path=("gateway", "opcua"),
        listen="127.0.0.1:4840",
        file="hall.toml",
        interval=100 * MILLISECOND,
        registers=(),
        security="none",
        certificate=None,
        its_key=None,
        trusted=None,
        tokens=None,
    ),
    EpicsSpec(
        path=("gateway", "epics"),
        listen="127.0.0.1:5064",
        file="hall.toml",
        prefix="",
        beacons="127.0.0.1:5065",
        pva=None,
        pva_beacons="127.0.0.1:5076",
        interval=100 * MILLISECOND,
        registers=(),
        role=None,
    ),
    ModbusSpec(path=("gateway", "modbus"), listen="127.0.0.1:5020", file="hall.toml", units={}, role=None),
    MqttSpec(
        path=("gateway", "mqtt"),
        listen=None,
        file="hall.toml",
        broker="127.0.0.1:1883",
        topic="steptwin",
        interval=100 * MILLISECOND,
        registers=(),
        keep_alive=15 * SECOND,
        store=4096,
        user=None,
        password_file=None,
        password_variable=None,
        tls=False,
        ca=None,
        certificate=None,
        its_key=None,
        tokens=None,
        role=None,
        discovery=None,
        sparkplug=None,
    ),
)


@pytest.mark.parametrize("plain", PLAIN, ids=[plain.kind for plain in PLAIN])
def test_without_keys_it_is_as_documented(plain: GatewaySpec) -> None:
    (gateway,) = read_gateways(read_world("hall.toml", HALL + f"[gateway.{plain.kind}]\n").text)
    assert gateway == plain


@pytest.mark.parametrize(
    ("table", "told"),
    [
        ('mqtt]\nbroker = "a:0"', "broker: 'a:0': the port of a broker is 1 to 65535, usually 1883"),
        ('mqtt]\ntopic = "/a"', "topic: '/a': a topic has no + and #, and begins and ends without /"),
        ('mqtt]\ntopic = "$a"', "topic: '$a': a topic has no + and #, and begins and ends without /"),
        ('mqtt]\ntopic = "a/"', "topic: 'a/': a topic has no + and #, and begins and ends without /"),
        ('mqtt]\ntopic = "a+b"', "topic: 'a+b': a topic has no + and #, and begins and ends without /"),
        ("mqtt]\nstore = 0", "store: 0: permitted are whole numbers from 1 to 1000000"),
        ("mqtt]\nstore = 1_000_001", "store: 1000001: permitted are whole numbers from 1 to 1000000"),
        ("mqtt]\nsparkplug = 1", "sparkplug: 1: expected { group = ..., node = ... }"),
        ("mqtt]\nsparkplug = { node = 'n' }", "sparkplug: group is missing: expected { group = ..., node = ... }"),
        ("mqtt]\nsparkplug = { group = 'g' }", "sparkplug: node is missing: expected { group = ..., node = ... }"),
        (
            "mqtt]\nsparkplug = { group = 'g', node = 'n', hots = 'h' }",
            "sparkplug: there is no 'hots'; permitted are group, node, host",
        ),
        (
            "mqtt]\nsparkplug = { group = 'g', node = 'n', host = 'h#' }",
            "sparkplug: 'h#': an id of Sparkplug has no +, / and #",
        ),
        ("mqtt]\nsparkplug = { group = 1, node = 'n' }", "sparkplug: 1: expected a text"),
        ('epics]\nbeacons = "a:0"', "beacons: 'a:0': the port for beacons is 1 to 65535, usually 5065, of PV Access 5076"),
        ('epics]\npva = "a:65535"', "pva: 'a:65535': the port is at most 65534, because the next one is for searches"),
        ('epics]\nprefix = "a b"', "prefix: 'a b': names of records have letters from A to Z, digits and _-:;<>[]"),
        ("epics]\nprefix = 1", "prefix: 1: names of records have letters from A to Z, digits and _-:;<>[]"),
        ("modbus]\nunits = 1", "units: 1: expected { CONTROLLER = UNIT, ... }"),
        ("modbus]\nunits = { table = 0 }", "units: table = 0: units are 1 to 247"),
        ("modbus]\nunits = { table = 248 }", "units: table = 248: units are 1 to 247"),
        ("modbus]\nunits = { table = true }", "units: table = True: units are 1 to 247"),
    ],
)
def test_what_a_key_does_not_take(table: str, told: str) -> None:
    with pytest.raises(WorldError) as error:
        read_world("hall.toml", f"{HALL}[gateway.{table}\n")
    kind = table.partition("]")[0]
    assert f"hall.toml:4:1: error D003: [gateway.{kind}]: {told}\n" in str(error.value)


def test_what_is_no_table_of_gateways() -> None:
    with pytest.raises(WorldError) as error:
        read_world("hall.toml", "gateway = 1\n" + HALL)
    kinds = ", ".join(f"[gateway.{name}]" for name in KINDS)
    lines = str(error.value).splitlines()
    assert (lines[0], lines[-1].strip()) == ("hall.toml:1:1: error D002: [gateway] is 1", f"= expected tables: {kinds}")


def test_what_is_no_gateway() -> None:
    with pytest.raises(WorldError) as error:
        read_world("hall.toml", "[gateway.modbsu]\n" + HALL)
    kinds = ", ".join(f"[gateway.{name}]" for name in KINDS)
    told = "hall.toml:1:1: error D004: there is no [gateway.modbsu] (did you mean 'modbus'?)"
    lines = [line.strip() for line in str(error.value).splitlines()]
    assert lines[0] == told
    assert f"= permitted: {kinds}" in lines
    (finding,) = error.value.findings
    assert finding.fix is not None
    assert (finding.fix.span.start, finding.fix.text) == (len("[gateway."), "modbus")


def test_what_keys_just_take() -> None:
    text = """
    [gateway.mqtt]
    broker = "a:1"
    store = 1_000_000
    sparkplug = { group = "g", node = "n", host = "h" }
    [gateway.epics]
    beacons = "127.0.0.1:1"
    pva = "127.0.0.1:65534"
    prefix = ""
    [gateway.modbus]
    units = { table = 1, other = 247 }
    """
    mqtt, epics, modbus = read_gateways(read_world("hall.toml", HALL + text).text)
    assert isinstance(mqtt, MqttSpec)
    assert isinstance(epics, EpicsSpec)
    assert isinstance(modbus, ModbusSpec)
    assert (mqtt.broker, mqtt.store) == ("a:1", 1_000_000)
    assert mqtt.sparkplug == SparkplugSpec(group="g", node="n", host="h")
    assert (epics.beacons, epics.pva, epics.prefix) == ("127.0.0.1:1", "127.0.0.1:65534", "")
    assert modbus.units == {"table": 1, "other": 247}
    (mqtt,) = read_gateways(read_world("hall.toml", HALL + '[gateway.mqtt]\ntopic = "a/b$"\n').text)
    assert isinstance(mqtt, MqttSpec)
    assert mqtt.topic == "a/b$"


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
    assert read_gateways(describe("hall.toml", HALL).text) == ()


def test_an_opc_ua_gateway_with_all_keys() -> None:
    text = (
        '[gateway.opcua]\nlisten = "127.0.0.1:0"\ninterval = "250 ms"\nregisters = ["table.USER_REGISTER[5]"]\n'
        'security = "sign"\ncertificate = "c.pem"\nkey = "k.pem"\ntrusted = "clients"\ntokens = "t.txt"\n'
    )
    (whole,) = read_gateways(read_world("hall.toml", HALL + text).text)
    assert isinstance(whole, OpcUaSpec)
    assert (whole.listen, whole.interval, whole.security) == ("127.0.0.1:0", 250 * MILLISECOND, "sign")
    assert whole.registers == ("table.USER_REGISTER[5]",)
    assert (whole.certificate, whole.its_key, whole.trusted, whole.tokens) == ("c.pem", "k.pem", "clients", "t.txt")


def test_options_need_no_library() -> None:
    """So that descriptions are checked and edited without the extras."""
    code = "import sys; before = {*sys.modules}; import steptwin.services; print(*{*sys.modules} - before)"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert {f"steptwin.gateways.{name}.options" for name in KINDS} <= {*ran.stdout.split()}
    loaded = {name.partition(".")[0] for name in ran.stdout.split()}
    assert loaded & {*packages_distributions()} <= {"steptwin"}
    assert not {"asyncio", "socket", "ssl"} & loaded


def test_a_program_that_uses_worlds_alone_has_their_tables_checked() -> None:
    code = "from steptwin import World; World.from_toml('[gateway.epcs]')"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "there is no [gateway.epcs] (did you mean 'epics'?)" in ran.stderr


@pytest.mark.parametrize("kind", KINDS.values(), ids=list(KINDS))
def test_each_has_what_serves_it_and_its_extra(kind: type[GatewaySpec]) -> None:
    assert callable(import_module(f"steptwin.gateways.{name_of(kind)}.gateway").make)
    assert bool(kind.extra) == bool(libraries_of(kind.extra))
