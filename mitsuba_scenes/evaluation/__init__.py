"""The sources' evaluation, reproduced: each page of figures in `docs/` from one command, its numbers out of that run."""
