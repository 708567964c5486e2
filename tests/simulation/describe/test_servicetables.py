"""Tables of services in descriptions: the simulation keeps them, their owners check them."""

from __future__ import annotations

import subprocess
import sys

import pytest

from steptwin.errors import Misuse
from steptwin.simulation.describe.servicetables import SERVICE_TABLES, SERVICES, ServiceTable, register

TEXT = """
[[mic488]]
name = "table"
[gateway.mqtt]
brokr = "a:1"
[history]
interval = 1
"""
ALONE = f"""
import sys
from steptwin.simulation.describe.description import describe
spec = describe("hall.toml", {TEXT!r})
assert spec.text.findings == [], spec.text.findings
assert not [name for name in sys.modules if name.startswith(("steptwin.gateways", "steptwin.history"))]
mqtt, history = ("gateway", "mqtt", "brokr"), ("history", "interval")
print(spec.text.data["gateway"], spec.text.line(mqtt), spec.text.data["history"], spec.text.line(history))
"""
FACES = (
    "campaign.reading",
    "dap.launch",
    "languages.run_world",
    "languages.world",
    "live.bridge",
    "live.running",
    "live.studio.start",
    "testing.world",
)
"""Modules that read descriptions for users. `steptwin lsp` and `up --keys` do it when they run."""


def printed(code: str) -> str:
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    return ran.stdout.strip()


def test_the_simulation_alone_keeps_them_with_their_places() -> None:
    assert printed(ALONE) == "{'mqtt': {'brokr': 'a:1'}} 5 {'interval': 1} 7"


@pytest.mark.parametrize("face", FACES)
def test_those_who_read_descriptions_for_users_check_them(face: str) -> None:
    code = (
        f"import steptwin.{face}\nfrom steptwin.simulation.describe.servicetables import SERVICE_TABLES\nprint(*SERVICE_TABLES)"
    )
    assert printed(code) == " ".join(SERVICES)


def test_another_table_is_refused() -> None:
    with pytest.raises(Misuse, match="'cloud' is not one of history, gateway"):
        register(ServiceTable(name="cloud", check=print))
    assert "cloud" not in SERVICE_TABLES
