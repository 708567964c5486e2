"""Libraries that are missing: the message names those of the extra, and the commands that install them."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from pathlib import Path

from steptwin.extras import libraries_of, missing


def names(libraries: Iterable[str]) -> set[str]:
    """Without versions: those of the package that is installed may be older."""
    return {re.split("[<>=!~]", one)[0] for one in libraries}


def test_the_libraries_of_an_extra_are_those_of_the_package() -> None:
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    assert {extra: names(libraries_of(extra)) for extra in extras} == {extra: names(all_of) for extra, all_of in extras.items()}


def test_the_library_whose_internal_classes_are_used_has_the_bounds_of_the_version_that_is_tried() -> None:
    root = Path(__file__).parents[1]
    tried = re.search(r"^asyncua==(\d+)\.(\d+)", (root / "requirements/dev.txt").read_text(), re.MULTILINE)
    assert tried is not None
    major, minor = map(int, tried.groups())
    extras = tomllib.loads((root / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert f"asyncua>={major}.{minor},<{major}.{minor + 1}" in extras["opcua"]


def test_what_is_missing_is_named_with_the_command_that_installs_it() -> None:
    assert str(missing("the studio", ["fastapi", "uvicorn"])) == (
        "the studio needs fastapi and uvicorn, which are not installed: "
        "in a clone 'make extras' installs them, elsewhere 'pip install fastapi uvicorn'"
    )
    assert str(missing("the editor server", ["pygls"])).endswith("installs it, elsewhere 'pip install pygls'")
    text = str(missing("it", ["aiomqtt<3", "psycopg[binary]", "numpy"]))
    assert text.startswith("it needs aiomqtt, psycopg and numpy, which are not installed: ")
    assert text.endswith("""elsewhere 'pip install "aiomqtt<3" "psycopg[binary]" numpy'""")


def test_no_message_and_no_page_installs_by_a_name_that_no_index_has() -> None:
    root = Path(__file__).parents[1]
    files = [*(root / "src/steptwin").rglob("*.py"), *root.glob("docs/*.md"), root / "README.md"]
    assert [file.name for file in files if "install 'steptwin[" in file.read_text() and file.name != "install.md"] == []
