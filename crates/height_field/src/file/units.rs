//! Units of length as files write them.

/// Spellings of the prefix micro. Some are the micro sign in a wrong encoding: UTF-8 read as Latin-1 (`Âµ`, `Î¼`), and
/// code page 850 of DOS read as Latin-1 (`æ`). NanoScope writes `~`.
const MICRO: [&str; 7] = ["µ", "μ", "u", "~", "Âµ", "Î¼", "æ"];
/// Spellings of the ångström in lower case: both characters, words, UTF-8 read as Latin-1 (whose second byte may be
/// trimmed as a blank), and the code pages 850 and Mac Roman read as Latin-1.
const ANGSTROM: [&str; 9] = ["å", "\u{212b}", "ang", "angstrom", "ångström", "ã\u{85}", "ã", "\u{8f}", "\u{81}"];
/// µm in an ångström.
const UM_PER_ANGSTROM: f64 = 1e-4;
/// µm in a metre.
pub(super) const UM_PER_M: f64 = 1e6;
/// Names of units in the singular and lower case, with their length in µm.
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

/// Length of one `unit` in µm: metres with an SI prefix or ångström, as a symbol or a name.
///
/// # Errors
/// A unit that is not a length.
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
        "" => 1e6,
        "k" => 1e9,
        "d" => 1e5,
        "c" => 1e4,
        "m" => 1e3,
        "n" => 1e-3,
        "p" => 1e-6,
        "f" => 1e-9,
        _ if MICRO.contains(&prefix) => 1.0,
        _ => return Err(format!("unit \"{unit}\" is not metres with an SI prefix")),
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
        // A is the ampere, Nm the newton metre, and M the prefix of megametres.
        for unit in ["", "A", "Nm", "Mm", "V", "deg", "nm/V", "m²", "s"] {
            micrometres(unit).unwrap_err();
        }
    }
}
