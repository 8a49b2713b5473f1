//! Values in the header of a text file: numbers with a unit.

use super::super::units::micrometres;
use super::numbers::number;

/// One or two numbers with a common unit.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Quantity {
    /// One number, or the numbers along x and y.
    pub numbers: Vec<f64>,
    /// The unit as written; empty without one.
    pub unit: String,
}

impl Quantity {
    /// The numbers in µm; `None` unless the unit is a length.
    pub(super) fn lengths_um(&self) -> Option<Vec<f64>> {
        let unit_um = micrometres(&self.unit).ok()?;
        Some(self.numbers.iter().map(|value| value * unit_um).collect())
    }

    /// The numbers as spacings in µm; `None` unless the unit is a length for each point, such as `µm/pixel`.
    pub(super) fn per_point_um(&self) -> Option<Vec<f64>> {
        let (unit, point) = self.unit.split_once('/')?;
        if !["pixel", "px", "point", "pt", "sample"].contains(&point.to_lowercase().as_str()) {
            return None;
        }
        Self { numbers: self.numbers.clone(), unit: unit.to_owned() }.lengths_um()
    }

    /// The numbers as counts of points, from 1 to below 1e9; `None` for other numbers, or for a unit other than points.
    pub(super) fn counts(&self) -> Option<Vec<usize>> {
        /// Units of a number of points.
        const POINTS: [&str; 10] = ["", "px", "pix", "pixel", "pixels", "pt", "pts", "points", "samples", "lines"];
        if !POINTS.contains(&self.unit.to_lowercase().as_str()) {
            return None;
        }
        let count = |value: &f64| (value.fract() == 0.0 && (1.0..1e9).contains(value)).then_some(*value as usize);
        self.numbers.iter().map(count).collect()
    }
}

/// Reads a text such as `2.4 µm`, `2,4µm`, `10 x 5 µm`, `10 µm × 5 µm`, `48 pixels` or `[nm] 3`. A comma is a decimal
/// mark. `None` for two different units and for any other text.
pub(super) fn quantity(text: &str) -> Option<Quantity> {
    let mut numbers = Vec::new();
    let mut unit = String::new();
    let mut rest = text.trim();
    if let Some((inner, after)) = bracketed(rest) {
        unit = inner.to_owned();
        rest = after.trim();
    }
    while !rest.is_empty() && numbers.len() < 2 {
        // Without a number at the beginning `end` is 0. `number` makes the empty text NaN, and the result is `None`.
        let end = number_end(rest);
        let value = number(&rest[..end].replace(',', ".")).filter(|value| value.is_finite())?;
        numbers.push(value);
        rest = rest[end..].trim_start();
        let (found, after) = leading_unit(rest);
        if !found.is_empty() {
            if !unit.is_empty() && unit != found {
                return None;
            }
            unit = found.to_owned();
        }
        rest = after.trim();
        // The text after the sign between the numbers along x and y, such as `×`.
        let cross = ["x", "X", "×", "*", "by "].iter().find_map(|sign| rest.strip_prefix(sign));
        match cross {
            Some(after) if numbers.len() == 1 => {
                rest = after.trim_start();
                // A sign without a second number is an error.
                if rest.is_empty() {
                    return None;
                }
            }
            // A blank alone separates the numbers.
            _ if rest.starts_with(|c: char| c.is_ascii_digit()) && numbers.len() == 1 => {}
            _ => break,
        }
    }
    (rest.is_empty() && !numbers.is_empty()).then_some(Quantity { numbers, unit })
}

/// Text in brackets of any kind at the beginning, and the text after the brackets; `None` without brackets.
pub(super) fn bracketed(text: &str) -> Option<(&str, &str)> {
    let close = match text.chars().next()? {
        '[' => ']',
        '(' => ')',
        '{' => '}',
        _ => return None,
    };
    let end = text.find(close)?;
    Some((text[1..end].trim(), &text[end + 1..]))
}

/// Length in bytes of the number at the beginning; 0 without one. An `e` belongs to it only before a sign or a digit:
/// in `2e` the number is `2`.
fn number_end(text: &str) -> usize {
    let bytes = text.as_bytes();
    let mut end = 0;
    while let Some(byte) = bytes.get(end) {
        let after_exponent = end > 0 && matches!(bytes[end - 1], b'e' | b'E');
        let is_exponent = matches!(byte, b'e' | b'E')
            && end > 0
            && bytes.get(end + 1).is_some_and(|next| next.is_ascii_digit() || b"+-".contains(next));
        let is_sign = b"+-".contains(byte) && (end == 0 || after_exponent);
        if !(byte.is_ascii_digit() || b".,".contains(byte) || is_exponent || is_sign) {
            break;
        }
        end += 1;
    }
    end
}

/// Unit at the beginning, with or without brackets, and the text after it. The unit is empty before a number, `x` or
/// `by`.
fn leading_unit(text: &str) -> (&str, &str) {
    if let Some((unit, rest)) = bracketed(text) {
        return (unit, rest);
    }
    let end = text.find(|c: char| c.is_whitespace() || "×*;".contains(c)).unwrap_or(text.len());
    let word = &text[..end];
    // An `x` directly before the second number, as in `10x5`.
    let is_cross = word.starts_with(['x', 'X']) && word[1..].starts_with(|c: char| c.is_ascii_digit());
    // `~` is µ and the last two are Å in the encodings of `units.rs`.
    let is_unit = word.starts_with(|c: char| c.is_alphabetic() || "~°%\u{8f}\u{81}".contains(c));
    if !is_unit || ["x", "X", "by"].contains(&word) || is_cross {
        return ("", text);
    }
    (word, &text[end..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_units_are_read_in_all_forms() {
        let expected =
            |numbers: &[f64], unit: &str| Some(Quantity { numbers: numbers.to_vec(), unit: unit.to_owned() });
        for (text, numbers, unit) in [
            ("2.40000 µm", &[2.4][..], "µm"),
            ("2,4µm", &[2.4], "µm"),
            ("1.0e-6 m", &[1e-6], "m"),
            ("3.69862e-007 m", &[3.69862e-7], "m"),
            ("2400", &[2400.0], ""),
            ("10 x 5 µm", &[10.0, 5.0], "µm"),
            ("10x5", &[10.0, 5.0], ""),
            ("10X5", &[10.0, 5.0], ""),
            ("10 µm × 5 µm", &[10.0, 5.0], "µm"),
            ("10 5 ~m", &[10.0, 5.0], "~m"),
            ("48 pixels", &[48.0], "pixels"),
            ("10 [nm]", &[10.0], "nm"),
            ("(nm) 10", &[10.0], "nm"),
        ] {
            assert_eq!(quantity(text), expected(numbers, unit), "{text}");
        }
        for text in ["", "µm", "Height", "10 µm of skin", "10 nm x 5 µm", "10 x", "2026-11-26", "1.2.3"] {
            assert_eq!(quantity(text), None, "{text}");
        }
        assert_eq!(quantity("2.5 nm").unwrap().lengths_um(), Some(vec![2.5e-3]));
        assert_eq!(quantity("48 x 32").unwrap().counts(), Some(vec![48, 32]));
        assert_eq!(quantity("48 µm").unwrap().counts(), None);
        assert_eq!(quantity("2.5").unwrap().counts(), None);
    }
}
