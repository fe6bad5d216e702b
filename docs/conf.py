"""The manual's build: MyST pages, executed tutorial, autodoc reference, mathematics and theme served locally."""

from __future__ import annotations

import sys
from importlib.metadata import version as installed_version
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "images"))

project = "gearrattle"
author = "The gearrattle authors"
project_copyright = "The gearrattle authors, Apache-2.0"
version = release = installed_version("gearrattle")

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",
    "sphinxcontrib.bibtex",
    "workbench_pictures",
]
exclude_patterns = ["_build"]
templates_path = ["_templates"]
nitpicky = False

# Pages and notebooks: the tutorial is run at every build, and a cell that fails fails the build.
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
nb_execution_mode = "force"
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_execution_show_tb = True
nb_merge_streams = True

# References.
bibtex_bibfiles = ["references.bib"]
bibtex_default_style = "unsrt"

# Reference pages are written from the docstrings.
autosummary_generate = True
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_member_order = "bysource"
autodoc_class_signature = "separated"
napoleon_google_docstring = False
napoleon_numpy_docstring = True
napoleon_use_ivar = True

# Nothing in the built pages is fetched from elsewhere.
mathjax_path = "mathjax/tex-chtml.js"
html_theme = "pydata_sphinx_theme"
html_title = f"gearrattle {release}"
html_theme_options = {
    "navigation_with_keys": False,
    "show_toc_level": 2,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "pygments_light_style": "tango",
}
html_sidebars = {"index": [], "tutorial/*": [], "architecture": [], "reproduction": []}
html_copy_source = False
html_show_sourcelink = False
