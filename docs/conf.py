"""The site: `sphinx-build -W -b html -c docs . build/site`, from the root: pages link to files of all folders."""

import importlib.metadata
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import api_pages

project = "porefv"
author = "the authors of porefv"
copyright = "2026, the authors of porefv"
release = importlib.metadata.version("porefv")

root_doc = "docs/index"
include_patterns = ["docs/**.md", "docs/docstrings/*.rst", "tutorials/**.md"]
include_patterns += ["CHANGELOG.md", "CONTRIBUTING.md", "data/README.md"]
exclude_patterns = ["build", ".venv*", ".git", "src", "tests", "**/results", "**/.ipynb_checkpoints"]

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.viewcode",
    "numpydoc",
    "sphinx_copybutton",
    "sphinx_design",
    "mathml",
]

# Pages are Markdown that GitHub shows too: headings are the targets of links, formulas stand between dollar signs.
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist", "attrs_inline"]
myst_heading_anchors = 4
myst_dmath_allow_labels = True

# Notebooks are run anew where they, or the packages, have changed; one that fails fails the site.
nb_execution_mode = "cache"
nb_execution_cache_path = "build/notebooks"
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_execution_show_tb = True
nb_merge_streams = True
# The only cells that are folded are solutions of exercises, and code of figures, which has its own label.
nb_code_prompt_show = "Solution"
nb_code_prompt_hide = "Solution"

autodoc_typehints = "none"
autodoc_member_order = "bysource"
default_role = "py:obj"
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

html_math_renderer = "mathml"
html_theme = "furo"
html_title = "porefv"
html_static_path = ["static"]
html_css_files = ["formulas.css"]
html_extra_path = ["site"]
html_theme_options = {"source_directory": ""}
copybutton_prompt_text = r"\$ |>>> "
copybutton_prompt_is_regexp = True

api_pages.write(Path(__file__).parent / "docstrings")
