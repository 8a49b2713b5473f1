"""Single 2014's evaluation, reproduced: each page of figures in `docs/` from one command that computes its numbers."""
