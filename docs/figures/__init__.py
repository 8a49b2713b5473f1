"""Generators of the documentation's measured text, tables and pictures; `python -m docs.figures` runs them."""
