//! Units of length as files write them.

/// Spellings of the prefix micro.
///
/// The first two are the micro sign (U+00B5) and the Greek mu (U+03BC). NanoScope writes `~`. The last three are
/// encodings read as Latin-1: `Âµ` and `Î¼` are UTF-8, `æ` is the micro sign in DOS code page 850.
const MICRO: [&str; 7] = ["µ", "μ", "u", "~", "Âµ", "Î¼", "æ"];
/// Spellings of the ångström, in lower case and without a plural s.
///
/// The first is also the lower case of the ångström sign, U+212B. The last four are encodings of Å read as Latin-1:
/// UTF-8 (`Ã\u{85}`, whose second character may have been trimmed as a blank), code page 850 (`\u{8f}`), and Mac Roman
/// (`\u{81}`).
const ANGSTROM: [&str; 8] = ["å", "ang", "angstrom", "ångström", "ã\u{85}", "ã", "\u{8f}", "\u{81}"];
/// µm in an ångström.
const UM_PER_ANGSTROM: f64 = 1e-4;
/// µm in a metre.
pub(super) const UM_PER_M: f64 = 1e6;
/// Names of units in the singular and in lower case, each with its length in µm.
const NAMES: [(&str, f64); 11] = [
    ("micron", 1.0),
    ("micrometer", 1.0),
    ("micrometre", 1.0),
    ("nanometer", 1e-3),
    ("nanometre", 1e-3),
    ("picometer", 1e-6),
    ("picometre", 1e-6),
    ("millimeter", 1e3),
    ("millimetre", 1e3),
    ("meter", 1e6),
    ("metre", 1e6),
];

/// Length of one `unit` in µm.
///
/// Symbols (`m`, with an SI prefix listed below or without; `Å`) and names (`nanometers`) are accepted. Names may be in
/// any case, with or without a plural s. Blanks around the unit are ignored.
///
/// # Errors
/// Any other text, with a reason that names the unit.
pub(super) fn micrometres(unit: &str) -> Result<f64, String> {
    let unit = unit.trim_matches(|c: char| c.is_ascii_whitespace() || c == '\u{a0}');
    let word = unit.to_lowercase();
    let singular = word.strip_suffix('s').unwrap_or(&word);
    if ANGSTROM.contains(&singular) {
        return Ok(UM_PER_ANGSTROM);
    }
    if let Some((_, um)) = NAMES.iter().find(|(name, _)| *name == singular) {
        return Ok(*um);
    }
    let prefix = unit.strip_suffix('m').ok_or_else(|| format!("unit \"{unit}\" is not a length"))?;
    Ok(match prefix {
        "" => UM_PER_M,
        "k" => 1e9,
        "d" => 1e5,
        "c" => 1e4,
        "m" => 1e3,
        "n" => 1e-3,
        "p" => 1e-6,
        "f" => 1e-9,
        _ if MICRO.contains(&prefix) => 1.0,
        _ => return Err(format!("unit \"{unit}\" is not m with one of the SI prefixes f, p, n, µ, m, c, d, k")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn micrometres_and_angstroms_are_read_in_every_spelling() {
        for unit in ["µm", "μm", "um", "~m", "Âµm", "Î¼m", "æm", " µm ", "micron", "Microns", "micrometers"] {
            assert_eq!(micrometres(unit).unwrap(), 1.0, "{unit}");
        }
        for unit in ["Å", "\u{212b}", "Angstrom", "angstroms", "Ångström", "Ã\u{85}", "\u{8f}", "\u{81}"] {
            assert_eq!(micrometres(unit).unwrap(), 1e-4, "{unit}");
        }
        assert_eq!(micrometres("Nanometer").unwrap(), 1e-3);
        // A is the ampere, and Nm the newton metre. Megametres are beyond the accepted prefixes.
        for unit in ["", "A", "Nm", "Mm", "V", "deg", "nm/V", "m²", "s"] {
            micrometres(unit).unwrap_err();
        }
    }
}
