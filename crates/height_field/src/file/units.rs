//! Units of length as files write them.

/// µm in one of the unit, for metres with any SI prefix.
pub(super) fn micrometres(unit: &str) -> Result<f64, String> {
    let prefix = unit.trim().strip_suffix('m').ok_or_else(|| format!("unit \"{unit}\" is not a length"))?;
    // Both the micro sign and the Greek letter mean 1e-6; `u` and, in Nanoscope files, `~` stand in for them.
    Ok(match prefix {
        "" => 1e6,
        "k" => 1e9,
        "d" => 1e5,
        "c" => 1e4,
        "m" => 1e3,
        "µ" | "μ" | "u" | "~" => 1.0,
        "n" => 1e-3,
        "p" => 1e-6,
        "f" => 1e-9,
        _ => return Err(format!("unit \"{unit}\" is not metres with an SI prefix")),
    })
}
