"""The examples of docs/studio/rest.md, against a demo machine."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import httpx
import pytest
from pages import only
from tests.conftest import until
from tests.studio.conftest import Process

PAGE = (Path(__file__).parents[2] / "docs/studio/rest.md").read_text("utf-8")
DEMO = "http://127.0.0.1:8488"
Start = Callable[..., Process]


def block(language: str, first: str) -> str:
    blocks = re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    return only([text for text in blocks if text.startswith(first)], f"blocks in {language}")


def table(studio: Process) -> float:
    return httpx.get(f"{studio.url}/api/points?names=table.M1.position").json()["ok"][0]["value"]


def test_curl(start_studio: Start) -> None:
    curl = shutil.which("curl")
    if curl is None:
        pytest.skip("curl is missing")
    studio = start_studio("--demo")
    answers = []
    for line in block("sh", "curl").splitlines():
        ran = subprocess.run(line.replace(DEMO, studio.url), shell=True, capture_output=True, text=True, check=True)
        answers.append(json.loads(ran.stdout))
    assert [one["point"] for one in answers[0]["ok"]] == ["table.M1.position", "table.M1.status"]
    assert answers[1]["ok"] is None
    assert answers[3]["ok"] == {"controllers": ["table", "drum", "shuttle"], "scripts": ["event-1"]}


def test_curl_with_the_token(start_studio: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if shutil.which("curl") is None:
        pytest.skip("curl is missing")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / ".local/state"))
    studio = start_studio("--with-token")
    script = block("sh", "token=").replace(DEMO, studio.url)
    environment = {**os.environ, "HOME": str(tmp_path)}
    ran = subprocess.run(script, shell=True, capture_output=True, text=True, check=True, env=environment)
    assert json.loads(ran.stdout)["ok"][0]["point"] == "table.M1.position"


def test_javascript(start_studio: Start) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is missing")
    studio = start_studio("--demo")
    source = block("javascript", "const studio").replace(DEMO, studio.url)
    ran = subprocess.run([node, "--input-type=module", "-e", source], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    assert "table.M1.position" in ran.stdout
    until(lambda: table(studio) == 20.0, "the axis is there")
