"""Writes src/colour/cie.rs from the CIE's data at 1 nm.

The data are the colour matching functions of the 2° observer of 1931 (CIE_xyz_1931_2deg.csv,
doi:10.25039/CIE.DS.xvudnb9b) and the illuminant D65 (CIE_std_illum_D65.csv, doi:10.25039/CIE.DS.hjfjmt59). Fetch both
from cie.co.at and run this script in the repository:

    python3 scripts/cie_tables.py CIE_xyz_1931_2deg.csv CIE_std_illum_D65.csv > src/colour/cie.rs
"""

from __future__ import annotations

import csv
import sys

FIRST_NM, LAST_NM = 380, 780

HEAD = """\
//! Tables of the CIE at 1 nm; written by scripts/cie_tables.py.

/// Wavelengths of the tables in nm, first and last; one entry for each whole nm.
pub(super) const RANGE_NM: (u16, u16) = ({first}, {last});

/// The colour matching functions x̄, ȳ, z̄ of the 2° observer of 1931 (doi:10.25039/CIE.DS.xvudnb9b).
#[rustfmt::skip]
pub(super) static OBSERVER_1931: [[f64; 3]; {count}] = [
{observer}
];

/// Relative spectral power of the illuminant D65 (doi:10.25039/CIE.DS.hjfjmt59), 100 at 560 nm.
#[rustfmt::skip]
pub(super) static D65: [f64; {count}] = [
{d65}
];
"""


def read_columns(path: str) -> dict[int, list[str]]:
    """The columns after the wavelength, as they are written, without trailing zeros."""
    with open(path, newline="") as file:
        return {int(row[0]): [repr(float(value)) for value in row[1:]] for row in csv.reader(file)}


def main(observer_path: str, d65_path: str) -> None:
    observer, d65 = read_columns(observer_path), read_columns(d65_path)
    wavelengths_nm = range(FIRST_NM, LAST_NM + 1)
    rows = [f"    [{', '.join(observer[nm])}]," for nm in wavelengths_nm]
    powers = [d65[nm][0] for nm in wavelengths_nm]
    lines = [f"    {', '.join(powers[at : at + 10])}," for at in range(0, len(powers), 10)]
    head = HEAD.format(
        first=FIRST_NM,
        last=LAST_NM,
        count=len(wavelengths_nm),
        observer="\n".join(rows),
        d65="\n".join(lines),
    )
    print(head, end="")


if __name__ == "__main__":
    main(*sys.argv[1:])
