"""The page of the studio in wheel and source archive: built where it is missing or older than its sources."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class PageHook(BuildHookInterface):
    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """An editable install has what `make page` built, or nothing; a source archive has the page and needs no node."""
        root = Path(self.root)
        builder = root / "studio-web/build.py"
        if version == "editable" or not builder.exists() or is_current(root):
            return
        if subprocess.run([sys.executable, str(builder), "build"], check=False).returncode:
            raise RuntimeError("the page of the studio could not be built: studio-web/README.md says what that needs")


def sources(root: Path) -> list[Path]:
    """What the page is made of."""
    web = root / "studio-web"
    files = (path for path in web.rglob("*") if path.is_file() and path.name != "types.ts")
    own = [path for path in files if "node_modules" not in path.parts and "__pycache__" not in path.parts]
    return [*own, root / "docs/studio.schema.json"]


def is_current(root: Path) -> bool:
    built = [root / "src/steptwin/studio/page/index.html", root / "src/steptwin/files/export/page/scene.js"]
    if not all(one.exists() for one in built):
        return False
    newest = max(path.stat().st_mtime for path in sources(root))
    return all(one.stat().st_mtime >= newest for one in built)
