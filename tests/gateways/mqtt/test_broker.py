"""The JSON face with an independent broker and its clients: mosquitto."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import pytest
from gateway_rig import running, served
from mosquitto import BASE, Mosquitto, Requests
from pymodbus.client import ModbusTcpClient
from tests.conftest import STEPTWIN, until
from tls_files import Authority
from tokens import tokens_file

WORLD = """
    [world]
    name = "plant"
    [[line]]
    name = "bus"
    tcp = "127.0.0.1:0"
    [[mic488]]
    name = "table"
    line = "bus"
    [[m1486]]
    name = "feed"
    [[axis]]
    name = "x"
    drive = "table.M1"
    [gateway.mqtt]
    broker = "127.0.0.1:{port}"
    interval = "20ms"
    registers = ["table.USER_REGISTER[5]"]
    role = "engineer"
"""


@pytest.fixture
def broker(require_peer: Callable[[str], str], tmp_path: Path) -> Generator[Mosquitto]:
    with Mosquitto(require_peer, tmp_path) as found:
        yield found


def online(broker: Mosquitto, base: str = BASE) -> None:
    until(lambda: broker.retained(f"{base}/online") is True, "it is online")


def position(broker: Mosquitto) -> Any:
    return broker.retained(f"{BASE}/table/M1")["position"]


def test_a_client_moves_an_axis_and_sees_it_move(broker: Mosquitto, tmp_path: Path) -> None:
    with served(WORLD.format(port=broker.port), tmp_path) as points:
        assert points["mqtt"]["url"] == f"mqtt://127.0.0.1:{broker.port}"
        assert points["mqtt"]["topic"] == BASE
        online(broker)
        with broker.subscribe("me/answers") as answers, broker.subscribe(f"{BASE}/table/M1") as axis:
            ask = Requests(broker, answers)
            axis.wait_for(lambda one: one["retain"] == 1, "what is retained comes first")
            assert ask("enable", controller="table", axis=1)["ok"] is None
            assert ask("move", controller="table", axis=1, to=40.0, id="m")["id"] == "m"
            axis.wait_for(lambda one: one["payload"]["position"] == 40.0, "it arrives")
            values = [one["payload"]["position"] for one in axis.look()]
            assert len(values) > 5
            assert values == sorted(values)
            assert [one["payload"]["at"] for one in axis.seen] == sorted(one["payload"]["at"] for one in axis.seen)
            assert ask("write", values={"table.USER_REGISTER[5]": 77})["ok"] is None
        with ModbusTcpClient("127.0.0.1", port=points["tcp"]["port"]) as master:
            words = master.read_holding_registers(10020, count=2, device_id=1).registers
            assert master.convert_from_registers(words, master.DATATYPE.FLOAT32, word_order="little") == 40.0
            assert master.read_holding_registers(5, count=1, device_id=1).registers == [77]
        until(lambda: broker.retained(f"{BASE}/table/registers")["USER_REGISTER[5]"] == 77, "it is shown")
        assert broker.retained(f"{BASE}/table")["answers"] is True
        about = broker.retained(f"{BASE}/description")
        table = about["controllers"][0]["topics"]
        assert table[f"{BASE}/table/M1"]["values"]["velocity"]["unit"] == "imp/s"
        until(lambda: (broker.retained(f"{BASE}/time") or {}).get("paused") is False, "the time is shown")
    assert broker.retained(f"{BASE}/online") is False


def test_refusals_are_answers(broker: Mosquitto, tmp_path: Path) -> None:
    with served(WORLD.format(port=broker.port), tmp_path):
        online(broker)
        with broker.subscribe("me/answers", f"{BASE}/answer") as answers:
            ask = Requests(broker, answers)
            assert ask("home", controller="feed", axis=1, velocity=5)["error"]["code"] == "refusal", "it cannot do that"
            assert ask("mvoe")["error"]["code"] == "misuse"
            assert "not taken over MQTT" in ask("save", file="/tmp/x")["error"]["message"]
            assert "not retained" in ask("enable", "-r", controller="table", axis=1)["error"]["message"]
            broker.publish(f"{BASE}/do", "neither JSON nor a command")
            found = answers.wait_for(lambda one: one["topic"] == f"{BASE}/answer", "without a response topic it is there")
            assert found["payload"]["error"]["code"] == "misuse"
    with served(WORLD.format(port=broker.port), tmp_path):
        online(broker)
        assert broker.retained(f"{BASE}/table/M1")["enabled"] is False, "what was retained is not done later"


def test_many_commands_at_once_are_done_in_their_order(broker: Mosquitto, tmp_path: Path) -> None:
    with served(WORLD.format(port=broker.port), tmp_path):
        online(broker)
        with broker.subscribe(f"{BASE}/answer") as answers:
            values = range(300)
            broker.publish_lines(
                f"{BASE}/do", ({"do": "write", "values": {"table.USER_REGISTER[5]": one}, "id": one} for one in values)
            )
            answers.wait_for(lambda one: one["payload"].get("id") == values[-1], "the last one is answered")
            found = [one["payload"] for one in answers.look()]
            assert [one["id"] for one in found] == [*values]
            assert all("ok" in one for one in found)
        until(lambda: broker.retained(f"{BASE}/table/registers")["USER_REGISTER[5]"] == values[-1], "it has the last value")


def test_events_come_once_each(broker: Mosquitto, tmp_path: Path) -> None:
    with served(WORLD.format(port=broker.port), tmp_path):
        online(broker)
        with broker.subscribe("me/answers") as answers, broker.subscribe(f"{BASE}/events") as events:
            ask = Requests(broker, answers)
            ask("program", controller="table", action="start")
            found = events.wait_for(lambda one: one["payload"]["kind"] == "status", "it comes")
            assert found["payload"]["code"] == "program-error"
            assert found["retain"] == 0
            ask("note", text="one")
            ask("note", text="two")
            events.wait_for(lambda one: one["payload"].get("note") == "two", "the last one comes")
            numbers = [one["payload"]["number"] for one in events.look()]
            assert numbers == sorted(set(numbers))


def test_the_broker_goes_and_comes_back(broker: Mosquitto, tmp_path: Path) -> None:
    with served(WORLD.format(port=broker.port), tmp_path, is_quiet=False) as points:
        online(broker)
        with broker.subscribe("me/answers") as answers:
            ask = Requests(broker, answers)
            ask("enable", controller="table", axis=1)
            assert ask("jog", controller="table", axis=1, velocity=20.0, lease_s=5.0)["ok"] is None
            assert "lease_s" in ask("jog", controller="table", axis=1, velocity=20.0)["error"]["message"]
        until(lambda: position(broker) > 0, "it moves")
        broker.kill()
        with ModbusTcpClient("127.0.0.1", port=points["tcp"]["port"]) as master:
            assert not master.write_register(5, 9, device_id=1).isError()
        broker.start()
        online(broker)
        until(lambda: broker.retained(f"{BASE}/table/M1")["velocity"] == 0.0, "the jog has ended with the broker", 3.0)
        assert broker.retained(f"{BASE}/table/M1")["enabled"] is True, "all that the broker has forgotten is there again"
        until(lambda: broker.retained(f"{BASE}/table/registers")["USER_REGISTER[5]"] == 9, "with what changed meanwhile")
        told = (tmp_path / "output").read_text()
        assert f"[gateway.mqtt]: broker 127.0.0.1:{broker.port}: the connection was lost; it is tried again" in told
        assert told.count("tried again") <= 2, "each reason once"
        assert "connected again" in told


def test_a_broker_that_falls_silent_is_given_up(broker: Mosquitto, tmp_path: Path) -> None:
    text = WORLD.format(port=broker.port).replace('interval = "20ms"', 'interval = "20ms"\nkeep_alive = "1s"')
    with served(text, tmp_path, is_quiet=False):
        online(broker)
        broker.process.send_signal(signal.SIGSTOP)
        try:
            until(lambda: "tried again" in (tmp_path / "output").read_text(), "it is noticed")
        finally:
            broker.process.send_signal(signal.SIGCONT)
        until(lambda: "connected again" in (tmp_path / "output").read_text(), "it is tried again")
        online(broker)
        with broker.subscribe("me/answers") as answers:
            assert Requests(broker, answers)("stop", controller="table")["ok"] == {"program": "stopped"}
        assert broker.retained(f"{BASE}/online") is True, "the will of the session before came before this one"


def test_the_broker_tells_of_a_gateway_that_is_lost(broker: Mosquitto, tmp_path: Path) -> None:
    (tmp_path / "hall.toml").write_text(WORLD.format(port=broker.port))
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(tmp_path)}
    process = subprocess.Popen([STEPTWIN, "up", "hall.toml"], cwd=tmp_path, env=environment, stdout=subprocess.DEVNULL)
    try:
        online(broker)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == -signal.SIGKILL, "it could not say so itself"
    until(lambda: broker.retained(f"{BASE}/online") is False, "its will is published")


def test_two_worlds_do_not_share_topics(broker: Mosquitto, tmp_path: Path) -> None:
    unnamed = WORLD.format(port=broker.port).replace('[world]\n    name = "plant"\n', "")
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
    with served(unnamed, tmp_path / "one") as first:
        assert first["mqtt"]["topic"] == "steptwin/hall", "by its file, because it has no name"
        online(broker, "steptwin/hall")
        with served(unnamed, tmp_path / "two", is_quiet=False):
            told = "another gateway is online at steptwin/hall"
            until(lambda: told in (tmp_path / "two/output").read_text(), "the second gives way")
            with broker.subscribe("me/answers") as answers:
                ask = Requests(broker, answers, "steptwin/hall")
                assert ask("enable", controller="table", axis=1)["ok"] is None
                assert [one["correlation"] for one in answers.look()] == ["r1"], "one of them has done it"
        assert broker.retained("steptwin/hall/online") is True


def test_roles_by_token(broker: Mosquitto, tmp_path: Path) -> None:
    tokens_file(tmp_path, "operator press 0123456789abcdef\n")
    with served(WORLD.replace('role = "engineer"', 'tokens = "tokens"').format(port=broker.port), tmp_path):
        online(broker)
        with broker.subscribe("me/answers") as answers:
            ask = Requests(broker, answers)
            enable = {"controller": "table", "axis": 1}
            assert "is for the role operator" in ask("enable", **enable)["error"]["message"]
            assert ask("enable", **enable, token="wrong")["error"]["message"] == "wrong token"
            assert ask("enable", **enable, token="0123456789abcdef")["ok"] is None
            assert ask("stop", controller="table")["ok"] == {"program": "stopped"}
            power = ask("power_cycle", controller="table", token="0123456789abcdef")
            assert "is for the role engineer; press has the role operator" in power["error"]["message"]


def test_tls_with_certificates_and_a_password(require_peer: Callable[[str], str], tmp_path: Path) -> None:
    authority = Authority(tmp_path)
    for name in ("broker", "gateway", "client"):
        authority.sign(name)
    passwords = tmp_path / "passwords"
    subprocess.run(["mosquitto_passwd", "-c", "-b", str(passwords), "hall", "a secret"], check=True, capture_output=True)
    (tmp_path / "password").write_text("a secret\n")
    options = (
        *("cafile ca.pem", "certfile broker.pem", "keyfile broker.key", "require_certificate true"),
        *("allow_anonymous false", "password_file passwords"),
    )
    keys = 'tls = true\nca = "ca.pem"\nuser = "hall"\n'
    good = keys + 'certificate = "gateway.pem"\nkey = "gateway.key"\npassword_file = "password"\n'
    with Mosquitto(require_peer, tmp_path, *options) as broker:
        files = ("--cafile", "ca.pem", "--cert", "client.pem", "--key", "client.key")
        paths = [word if word.startswith("--") else str(tmp_path / word) for word in files]
        broker.client_options = (*paths, "-u", "hall", "-P", "a secret")
        text = WORLD.format(port=broker.port)
        with served(text + good, tmp_path) as points:
            assert points["mqtt"]["url"].startswith("mqtts://")
            online(broker)
        (tmp_path / "password").write_text("another secret\n")
        with served(text + good, tmp_path, is_quiet=False):
            until(lambda: "not authorized" in (tmp_path / "output").read_text(), "it is told")
        with served(text + good.replace('ca = "ca.pem"\n', ""), tmp_path, is_quiet=False):
            until(lambda: "certificate verify failed" in (tmp_path / "output").read_text(), "it is told")
        assert broker.retained(f"{BASE}/online") is False


def test_commands_over_a_broker_are_in_the_audit_log(broker: Mosquitto, tmp_path: Path) -> None:
    """Who, from where, what and its outcome; who looks is not recorded."""
    tokens_file(tmp_path, "operator anna letmein-0123456789\nviewer screen lookonly-0123456789\n")
    text = WORLD.replace('role = "engineer"', 'tokens = "tokens"').format(port=broker.port)
    with served(text, tmp_path, "--audit", "audit.jsonl"):
        online(broker)
        with broker.subscribe("me/answers") as answers:
            ask = Requests(broker, answers)
            assert "ok" in ask("enable", controller="table", axis=1, token="letmein-0123456789")
            assert ask("move", controller="table", axis=9, to=1, token="letmein-0123456789")["error"]["code"] == "misuse"
            assert ask("move", controller="table", axis=1, to=1, token="lookonly-0123456789")["error"]["code"] == "refusal"
            assert "ok" in ask("read", points=["table.M1.position"], token="lookonly-0123456789")
    entries = [json.loads(line) for line in (tmp_path / "audit.jsonl").read_text().splitlines()]
    assert [(one["viewer"], one["role"], one["do"], one["outcome"]) for one in entries] == [
        ("anna (MQTT)", "operator", "enable", "done"),
        ("anna (MQTT)", "operator", "move", "misuse"),
        ("screen (MQTT)", "viewer", "move", "refusal"),
    ]
    assert entries[0]["fields"] == {"controller": "table", "axis": 1}
    assert "letmein" not in (tmp_path / "audit.jsonl").read_text()


def test_two_worlds_without_names_do_not_meet(broker: Mosquitto, tmp_path: Path) -> None:
    """Their topics have the names of their files."""
    text = WORLD.format(port=broker.port).replace('name = "plant"', "seed = 1")
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / f"{name}.toml").write_text(text)
    with running(tmp_path / "one", "up", "one.toml") as first, running(tmp_path / "two", "up", "two.toml") as second:
        assert [points["mqtt"]["topic"] for points in (first, second)] == ["steptwin/one", "steptwin/two"]
        for base in ("steptwin/one", "steptwin/two"):
            online(broker, base)
        with broker.subscribe("me/answers") as answers:
            for base in ("steptwin/one", "steptwin/two"):
                assert "ok" in Requests(broker, answers, base)("enable", controller="table", axis=1)
            until(lambda: broker.retained("steptwin/one/table/M1")["enabled"], "it is on")
    assert broker.retained("steptwin/two/online") is False


def test_a_certificate_of_the_gateway_that_has_expired_is_told_and_a_new_one_is_taken(
    require_peer: Callable[[str], str], tmp_path: Path
) -> None:
    authority = Authority(tmp_path)
    authority.sign("broker")
    authority.sign("client")
    authority.sign("gateway", days=(-3, -1))
    options = ("cafile ca.pem", "certfile broker.pem", "keyfile broker.key", "require_certificate true", "allow_anonymous true")
    keys = 'tls = true\nca = "ca.pem"\ncertificate = "gateway.pem"\nkey = "gateway.key"\n'
    with Mosquitto(require_peer, tmp_path, *options) as broker:
        broker.client_options = (
            "--cafile",
            str(tmp_path / "ca.pem"),
            "--cert",
            str(tmp_path / "client.pem"),
            "--key",
            str(tmp_path / "client.key"),
        )
        with served(WORLD.format(port=broker.port) + keys, tmp_path, is_quiet=False):
            until(lambda: "gateway.pem has expired on " in (tmp_path / "output").read_text(), "it is told")
            authority.sign("gateway")
            online(broker)
        assert "connected again" in (tmp_path / "output").read_text()


def test_home_assistant_finds_the_controllers(broker: Mosquitto, tmp_path: Path) -> None:
    with served(WORLD.format(port=broker.port) + 'discovery = "homeassistant"\n', tmp_path):
        online(broker)
        found = broker.retained("homeassistant/device/steptwin_plant_table/config")
        axis = found["cmps"]["M1_position"]
        assert (axis["p"], axis["unit_of_meas"], axis["stat_t"]) == ("sensor", "imp", f"{BASE}/table/M1")
        assert found["cmps"]["M1_moving"]["p"] == "binary_sensor"
        button = found["cmps"]["stop_M1"]
        with broker.subscribe(f"{BASE}/answer") as answers:
            broker.publish(button["cmd_t"], button["pl_prs"])
            answers.wait_for(lambda one: one["payload"]["ok"] == {"program": "stopped"}, "it stops")


def test_a_bridge_shows_a_device(broker: Mosquitto, tmp_path: Path) -> None:
    device = ("serve", "mic488", "--tcp", "127.0.0.1:0")
    with running(tmp_path, *device) as points:
        (tmp_path / "cell.toml").write_text(
            f'[[device]]\nname = "table"\naddress = "127.0.0.1:{points["tcp"]["port"]},kind=mic488"\n'
            f'[gateway.mqtt]\nbroker = "127.0.0.1:{broker.port}"\ninterval = "20ms"\nrole = "operator"\n'
        )
        with running(tmp_path, "bridge", "cell.toml") as bridge:
            base = "steptwin/cell"
            assert bridge["mqtt"]["topic"] == base
            online(broker, base)
            with broker.subscribe("me/answers") as answers, broker.subscribe(f"{base}/table/M1") as axis:
                ask = Requests(broker, answers, base)
                assert ask("enable", controller="table", axis=1)["ok"] is None
                assert ask("move", controller="table", axis=1, to=40.0)["ok"] is None
                axis.wait_for(lambda one: one["payload"]["position"] == 40.0, "it arrives")
