"""Configuration of Sphinx for the site that `make docs` builds from the Markdown pages of this folder."""

project = "sunbeam"
author = "the sunbeam authors"
copyright = "the sunbeam authors, MIT licence"

extensions = ["myst_parser", "sphinx.ext.mathjax"]
source_suffix = {".md": "markdown"}
# Generators of pages, their templates and their data are not pages.
exclude_patterns = ["figures", "templates", "data"]

myst_enable_extensions = ["dollarmath"]
# Lowest level of headings that get an anchor; the anchors are named as on GitHub.
myst_heading_anchors = 4

html_theme = "furo"
html_title = "sunbeam"
html_copy_source = False
html_show_sourcelink = False
