"""How Sphinx makes the site: `python -m sphinx -W -b html docs build/site`; needs no network."""

from __future__ import annotations

import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS / "make"))

project = "scanfab"
author = copyright = "The scanfab developers"
release = version = version("scanfab")
extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_reredirects",
]
exclude_patterns = ["make", "paper", "README.md"]
templates_path = ["make/templates"]

myst_enable_extensions = ["attrs_inline", "deflist", "dollarmath"]
myst_heading_anchors = 4
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_output_stderr = "remove"  # notes name paths of the machine

default_role = "code"
smartquotes = False  # two dashes stay two
autodoc_typehints = "none"  # numpydoc's sections say them
autosummary_ignore_module_all = False
numpydoc_class_members_toctree = False
numpydoc_show_inherited_class_members = False

html_theme = "pydata_sphinx_theme"
html_context = {"default_mode": "auto"}
html_title = "scanfab"
html_static_path = ["make/static"]
html_css_files = ["site.css"]
html_favicon = "make/static/icon.svg"
html_use_index = False  # the list of the API and the search have it
html_show_sourcelink = False
html_copy_source = False
html_math_renderer = "mathml"
html_sidebars = {"**": ["nav.html"]}
html_theme_options = {
    "navbar_center": [],
    "navigation_with_keys": False,
    "show_prev_next": False,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}

# names that pages once had
redirects = {
    "adding-a-reader": "extending/reader.html",
    "adding-to-the-table": "extending/fabric-or-column.html",
    "architecture": "developers.html",
    "cluster": "howto/many-folders.html",
    "figures": "gallery.html",
    "formats": "formats/index.html",
    "performance": "developers.html#performance",
    "python": "api/index.html",
    "troubleshooting": "messages.html",
}
# in the repository, a file of each old name leads to the new page
exclude_patterns += [f"{name}.md" for name in redirects]


def draw_math(self: Any, node: nodes.Element) -> None:
    """Write a formula as MathML, which browsers draw by themselves."""
    is_block = isinstance(node, nodes.math_block)
    formula = tex2mathml(node.astext(), as_block=is_block)
    self.body.append(f"<p>{formula}</p>" if is_block else formula)
    raise nodes.SkipNode


def fill(app: Any, page: str, content: list[str]) -> None:
    """Put what scripts make in the places of a page that name it: {{options}}."""
    import pages

    content[0] = pages.filled(content[0])


def make_files(app: Any) -> None:
    """Draw the figures of the pages and write the tables that pages offer."""
    import pages

    pages.make_files()


def describe(app: Any, what: str, name: str, value: Any, options: Any, lines: list[str]) -> None:
    """Say what a constant is: autodoc would show what Python says of every tuple."""
    if name == "scanfab.COLUMNS":
        lines[:] = ["Names of the columns of every fabric table, in their order."]


def setup(app: Any) -> None:
    """What Sphinx calls first."""
    app.add_html_math_renderer("mathml", (draw_math, None), (draw_math, None))
    app.connect("builder-inited", make_files)
    app.connect("source-read", fill)
    app.connect("autodoc-process-docstring", describe)
