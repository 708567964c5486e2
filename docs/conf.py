"""Sphinx configuration. `make docs` builds with warnings as errors."""

from __future__ import annotations

import sys
from pathlib import Path

from steptwin import __version__

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

project = "steptwin"
copyright = "the steptwin authors"  # noqa: A001 - Sphinx wants this name
release = __version__

extensions = ["myst_parser", "sphinx_copybutton", "command_output", "control_commands", "studio_links", "sphinx.ext.autodoc"]
default_role = "py:obj"  # docstrings name things in single backticks
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
autodoc_type_aliases = {"Reaction": "Reaction"}  # a long union
myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = f"steptwin {release}"
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["narrow.css"]
copybutton_prompt_text = "$ "
