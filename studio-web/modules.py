"""Lists the modules that the studio inside a page can reach, and its world, in a file: ``python studio-web/modules.py FILE``.

Beside it, with the suffix ``.d``, is a rule for make: the site is older than a file that is in it.
"""

from __future__ import annotations

import importlib.util
import json
import sys
from importlib.metadata import files, packages_distributions, version
from pathlib import Path

import grimp

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src"
HOSTS = ("steptwin.inpage.host", "steptwin.inpage.devices", "steptwin.inpage.editor")
JOBS = "steptwin.inpage.jobs"
"""What only this reaches is in an archive of its own."""
ABSENT = (
    "campaign.store", "campaign.workers", "files.export.plot", "files.export.profileplot", "files.export.tables",
    "files.export.vcd", "files.export.vcdtext", "files.scene.gltf", "history.database",
)  # fmt: skip
"""Modules for processes, databases and libraries that no page has."""
OF_JOBS = SOURCE / "steptwin" / "files" / "export" / "page"
"""Parts of timelines, which are no modules."""
OF_EDITOR = ("pygls", "lsprotocol", "attr", "attrs", "cattrs", "typing_extensions")
"""Libraries of the editor server; they are in Python alone."""
NOT_OF_EDITOR = ("pygls/cli.py", "pygls/client.py", "pygls/lsp/client.py", "pygls/lsp/_base_client.py", "cattrs/preconf/")
"""Parts of them that no server imports."""
PYODIDE = """Pyodide, under the Mozilla Public License 2.0, https://www.mozilla.org/MPL/2.0/; its source is at
https://github.com/pyodide/pyodide. It has CPython in it, under the PSF License Agreement, https://docs.python.org/3/license.html.
All files are as they were published, except python_stdlib.zip: of the modules in it those that are used are left, compiled."""
SITE = "build/site/try/service.js"
"""The file that is written last."""
DEMO = SOURCE / "steptwin" / "live" / "studio" / "demo_machine"


def own() -> tuple[dict[str, str], dict[str, str]]:
    """Path of each file in the archives of the twin and of jobs, and on the disk."""
    graph = grimp.build_graph("steptwin")
    for name in ABSENT:
        graph.remove_module(f"steptwin.{name}")
    of_twin = _files({name for host in HOSTS for name in (host, *graph.find_upstream_modules(host))})
    of_jobs = _files({JOBS, *graph.find_upstream_modules(JOBS)}) | set(OF_JOBS.iterdir())
    return _named(of_twin), _named(of_jobs - of_twin)


def _files(modules: set[str]) -> set[Path]:
    packages = {name.rpartition(".")[0] for name in modules} - {""}
    paths = [SOURCE / name.replace(".", "/") for name in modules | packages]
    return {path / "__init__.py" if path.is_dir() else path.with_suffix(".py") for path in paths}


def _named(files: set[Path]) -> dict[str, str]:
    return {path.relative_to(SOURCE).as_posix(): str(path) for path in sorted(files)}


def libraries() -> dict[str, str]:
    found: dict[str, str] = {}
    for name in OF_EDITOR:
        spec = importlib.util.find_spec(name)
        if spec is None or spec.origin is None:
            raise SystemExit(f"{name} is not installed: make extras")
        origin = Path(spec.origin)
        files = origin.parent.rglob("*.py") if origin.name == "__init__.py" else [origin]
        root = origin.parent.parent if origin.name == "__init__.py" else origin.parent
        found |= {path.relative_to(root).as_posix(): str(path) for path in sorted(files)}
    return {name: path for name, path in found.items() if not name.startswith(NOT_OF_EDITOR)}


def licences() -> str:
    """Texts of the libraries' licences, and where those of Pyodide and its parts are."""
    named = sorted({dist for name in OF_EDITOR for dist in packages_distributions()[name]})
    texts = [
        f"{name} {version(name)}\n\n{path.read_text()}" for name in named for path in files(name) or () if "LICEN" in path.name
    ]
    return "\n\n----\n\n".join([PYODIDE, *texts])


def main(target: str) -> None:
    programs = {path.name: str(path) for path in DEMO.glob("*.prg")}
    world = {"name": "demo", "path": str(DEMO / "demo.toml"), "campaign": str(DEMO / "campaign.toml"), "files": programs}
    of_twin, of_jobs = own()
    archives = {"steptwin": of_twin, "jobs": of_jobs, "editor": libraries()}
    text = json.dumps({"archives": archives, "world": world, "licences": licences()})
    Path(target).write_text(text, "utf-8")
    own_files = [*of_twin.values(), *of_jobs.values(), world["path"], world["campaign"], *programs.values()]
    names = [Path(path).relative_to(ROOT).as_posix() for path in own_files]
    # A rule without a recipe for each of them: a file that has been removed makes the site anew too, and no error.
    rules = [f"{SITE}: {' '.join(names)}", *(f"{name}:" for name in names)]
    Path(target).with_suffix(".d").write_text("\n".join([*rules, ""]), "utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
