"""The documentation as a site: `make docs`. Sphinx reads the Markdown pages; the reference is made from the code."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import generate

project = "relmodel"
author = "the relmodel engineers"
extensions = ["myst_parser"]
exclude_patterns = ["_build"]
html_theme = "alabaster"
html_theme_options = {"description": "Parts in view and the pose of the cameras, from SQL", "page_width": "1080px"}
html_sidebars = {"**": ["about.html", "searchfield.html", "navigation.html"]}
html_show_sourcelink = False
pygments_style = "default"
myst_heading_anchors = 3

generate.write_reference(Path(__file__).parent / "reference")
