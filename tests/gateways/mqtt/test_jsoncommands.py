"""Commands of the JSON face: who may give them, and each once."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest
from gateway_rig import GatewayWorld
from tokens import tokens_file

from steptwin.access.audit import Audit
from steptwin.errors import Misuse
from steptwin.gateways.kinds import read_gateways
from steptwin.gateways.mqtt.jsoncommands import REPEATED_S, Doorkeeper, JsonCommands, JsonRequest
from steptwin.gateways.mqtt.options import MqttSpec
from steptwin.simulation.describe.description import read_world

WORLD = '[[mic488]]\nname = "table"\n'
OPERATOR = "0123456789abcdef"


def mqtt(keys: str = "") -> MqttSpec:
    (found,) = read_gateways(read_world("hall.toml", f"{WORLD}[gateway.mqtt]\n{keys}").text)
    assert isinstance(found, MqttSpec)
    return found


class Rig:
    def __init__(self, folder: Path, keys: str = 'role = "engineer"') -> None:
        self.world = GatewayWorld(WORLD)
        self.now = 0.0
        tokens_file(folder, f"operator press {OPERATOR}\n")
        door = Doorkeeper(mqtt(keys), folder)
        self.commands = JsonCommands(self.world, door, lambda: self.now)

    def ask(self, payload: Any, *, retained: bool = False, sender: object = "me") -> Any:
        data = payload if isinstance(payload, bytes) else json.dumps(payload).encode()
        return asyncio.run(self.commands.answer(JsonRequest(data, retained, (sender,))))


ENABLE = {"do": "enable", "controller": "table", "axis": 1}


def test_commands_are_in_the_audit_log(tmp_path: Path) -> None:
    """Each that was given, with its outcome; a jog once; who looks not."""
    rig = Rig(tmp_path, 'tokens = "tokens"')
    audit = Audit(lambda: "2026-01-01T00:00:00.000+00:00")
    rig.world.audit = lambda who, do, fields, outcome: audit.add(who, 5, do, fields, outcome)
    rig.ask({**ENABLE, "token": OPERATOR})
    rig.ask(ENABLE)
    rig.ask({"do": "state", "controller": "table"})
    rig.ask({"do": "move", "controller": "table", "axis": 9, "to": 1, "token": OPERATOR})
    rig.ask({"do": "stop", "controller": "table"})

    async def jog() -> None:
        request = {"do": "jog", "controller": "table", "axis": 1, "velocity": 5.0, "lease_s": 1.0, "token": OPERATOR}
        for _ in range(3):
            await rig.commands.answer(JsonRequest(json.dumps(request).encode(), is_retained=False, sender=("me",)))
        rig.commands.lost()

    asyncio.run(jog())
    found = [(one.viewer, one.role, one.do, one.outcome) for one in audit.last(100)]
    assert found == [
        ("press (MQTT)", "operator", "enable", "done"),
        ("a client without token (MQTT)", "viewer", "enable", "refusal"),
        ("press (MQTT)", "operator", "move", "misuse"),
        ("a client without token (MQTT)", "viewer", "stop", "done"),
        ("press (MQTT)", "operator", "jog", "done"),
    ]
    assert audit.last(100)[0].fields == {"controller": "table", "axis": 1}


def enabled(rig: Rig) -> list[object]:
    return [one for one in rig.world.done if type(one).__name__ == "Enable"]


def test_the_same_request_is_done_once(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    first = rig.ask({**ENABLE, "id": 1})
    assert rig.ask({**ENABLE, "id": 1}) == first
    assert len(enabled(rig)) == 1
    rig.ask({**ENABLE, "id": 1}, sender="another client counts from 1, too")
    rig.ask({**ENABLE, "id": 2})
    rig.ask(ENABLE)
    rig.ask(ENABLE)
    assert len(enabled(rig)) == 5
    rig.now += REPEATED_S + 1
    rig.ask({**ENABLE, "id": 1})
    assert len(enabled(rig)) == 6


def test_a_stop_is_always_done(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    for _ in range(3):
        rig.ask({"do": "stop", "controller": "table", "id": 7})
    assert len(rig.world.done) == 3


def test_a_request_that_comes_again_while_it_is_done_is_not_done_again(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    request = JsonRequest(json.dumps({**ENABLE, "id": 1}).encode(), is_retained=False, sender=("me",))

    async def both() -> list[Any]:
        return list(await asyncio.gather(rig.commands.answer(request), rig.commands.answer(request)))

    asyncio.run(both())
    assert len(enabled(rig)) == 1


@pytest.mark.parametrize(
    ("keys", "role"),
    [
        ("", "viewer"),
        ('tokens = "tokens"', "viewer"),
        ('role = "engineer"', "engineer"),
        ('role = "operator"\ntokens = "tokens"', "operator"),
    ],
)
def test_the_role_of_those_without_a_token(keys: str, role: str, tmp_path: Path) -> None:
    rig = Rig(tmp_path, keys)
    taken = [name for name, request in REQUESTS.items() if "ok" in rig.ask(request)]
    assert taken == list(REQUESTS)[: ["viewer", "operator", "engineer"].index(role) + 1]


REQUESTS = {
    "viewer": {"do": "stop", "controller": "table"},
    "operator": ENABLE,
    "engineer": {"do": "power_cycle", "controller": "table"},
}


def test_tokens_give_roles_and_are_not_seen_by_the_subject(tmp_path: Path) -> None:
    rig = Rig(tmp_path, 'tokens = "tokens"')
    assert "ok" in rig.ask({**ENABLE, "token": OPERATOR})
    for wrong in ("", "x", 7, None, ["a"]):
        assert "error" in rig.ask({**ENABLE, "token": wrong})
    assert len(enabled(rig)) == 1


@pytest.mark.parametrize(
    ("payload", "code", "text"),
    [
        (b"\xff\x00", "misuse", "a request is a line of JSON"),
        (b"[]", "misuse", "a request is a line of JSON"),
        (b"[" * 100_000, "misuse", "a request is a line of JSON"),
        ({"do": "subscribe"}, "refusal", "subscribe is not taken over MQTT"),
        ({"do": "move", "controller": "table", "axis": 1, "to": 1, "lease_s": 1}, "misuse", "lease_s is for a jog only"),
        ({"do": "jog", "controller": "table", "axis": 1, "velocity": 5}, "misuse", "a jog needs lease_s"),
        ({"do": "jog", "controller": "table", "axis": 1, "velocity": 5, "lease_s": True}, "misuse", "a jog needs lease_s"),
        ({"do": "jog", "controller": "table", "axis": 1, "velocity": 5, "lease_s": 60}, "misuse", "permitted are 0.1 to 5 s"),
        ({"do": "stop", "controller": "tabel"}, "misuse", "tabel"),
    ],
)
def test_what_is_wrong_is_answered(payload: Any, code: str, text: str, tmp_path: Path) -> None:
    error = Rig(tmp_path).ask(payload)["error"]
    assert error["code"] == code
    assert text in error["message"]


def test_retained_commands_are_refused(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    assert "not retained" in rig.ask({**ENABLE, "id": "x"}, retained=True)["error"]["message"]
    assert rig.world.done == []


def test_a_file_of_tokens_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(Misuse, match="no-tokens"):
        Doorkeeper(mqtt('tokens = "no-tokens"'), tmp_path)


def test_what_is_no_command_is_in_the_audit_log(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    logged: list[tuple[str, str]] = []
    rig.world.audit = lambda who, do, fields, outcome: logged.append((do, outcome))
    for wrong in ({"to": "NaN"}, {"too": 5.0}, {"axis": None}):
        rig.ask({"do": "move", "controller": "table", "axis": 1, **wrong})
    rig.ask({"do": "fly"})
    assert logged == [("move", "misuse")] * 3 + [("fly", "misuse")]
