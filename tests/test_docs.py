"""Pages compared with what they speak of."""

from __future__ import annotations

import re
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

from steptwin.simulation.describe.tables import written_tables

ROOT = Path(__file__).parent.parent
ROW = re.compile(r"^\| ((?:MIC|WBC|M)-\d+) \|", re.MULTILINE)
PREFIXES = ("MIC", "WBC", "M")
LOOKED_UP = ("reference/", "elements/", "adr/", "assumptions.md", "control.md", "studio-protocol.md")
"""Pages and folders in which one looks something up; all others are read."""
MOST_WORDS = 1200


def rows(prefix: str) -> list[str]:
    page = (ROOT / "docs/assumptions.md").read_text()
    return [name for name in ROW.findall(page) if name.startswith(f"{prefix}-")]


@pytest.mark.parametrize("prefix", PREFIXES)
def test_interpretations_are_in_order_and_listed_once(prefix: str) -> None:
    listed = [int(name.removeprefix(f"{prefix}-")) for name in rows(prefix)]
    assert listed
    # Decisions of the reference begin again at 40, so numbers may be left out.
    assert listed == sorted(set(listed))


@pytest.mark.parametrize("prefix", PREFIXES)
def test_interpretations_cited_in_the_code_are_explained_to_users(prefix: str) -> None:
    cited = {name for file in (ROOT / "src").rglob("*.py") for name in re.findall(rf"\b{prefix}-\d+\b", file.read_text())}
    assert cited <= set(rows(prefix))


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md"])
def test_links_into_the_repository_lead_somewhere(page: str) -> None:
    targets = [target for target in re.findall(r"\]\(([^)#]+)", (ROOT / page).read_text()) if ":" not in target]
    assert targets
    assert [target for target in targets if not (ROOT / target).exists()] == []


def exists(reference: str) -> bool:
    """Whether ``steptwin.package.module.Name.attribute`` is a module or leads to a name in one."""
    module, *names = reference.split(".")
    while names and find_spec(f"{module}.{names[0]}") is not None:
        module = f"{module}.{names.pop(0)}"
        if not hasattr(import_module(module), "__path__"):
            break
    found: object = import_module(module)
    for name in names:
        if name in getattr(found, "__annotations__", {}):
            return True
        if not hasattr(found, name):
            return False
        found = getattr(found, name)
    return True


def test_names_in_docstrings_exist() -> None:
    sources = sorted((ROOT / "src").rglob("*.py"))
    cited = {name: file.name for file in sources for name in re.findall(r"`(steptwin(?:\.\w+)+)`", file.read_text())}
    assert len(cited) > 100
    assert {name: file for name, file in cited.items() if not exists(name)} == {}
    assert not exists("steptwin.controller.WirePort")
    assert not exists("steptwin.room.Port")


def test_keys_and_signals_of_the_pages_of_elements_exist() -> None:
    """Those in tables with *key* in their head, of which the description has one as a key, or an element as a signal."""
    keys = {key.name for rows in written_tables().values() for key in rows}
    known = keys | set(re.findall(r"`(\w+)`", (ROOT / "docs/elements/signals.md").read_text()))
    pages = [path for folder in ("elements", "space", "motors") for path in (ROOT / "docs" / folder).glob("*.md")]
    tables = [
        (path.name, table) for path in pages for table in re.findall(r"^\| key.*\n(?:^\|.*\n)+", path.read_text(), re.MULTILINE)
    ]
    named = {
        (page, name)
        for page, table in tables
        for row in table.splitlines()
        for name in re.findall(r"`(\w+)[^`]*`", row.split("|")[1])
    }
    assert len(named) > 100
    assert {(page, name) for page, name in named if name not in known} == set()


def test_pages_that_are_read_are_short() -> None:
    pages = {path.relative_to(ROOT / "docs").as_posix(): path for path in (ROOT / "docs").rglob("*.md")}
    words = {name: len(path.read_text().split()) for name, path in pages.items() if not name.startswith(LOOKED_UP)}
    assert {name: count for name, count in words.items() if count > MOST_WORDS} == {}
