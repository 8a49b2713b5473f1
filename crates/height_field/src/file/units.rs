//! Units of length as files write them: a symbol such as `nm`, or a name such as `nanometers`.
//!
//! A file whose bytes are not UTF-8 throughout is read as Latin-1 (`encoding.rs`). Bytes of any other encoding then
//! appear as other characters, which the lists below contain.

/// µm in a metre.
pub(super) const UM_PER_M: f64 = 1e6;
/// Smallest resolution of a picture that counts as a measured pixel size: 10 µm a pixel, 2540 dots an inch. Lower
/// resolutions are those of printers and screens.
pub(super) const PIXELS_PER_METRE_MIN: u32 = 100_000;
/// µm in an ångström.
const UM_PER_ANGSTROM: f64 = 1e-4;
/// SI prefixes: symbol, name, and µm in a metre with this prefix. [`MICRO`] has more symbols of micro.
const PREFIXES: [(&str, &str, f64); 9] = [
    ("", "", UM_PER_M),
    ("k", "kilo", 1e9),
    ("d", "deci", 1e5),
    ("c", "centi", 1e4),
    ("m", "milli", 1e3),
    ("µ", "micro", 1.0),
    ("n", "nano", 1e-3),
    ("p", "pico", 1e-6),
    ("f", "femto", 1e-9),
];
/// Symbols of the prefix micro.
///
/// The first two are the micro sign (U+00B5) and the Greek mu (U+03BC). NanoScope, the software of Bruker's
/// atomic-force microscopes, writes `~`. The last three are bytes misread as Latin-1: `Âµ` and `Î¼` are UTF-8, `æ` is
/// the micro sign in DOS code page 850.
const MICRO: [&str; 7] = ["µ", "μ", "u", "~", "Âµ", "Î¼", "æ"];
/// Spellings of the ångström, in lower case and without a plural s.
///
/// `å` is also the lower case of the ångström sign, U+212B. The last four are bytes of Å misread as Latin-1, in lower
/// case: `ã\u{85}` is UTF-8, and `ã` the same after its control character was trimmed as a blank; `\u{8f}` is code page
/// 850, and `\u{81}` Mac Roman.
const ANGSTROM: [&str; 8] = ["å", "ang", "angstrom", "ångström", "ã\u{85}", "ã", "\u{8f}", "\u{81}"];

/// Length of one `unit` in µm.
///
/// Symbols (`m`, with or without one of [`PREFIXES`]; `Å`) and names (`nanometers`) are accepted. Names may be in any
/// case, with or without a plural s. Blanks around the unit are ignored.
///
/// # Errors
/// Any other text, with a reason that names the unit.
pub(super) fn micrometres(unit: &str) -> Result<f64, String> {
    // `str::trim` would also remove U+0085, the second half of a misread Å.
    let unit = unit.trim_matches(|c: char| c.is_ascii_whitespace() || c == '\u{a0}');
    let word = unit.to_lowercase();
    let singular = word.strip_suffix('s').unwrap_or(&word);
    if ANGSTROM.contains(&singular) {
        return Ok(UM_PER_ANGSTROM);
    }
    if singular == "micron" {
        return Ok(1.0);
    }
    let name = singular.strip_suffix("meter").or_else(|| singular.strip_suffix("metre"));
    if let Some((.., um)) = PREFIXES.iter().find(|(_, prefix, _)| name == Some(*prefix)) {
        return Ok(*um);
    }
    let symbol = unit.strip_suffix('m').ok_or_else(|| format!("unit \"{unit}\" is not a known unit of length"))?;
    let symbol = if MICRO.contains(&symbol) { "µ" } else { symbol };
    let found = PREFIXES.iter().find(|(prefix, ..)| *prefix == symbol).map(|(.., um)| *um);
    found.ok_or_else(|| format!("unit \"{unit}\" is not m with one of the SI prefixes f, p, n, µ, m, c, d, k"))
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
        for (unit, um) in [("Nanometer", 1e-3), ("nm", 1e-3), ("centimetres", 1e4), ("cm", 1e4), ("m", 1e6)] {
            assert_eq!(micrometres(unit).unwrap(), um, "{unit}");
        }
        // A is the ampere, and Nm the newton metre. Megametres are beyond the accepted prefixes.
        for unit in ["", "A", "Nm", "Mm", "V", "deg", "nm/V", "m²", "s", "parameter"] {
            micrometres(unit).unwrap_err();
        }
    }
}
