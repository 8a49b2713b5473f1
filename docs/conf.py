"""The site that `make docs` builds from the Markdown pages of this folder."""

project = "sunbeam"
author = "the sunbeam authors"
copyright = "the sunbeam authors, MIT licence"

extensions = ["myst_parser", "sphinx.ext.mathjax"]
source_suffix = {".md": "markdown"}
# Neither the templates of generated pages nor their numbers are pages.
exclude_patterns = ["templates", "data"]

myst_enable_extensions = ["dollarmath"]
# Headings down to this level can be linked to, by the names that code hosts give them.
myst_heading_anchors = 4

html_theme = "furo"
html_title = "sunbeam"
html_copy_source = False
html_show_sourcelink = False
