//! Titles of the columns of points, with their units: `X[nm] Y[nm] Z[nm]`, `x (nm), y (nm), z (nm)`, `x, y, z`,
//! `x y z in µm`.

use super::super::units::micrometres;

/// Titles of the columns, in their sequence.
const TITLES: [&str; 3] = ["x", "y", "z"];

/// Units given by the titles of the columns x, y and z.
#[derive(Debug, PartialEq)]
pub(super) struct Columns {
    /// Units of x and of y in µm; `None` without units.
    pub lateral_um: Option<[f64; 2]>,
    /// Unit of z as written, and in µm.
    pub height: Option<(String, f64)>,
}

/// Reads a line of titles of x, y and z, without comment signs; `None` for any other line.
///
/// # Errors
/// A unit that is not a length, or units for some columns only.
pub(super) fn column_titles(text: &str) -> Option<Result<Columns, String>> {
    // Units of x, y and z.
    let mut units: [Option<&str>; 3] = [None; 3];
    // Unit of all columns: the word after "in" at the end of the line, where no title has a unit of its own.
    let mut common = None;
    // Number of titles found.
    let mut found = 0;
    // Whether the word "in" came after the last title.
    let mut after_in = false;
    for word in text.split(|c: char| c.is_whitespace() || ",;\"".contains(c)).filter(|word| !word.is_empty()) {
        // After z no further title is expected.
        match TITLES.get(found).and_then(|title| after_title(word, title)) {
            Some(unit) => {
                units[found] = Some(bare(unit)).filter(|unit| !unit.is_empty());
                found += 1;
                after_in = false;
            }
            None if word.eq_ignore_ascii_case("in") => after_in = true,
            None if found == 0 => return None,
            // A bracket or sign that stands alone, as in "x [ nm ]".
            None if bare(word).is_empty() => {}
            None if after_in && found == 3 && units == [None; 3] => common = Some(bare(word)),
            // A word after a title is its unit.
            None => units[found - 1] = Some(bare(word)),
        }
    }
    (found == 3).then(|| lengths(units.map(|unit| unit.or(common))))
}

/// Text after the letter `title` at the beginning of a word, such as `[nm]` in `X[nm]`; empty for the letter alone.
/// `None` for other words.
fn after_title<'a>(word: &'a str, title: &str) -> Option<&'a str> {
    let rest = word.get(..1).filter(|first| first.eq_ignore_ascii_case(title)).map(|_| &word[1..]);
    rest.filter(|rest| !rest.starts_with(char::is_alphanumeric))
}

/// A unit without brackets and signs around it.
fn bare(unit: &str) -> &str {
    unit.trim_matches(|c| "[](){}/_:".contains(c))
}

/// Units of x, y and z as lengths: all three or none.
fn lengths(units: [Option<&str>; 3]) -> Result<Columns, String> {
    match units {
        [None, None, None] => Ok(Columns { lateral_um: None, height: None }),
        [Some(x), Some(y), Some(z)] => {
            let lateral_um = Some([micrometres(x)?, micrometres(y)?]);
            Ok(Columns { lateral_um, height: Some((z.to_owned(), micrometres(z)?)) })
        }
        _ => Err("a unit is given for some of the columns x, y and z only".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn titles_of_points_give_their_units() {
        for (text, lateral, height) in [
            ("X[nm]\tY[nm]\tZ[nm]", Some(1e-3), Some(1e-3)),
            ("x (µm), y (µm), z (nm)", Some(1.0), Some(1e-3)),
            ("x/um;y/um;z/nm", Some(1.0), Some(1e-3)),
            ("\"X [mm]\",\"Y [mm]\",\"Z [µm]\"", Some(1e3), Some(1.0)),
            ("x y z in µm", Some(1.0), Some(1.0)),
            ("x in nm, y in nm, z in µm", Some(1e-3), Some(1.0)),
            ("x nm, y nm, z in µm", Some(1e-3), Some(1.0)),
            ("X [ nm ], Y [ nm ], Z [ µm ]", Some(1e-3), Some(1.0)),
            ("x,y,z", None, None),
        ] {
            let found = column_titles(text).unwrap().unwrap();
            assert_eq!(found.lateral_um, lateral.map(|um| [um; 2]), "{text}");
            assert_eq!(found.height.map(|(_, um)| um), height, "{text}");
        }
        for text in ["", "heights", "xylophone y z", "x y", "Width: 2 µm", "x-length = 3"] {
            assert!(column_titles(text).is_none(), "{text}");
        }
        assert!(column_titles("X[nm] Y[nm] Z[V]").unwrap().unwrap_err().contains("\"V\""));
        assert!(column_titles("x y z[nm]").unwrap().unwrap_err().contains("some of the columns"));
    }
}
