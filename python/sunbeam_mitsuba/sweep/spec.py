"""The specification of a sweep, read from a TOML file or a dictionary and checked before the sweep begins.

A short specification is::

    output = "species"
    [[surface]]
    files = "scans/*.gsf"
    [settings]
    theta_i_deg = [0, 30, 60]
    [want.colour]
    illuminant = "D65"

Each ``[[surface]]`` and ``[settings]`` give combinations of parameters (sampling.py). A combination of a surface is one
of its *variants*, here a file. Every variant under every setting is a case, a row of the results. Each
``[want.NAME]`` is a *want*, a group of computed figures with its options (wants/want.py).

Parameters are those of the heights (SOURCE), of the library (SURFACE), of Mitsuba's BSDF (BSDF_ONLY) and of the light
(LIGHT). KEYS (``combine``, ``count``, ``seed``) say how the values of a table of the specification are combined.
"""

from __future__ import annotations

import glob
import hashlib
import json
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .errors import SweepError
from .limits import BSDF_ONLY, LIGHT, SOURCE, SURFACE, Text, Value, check_keys, shown
from .sampling import KEYS, ROWS_MAX, Combinations, read_combinations
from .wants import WANTS, Want

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

# Keys of the specification.
_SPEC_KEYS = ("output", "surface", "settings", "want")
# Keys of a ``[[surface]]`` besides its parameters.
_SURFACE_KEYS = ("name", "files")
# Default direction of the light: along the normal.
_LIGHT_DEFAULTS: dict[str, Value] = {"theta_i_deg": 0.0, "phi_i_deg": 0.0}


@dataclass(frozen=True)
class Case:
    """A row of the results: a variant under a setting."""

    #: Index of the row.
    row: int
    #: Hash of all inputs except contents of files, in hexadecimal digits. It names the case's files.
    identity: str
    #: Name of the surface, or else its file's name or its preset.
    surface: str
    #: Parameters of the surface and angles of the light. A relative ``filename`` begins at the specification's folder.
    parameters: dict[str, Value]


@dataclass(frozen=True)
class SurfaceSpec:
    """A ``[[surface]]`` of the specification."""

    #: Name in the results; where it is empty, the file's name or the preset replaces it.
    name: str
    #: Its variants.
    combinations: Combinations


@dataclass(frozen=True)
class Spec:
    """A checked specification."""

    #: Folder to which file names are relative.
    folder: Path
    #: Folder of the results, an absolute path.
    output: Path
    surfaces: tuple[SurfaceSpec, ...]
    #: Settings, which every variant of every surface is combined with.
    settings: Combinations
    #: Wanted figures, in the order of WANTS.
    wants: tuple[Want, ...]
    #: The specification as it was given.
    source: dict[str, Any]

    @property
    def count(self) -> int:
        """Number of cases; equal ones, which :meth:`cases` merges, count separately."""
        return sum(surface.combinations.count for surface in self.surfaces) * self.settings.count

    @property
    def parameter_names(self) -> list[str]:
        """Names of the parameters that at least one case has, in the order of the results' columns."""
        used = set(self.settings.names) | set(_LIGHT_DEFAULTS)
        for surface in self.surfaces:
            used |= set(surface.combinations.names)
        return [name for name in (*SOURCE, *SURFACE, *BSDF_ONLY, *LIGHT) if name in used]

    def cases(self, version: str) -> Iterator[Case]:
        """Yields the different cases in the order of the rows: by surface, then by setting.

        A case's identity is a hash of the surface's name, the parameters, the wanted figures with their options, and
        ``version``. Of equal cases only the first is yielded.
        """
        wanted = [want.identity() for want in self.wants]
        seen: set[str] = set()
        for surface in self.surfaces:
            for variant in surface.combinations:
                name = surface.name or str(variant.get("filename") or variant["preset"])
                for setting in self.settings:
                    parameters = {**_LIGHT_DEFAULTS, **variant, **setting}
                    text = json.dumps([name, parameters, wanted, version], sort_keys=True)
                    # 20 hexadecimal digits: two of 10⁶ different cases agree with a probability below 10⁻¹².
                    identity = hashlib.sha256(text.encode()).hexdigest()[:20]
                    if identity not in seen:
                        seen.add(identity)
                        yield Case(len(seen) - 1, identity, name, parameters)


def read_spec(path: str | os.PathLike[str], output: str | os.PathLike[str] | None = None) -> Spec:
    """Reads a specification from a TOML file; its paths are relative to the file's folder.

    ``output`` replaces the specification's own; it is relative to the working folder.

    Raises :class:`SweepError` with one line for a file that cannot be read, an unknown key, a contradiction, a value
    out of range, or a glob without matches.
    """
    path = Path(path)
    try:
        source = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SweepError(f"{path} cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SweepError(f"{path} is not TOML: {error}") from error
    return make_spec(source, path.resolve().parent, output)


def make_spec(source: dict[str, Any], folder: Path, output: str | os.PathLike[str] | None = None) -> Spec:
    """Reads a specification from a dictionary with the keys of the TOML file; its paths are relative to ``folder``.

    ``output`` and errors are those of :func:`read_spec`.
    """
    check_keys("the specification", source, _SPEC_KEYS)
    surfaces = source.get("surface")
    if not isinstance(surfaces, list) or not surfaces:
        raise SweepError("the specification needs at least one [[surface]]")
    settings = _settings(source.get("settings", {}))
    surface_specs = tuple(
        _surface(f"surface {number}", table, folder, settings) for number, table in enumerate(surfaces, start=1)
    )
    output_folder = _output(source, folder, output)
    wants = _wants(source.get("want"), folder)
    spec = Spec(folder, output_folder, surface_specs, settings, wants, source)
    if spec.count > ROWS_MAX:
        raise SweepError(f"the specification has {spec.count} cases; accepted are at most {ROWS_MAX}")
    for want in wants:
        want.check_parameters(set(spec.parameter_names), _values_of(spec))
    return spec


def _output(source: dict[str, Any], folder: Path, replacement: str | os.PathLike[str] | None) -> Path:
    """Absolute path of the output folder: ``replacement``, or the specification's own, relative to ``folder``.

    Raises :class:`SweepError` where both are missing.
    """
    where = replacement if replacement is not None else source.get("output")
    if where is None:
        raise SweepError('the specification needs an output, a folder: output = "…" in it, or --output')
    if not isinstance(where, (str, os.PathLike)):
        raise SweepError(f"output is {shown(where)}, but must be a folder's name")
    return (Path(where) if replacement is not None else folder / where).resolve()


def _values_of(spec: Spec) -> dict[str, set[Value]]:
    """Values of each parameter over all cases; of a sampled range both ends."""
    found: dict[str, set[Value]] = {}
    for combinations in (spec.settings, *(surface.combinations for surface in spec.surfaces)):
        for name, values in combinations.listed().items():
            found.setdefault(name, set()).update(values)
    return found


def _settings(table: object) -> Combinations:
    """Reads the table ``[settings]``. Raises :class:`SweepError` for keys and values that are not accepted."""
    accepted = [*SURFACE, *BSDF_ONLY, *LIGHT]
    return read_combinations("settings", check_keys("settings", table, [*KEYS, *accepted]), accepted)


def _surface(where: str, table: object, folder: Path, settings: Combinations) -> SurfaceSpec:
    """Reads a table ``[[surface]]``, which ``where`` names in messages.

    Its parameters may not be in ``settings`` as well. Raises :class:`SweepError` for keys and values that are not
    accepted.
    """
    accepted = [*SOURCE, *SURFACE, *BSDF_ONLY]
    given = dict(check_keys(where, table, [*_SURFACE_KEYS, *KEYS, *accepted]))
    name: object = ""
    if "name" in given:
        name = given.pop("name")
        if not Text().accepts(name):
            raise SweepError(f"{where}: name is {shown(name)}, but must be a text")
    if "files" in given:
        if "filename" in given:
            raise SweepError(f"{where}: filename and files are both given; give one of the two")
        given["filename"] = _matching(where, given.pop("files"), folder)
    if ("preset" in given) == ("filename" in given):
        raise SweepError(f"{where}: give one of preset, filename and files")
    for parameter in given:
        if parameter in settings.names:
            raise SweepError(f"{where}: {parameter} is given here and in settings; give it in one of the two")
    return SurfaceSpec(str(name), read_combinations(where, given, accepted))


def _matching(where: str, patterns: object, folder: Path) -> list[str]:
    """Sorted paths of the files that match a glob or any of a list of globs.

    Paths are relative to ``folder`` for relative globs. Raises :class:`SweepError` where a glob matches no file.
    """
    listed = [patterns] if isinstance(patterns, str) else patterns
    if not isinstance(listed, list) or not listed or not all(isinstance(pattern, str) for pattern in listed):
        raise SweepError(f"{where}: files is {shown(patterns)}, but must be a glob or a list of globs")
    found: set[str] = set()
    # Only the pattern is a glob; the folder's own name may contain "[", "*" or "?".
    root = Path(glob.escape(str(folder)))
    for pattern in listed:
        paths = [path for path in glob.glob(str(root / pattern), recursive=True) if os.path.isfile(path)]
        if not paths:
            raise SweepError(f"{where}: no file matches {pattern!r} in {folder}")
        found.update(path if os.path.isabs(pattern) else os.path.relpath(path, folder) for path in paths)
    return sorted(found)


def _wants(table: object, folder: Path) -> tuple[Want, ...]:
    """Reads the tables ``[want.NAME]``. Raises :class:`SweepError` without any, and for options not accepted."""
    if not isinstance(table, dict) or not table:
        raise SweepError(f"the specification needs at least one [want.NAME]; there are {', '.join(WANTS)}")
    check_keys("want", table, list(WANTS))
    return tuple(WANTS[name].read(table[name], folder) for name in WANTS if name in table)
