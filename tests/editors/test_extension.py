"""The extension for VS Code agrees with the command that it starts."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from steptwin import __version__
from steptwin.dap.launch import ARGUMENTS
from steptwin.diagnostics import Severity
from steptwin.lsp.answers import TokenKind
from steptwin.lsp.editorsession import EditorSession
from steptwin.lsp.languages import LANGUAGES
from steptwin.m1486.variants import VARIANTS

ROOT = Path(__file__).parents[2]
EXTENSION = ROOT / "editors" / "vscode"
PACKAGE = json.loads((EXTENSION / "package.json").read_text("utf-8"))
CONTRIBUTED = PACKAGE["contributes"]
(DEBUGGER,) = CONTRIBUTED["debuggers"]


def test_the_version_is_that_of_the_command() -> None:
    assert PACKAGE["version"] == __version__


def test_the_versions_of_its_packages_are_exact_and_the_lock_file_names_no_place() -> None:
    assert all(version[0].isdigit() for version in PACKAGE["devDependencies"].values())
    packages = json.loads((EXTENSION / "package-lock.json").read_text("utf-8"))["packages"].values()
    assert not any("resolved" in package for package in packages)


def test_the_arguments_of_launch_are_those_of_the_adapter() -> None:
    properties = DEBUGGER["configurationAttributes"]["launch"]["properties"]
    types = {name: one["type"] for name, one in properties.items()}
    shown = {name: "boolean" if kind is bool else "string" for name, kind in ARGUMENTS.items()}
    assert types == {name: kind for name, kind in shown.items() if name != "noDebug"}  # which VS Code gives by itself
    assert properties["variant"]["enum"] == [variant.name for variant in VARIANTS]


def test_the_languages_are_those_of_the_server() -> None:
    languages = {one["id"] for one in CONTRIBUTED["languages"]}
    assert languages == {"wbc", "m1486"} == set(DEBUGGER["languages"]) <= set(LANGUAGES)
    kinds = {kind.value for kind in TokenKind}
    assert all(set(one["scopes"]) <= kinds for one in CONTRIBUTED["semanticTokenScopes"])


def _snippets() -> Iterator[Any]:
    for entry in CONTRIBUTED["snippets"]:
        for name, snippet in json.loads((EXTENSION / entry["path"]).read_text("utf-8")).items():
            yield pytest.param(entry["language"], "\n".join(snippet["body"]), id=f"{entry['language']}: {name}")


@pytest.mark.parametrize(("language", "body"), list(_snippets()))
def test_a_snippet_with_its_defaults_is_a_program_without_errors(language: str, body: str) -> None:
    chosen = re.sub(r"\$\{\d+\|([^,|]*)[^}]*\}", r"\1", body)
    text = re.sub(r"\$\{\d+:([^}]*)\}", r"\1", chosen).replace("$0", "")
    assert "$" not in text
    if language == "m1486" and "[" not in text:  # the program around it
        text = "[\n@1\nR\n{}J1\n{}\n]".format("'10\n" if "@10" in text else "", text)
    session = EditorSession()
    session.open("file:///x", language, 1, f"{text}\n")
    analysis = session.analysis("file:///x")
    assert analysis is not None
    assert [str(found) for found in analysis.diagnostics() if found.severity is Severity.ERROR] == []


def test_what_it_contributes_is_registered(run_node: Callable[..., str]) -> None:
    registered = json.loads(run_node("tests/activate.mjs"))
    assert set(registered["registerCommand"]) == {one["command"] for one in CONTRIBUTED["commands"]}
    assert registered["registerTreeDataProvider"] == [view["id"] for view in CONTRIBUTED["views"]["debug"]]
    assert set(registered["registerDebugAdapterDescriptorFactory"]) == {DEBUGGER["type"]}
    assert registered["registerInlineValuesProvider"] == [DEBUGGER["languages"]]


@pytest.mark.parametrize("tests", ["names", "found"])
def test_what_its_modules_compute(tests: str, run_node: Callable[..., str]) -> None:
    """Which expressions have inline values, and whether a command is there."""
    done = run_node(f"tests/{tests}.test.mjs", "", "--test")
    assert re.search(r"^\S+ fail 0$", done, re.MULTILINE), done


def test_the_package_has_everything_that_it_names(node: Path) -> None:
    subprocess.run([sys.executable, str(ROOT / "studio-web/build.py"), "vsix", str(EXTENSION)], check=True, capture_output=True)
    with zipfile.ZipFile(ROOT / "build" / "steptwin.vsix") as packed:
        names = set(packed.namelist())
        licences = packed.read("extension/dist/licences.txt").decode()
    named = [PACKAGE["main"], *(one["configuration"] for one in CONTRIBUTED["languages"])]
    named += [one["path"] for one in (*CONTRIBUTED["grammars"], *CONTRIBUTED["snippets"])]
    assert {f"extension/{path.removeprefix('./')}" for path in named} <= names
    assert not any("node_modules" in name or "/src/" in name or "/tests/" in name for name in names)
    assert "vscode-languageclient" in licences
