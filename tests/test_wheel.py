"""The wheel, installed as users install it: everything is in it, and nothing of the clone is needed."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SOURCE = ROOT / "src/steptwin"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("dist")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(directory)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (found,) = directory.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def environment(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The programs of an environment with the wheel, and what it depends on from the environment of the tests."""
    directory = tmp_path_factory.mktemp("environment")
    venv.create(directory, with_pip=True, symlinks=os.name != "nt")
    programs = directory / ("Scripts" if os.name == "nt" else "bin")
    pip = [programs / "python", "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", wheel]
    subprocess.run(pip, check=True)
    paths = sysconfig.get_paths(vars={"base": str(directory), "platbase": str(directory)})
    # The path file of the clone in there is not followed from here.
    Path(paths["purelib"], "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", "utf-8")
    return programs


def run(program: Path, *arguments: str | Path, directory: Path) -> str:
    surroundings = {name: value for name, value in os.environ.items() if name not in {"PYTHONPATH", "VIRTUAL_ENV"}}
    ended = subprocess.run(
        [program, *arguments], cwd=directory, env=surroundings, capture_output=True, text=True, encoding="utf-8", check=False
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout


def test_the_wheel_has_every_file_and_no_other(wheel: Path) -> None:
    """Recipes for contributors, which stand beside their rooms, are no part of it."""
    with zipfile.ZipFile(wheel) as archive:
        packed = {name for name in archive.namelist() if not name.partition("/")[0].endswith(".dist-info")}
    files = (
        path for path in SOURCE.rglob("*") if path.is_file() and "__pycache__" not in path.parts and path.name != "README.md"
    )
    assert packed == {path.relative_to(SOURCE.parent).as_posix() for path in files}


def test_the_installed_command_runs_a_world_and_draws_its_timeline(environment: Path, tmp_path: Path) -> None:
    where = run(environment / "python", "-c", "import steptwin; print(steptwin.__file__)", directory=tmp_path)
    assert Path(where.strip()).is_relative_to(environment.parent)
    world = ROOT / "examples/worlds/feeder.toml"
    assert "wrote t.html" in run(environment / "steptwin", "run", world, "--for", "2s", "--trace", "t.html", directory=tmp_path)
    page = (tmp_path / "t.html").read_text("utf-8")
    for part in ("timeline.css", "model.js", "draw.js", "timeline.js"):
        assert (SOURCE / "files/export/page" / part).read_text("utf-8").strip() in page


def test_the_fixtures_are_there_without_any_setting(environment: Path, tmp_path: Path) -> None:
    (tmp_path / "test_panel.py").write_text(
        "def test_a_move(mic488):\n"
        "    mic488.driver.enable(1)\n"
        "    mic488.driver.axis(1).move_to(10)\n"
        "    assert mic488.driver.axis(1).wait().ok\n",
        "utf-8",
    )  # fmt: skip
    assert "1 passed" in run(environment / "python", "-m", "pytest", "-q", "-p", "no:cacheprovider", directory=tmp_path)
