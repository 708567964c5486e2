"""Libraries that are missing: the message names those of the extra, and the commands that install them."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from importlib.metadata import Distribution, PackageNotFoundError
from pathlib import Path

import pytest

from steptwin.extras import libraries_of, missing


def names(libraries: Iterable[str]) -> set[str]:
    """Without versions: those of the package that is installed may be older."""
    return {re.split("[<>=!~]", one)[0] for one in libraries}


def test_the_libraries_of_an_extra_are_those_of_the_package() -> None:
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    extras.pop("all")
    assert {extra: names(libraries_of(extra)) for extra in extras} == {extra: names(all_of) for extra, all_of in extras.items()}


def test_where_there_are_modules_only_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def requires(name: str) -> None:
        raise PackageNotFoundError(name)

    monkeypatch.setattr("importlib.metadata.requires", requires)
    assert str(missing("this", "lsp")).startswith("this needs the extra lsp, which could not be imported")


def test_the_library_whose_internal_classes_are_used_has_the_bounds_of_the_version_that_is_tried() -> None:
    root = Path(__file__).parents[1]
    tried = re.search(r"^asyncua==(\d+)\.(\d+)", (root / "requirements/dev.txt").read_text(), re.MULTILINE)
    assert tried is not None
    major, minor = map(int, tried.groups())
    extras = tomllib.loads((root / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert f"asyncua>={major}.{minor},<{major}.{minor + 1}" in extras["opcua"]


def test_all_is_every_extra() -> None:
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    (named,) = extras.pop("all")
    assert named == f"steptwin[{','.join(extras)}]"


def test_what_is_missing_is_named_with_the_command_that_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    here = {"steptwin", "numpy", "uvicorn", "websockets", "pygls"}

    def installed(name: str) -> Distribution:
        if name not in here:
            raise PackageNotFoundError(name)
        return Distribution.from_name(name)

    monkeypatch.setattr("importlib.metadata.distribution", installed)
    assert str(missing("the studio", "studio")) == (
        "the studio needs fastapi, which is not installed: "
        "in a clone 'make extras' installs what is missing, elsewhere pip install 'steptwin[studio]'"
    )
    assert str(missing("it", "history")).startswith("it needs alembic, psycopg and sqlalchemy, which are not installed: ")
    assert str(missing("the editor server", "lsp")).startswith("the editor server needs pygls, which could not be imported: ")
