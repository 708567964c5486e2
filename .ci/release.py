"""Checks and checksums of `make release`.

``python .ci/release.py check`` before the build, ``python .ci/release.py finish FOLDER`` behind it.
"""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
import sys
import tarfile
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def version() -> str:
    text = (ROOT / "src/steptwin/__init__.py").read_text("utf-8")
    return re.findall(r'^__version__ = "([^"]+)"', text, re.MULTILINE)[0]


def problems() -> list[str]:
    """Why this tree is no release."""
    own = version()
    found = []
    newest = re.search(r"^## (.*)", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    if newest is None or not re.fullmatch(rf"{re.escape(own)} - \d{{4}}-\d\d-\d\d", newest[1]):
        found.append(f"the newest chapter of CHANGELOG.md is '{newest and newest[1]}', expected '{own} - YYYY-MM-DD'")
    named = set(re.findall(r"steptwin-(\d[^ /]*?)(?:-py3|\.tar)", (ROOT / "docs/install.md").read_text("utf-8")))
    if named != {own}:
        found.append(f"docs/install.md names files of {', '.join(sorted(named))}, the version of the package is {own}")
    for name in ("package.json", "package-lock.json"):
        extension = json.loads((ROOT / "editors/vscode" / name).read_text("utf-8"))["version"]
        if extension != own:
            found.append(f"the version in editors/vscode/{name} is {extension}, that of the package {own}")
    if (ROOT / ".git").exists():
        changed = subprocess.run(["git", "status", "--porcelain"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
        if changed:
            found.append(f"there are changes that are not committed:\n{changed}")
    return found


def finish(folder: Path) -> None:
    """Try the wheel in an environment of its own with the examples of the source archive, name the release in the lists of
    components, and write SHA256SUMS."""
    own = version()
    for part in ("python", "page"):
        path = folder / f"steptwin-{own}-{part}.cdx.json"
        listed = json.loads(path.read_text("utf-8"))
        listed["metadata"]["component"] |= {"name": "steptwin" if part == "python" else "steptwin-studio", "version": own}
        path.write_text(json.dumps(listed, indent=2) + "\n", "utf-8")
    wheel, archive = folder / f"steptwin-{own}-py3-none-any.whl", folder / f"steptwin-{own}.tar.gz"
    with tempfile.TemporaryDirectory() as name:
        venv.create(Path(name, "env"), with_pip=True)
        python = Path(name, "env/bin/python")
        subprocess.run([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", f"{wheel}[studio]"], check=True)
        with tarfile.open(archive) as packed:
            packed.extractall(name, filter="data")
        examples = Path(name, f"steptwin-{own}", "examples")
        for arguments in (["--version"], ["run", "worlds/feeder.toml", "--for", "5s"], ["check", "mic488/feeder.prg"]):
            subprocess.run([python, "-m", "steptwin", *arguments], cwd=examples, check=True, stdout=subprocess.DEVNULL)
    files = sorted(path for path in folder.iterdir() if path.is_file() and path.name != "SHA256SUMS")
    sums = "".join(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in files)
    (folder / "SHA256SUMS").write_text(sums, "utf-8")
    sys.stdout.write("".join(f"{folder.name}/{path.name}\n" for path in [*files, folder / "SHA256SUMS"]))


def main(arguments: list[str]) -> int:
    if arguments[:1] == ["finish"]:
        finish(Path(arguments[1]).resolve())
        return 0
    found = problems()
    sys.stderr.write("".join(f"{each}\n" for each in found))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
