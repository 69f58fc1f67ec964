"""The site of the documentation: ``sphinx-build -W --keep-going -c docs/site . build/site``.

The project's folder is the source, so that links between README.md, docs/ and examples/ are those
that one follows in the folder itself.
"""

import usdface

project = "usdface"
author = "the authors of usdface"
copyright = author
version = release = usdface.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_external_toc",
]
include_patterns = ["*.md", "docs/*.md", "examples/*.md", "plugins/*.md", "benchmarks/*.md"]
exclude_patterns = [".*", "build", "node_modules"]
external_toc_path = "docs/site/contents.yml"
default_role = "py:obj"  # `Shot` in a docstring is a link to it

myst_heading_anchors = 3
napoleon_google_docstring = False
napoleon_use_ivar = True  # attributes as a list, no targets of links: several classes have a `path`
autodoc_typehints = "none"  # docstrings name types with shapes and units
autodoc_preserve_defaults = True

html_theme = "furo"
html_title = f"usdface {version}"
html_extra_path = ["start"]  # index.html of the site
html_copy_source = False
