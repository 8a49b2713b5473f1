//! Headers of texts: size, unit, orientation and channel of the numbers that follow.
//!
//! A line is `key: value`, `key = value`, titles of columns (`X[nm] Y[nm] Z[nm]`, `columns.rs`), or words. A line
//! with a unit or a size must be understood, or the file is refused; other words are ignored. [`parse`] has three
//! steps:
//!
//! 1. Keys that only one program writes identify the [`Program`], whose conventions apply where a property is omitted.
//! 2. English keys have a [`Role`] (`keys.rs`), which decides how the value is read (`quantity.rs`).
//! 3. Gwyddion translates its keys into the user's language. Lines with unknown keys are therefore interpreted by their
//!    order (`unknown.rs`).
//!
//! Lengths are in µm; arrays of two are along x and y. A field's width and height are its lengths along x and y, while
//! its *heights* are the values along z. In code, `line` is the number of a line in the file, for messages, and `text`
//! is its contents; a [`Line`] is the pair of both.

mod unknown;

use super::super::raw::FirstRow;
use super::super::units::micrometres;
use super::columns::{Columns, column_titles};
use super::keys::{Along, Role, role};
use super::numbers::Line;
use super::quantity::{Quantity, bracketed, quantity};
use unknown::UnknownPair;

/// Largest number of words of a key that only a blank separates from its number, as in `Number of lines 48`. Longer
/// lines are taken for prose; a smaller limit would miss this key.
const KEY_WORDS_MAX: usize = 3;
/// Largest number of characters of a line that a message quotes, so that the message stays readable.
const QUOTED_MAX: usize = 80;

/// Program that wrote a header. The conventions of the program apply to properties that the header omits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Program {
    /// Another or unknown program.
    #[default]
    Other,
    /// SPIP, software for scanning-probe images: lengths in nm, rows from the top.
    Spip,
    /// WSxM, also for scanning-probe images: rows from the top; heights in the unit of their range.
    Wsxm,
    /// Geographic grids in the format of ESRI: rows from the top; no unit, so lengths are taken for µm.
    Esri,
    /// Gwyddion: rows from the top.
    Gwyddion,
}

/// Unit of the heights according to a header.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) enum HeightUnit {
    /// Not mentioned; the heights are taken for µm.
    #[default]
    NotGiven,
    /// A length: as written, and in µm.
    Length(String, f64),
    /// Mentioned, but empty: the program knew no unit, so none is assumed, and the option `max_height` is needed.
    Empty,
    /// Not a length; the text is the error message. [`parse`] fails with this message only after the last line. A later
    /// line may still give the height of one such unit ([`Role::HeightFactor`]), as for holograms in radians.
    NoLength(String),
}

/// Properties that a header gives.
#[derive(Debug, Default)]
pub(super) struct Header {
    /// Numbers of points along x and y.
    pub counts: [Option<usize>; 2],
    /// Extent of the field along x and y in µm.
    pub extent_um: [Option<f64>; 2],
    /// Spacings along x and y in µm.
    pub step_um: [Option<f64>; 2],
    /// Length of the longer side in µm, from a key without an axis.
    pub edge_um: Option<f64>,
    /// Unit of the heights. The last line with a unit decides, but a factor in nm per value ([`Role::NmPerValue`])
    /// counts only if no earlier line gives a unit.
    pub height_unit: HeightUnit,
    /// Units of x and y of points, in µm.
    pub lateral_um: Option<[f64; 2]>,
    /// Place of the file's first row, top or bottom; `None` for an unknown program.
    pub first_row: Option<FirstRow>,
    /// Name of the channel.
    pub channel: Option<String>,
    /// Number that marks missing points.
    pub no_data: Option<f64>,
    /// Whether a mask of equal size follows the heights. The mask is 0 at missing points.
    pub has_mask: bool,
    /// Whether the columns are titled x, y and z.
    pub has_points: bool,
    /// Numbers of points from keys without an axis, to be checked against the data.
    pub loose_counts: Vec<LooseCount>,
}

/// A number of points that may be that along x, that along y, or that of the whole field.
#[derive(Debug)]
pub(super) struct LooseCount {
    /// Number of the line in the file.
    pub line: usize,
    /// Number of points.
    pub count: usize,
}

/// Error for a line with a size or a unit that is not understood.
fn not_understood(line: usize, text: &str) -> String {
    format!(
        "line {line}, \"{}\", carries a size or a unit that is not understood; remove the line, and give `pixel_size`",
        text.trim().chars().take(QUOTED_MAX).collect::<String>()
    )
}

/// Reads the lines of a header.
///
/// # Errors
/// A line with a size or a unit that is not understood, or a unit of heights that is not a length.
pub(super) fn parse(lines: &[Line]) -> Result<Header, String> {
    let mut header = Header::default();
    let program = recognised_program(lines);
    let mut unknown = Vec::new();
    for &(line, text) in lines {
        // The line without comment signs, quotes and separators around it.
        let bare = text.trim_start_matches(|c: char| c.is_whitespace() || "#%;*!/'\"".contains(c));
        let bare = bare.trim_end_matches(|c: char| c.is_whitespace() || ",;\"".contains(c));
        if let Some(titles) = column_titles(bare) {
            header.store_columns(titles.map_err(|reason| format!("line {line}: {reason}"))?);
            continue;
        }
        let pairs = key_value_pairs(bare);
        if pairs.is_empty() {
            header.interpret_words(line, bare)?;
        }
        for (key, value) in pairs {
            if !header.store_pair(program, (line, text), &key, &value)? {
                unknown.push(UnknownPair { line, text, quantity: quantity(&value), value, is_used: false });
            }
        }
    }
    header.interpret_unknown(unknown)?;
    if let HeightUnit::NoLength(reason) = header.height_unit {
        return Err(reason);
    }
    // All known programs write the top row first.
    let is_known = program != Program::Other || header.is_of_gwyddion();
    header.first_row = is_known.then_some(FirstRow::Top);
    Ok(header)
}

/// Recognises the program by keys that only it writes.
fn recognised_program(lines: &[Line]) -> Program {
    // Whether a line begins with `with`, given in lower case, after its comment signs.
    let begins = |text: &str, with: &str| text.trim_start_matches(['#', ' ', '\t']).to_lowercase().starts_with(with);
    // Whether any line begins with `with`.
    let has = |with: &str| lines.iter().any(|(_, text)| begins(text, with));
    if has("file format = ascii") || has("bit2nm") || has("start of data") {
        Program::Spip
    } else if has("wsxm") {
        Program::Wsxm
    } else if has("ncols") && has("nrows") {
        Program::Esri
    } else if has("value units") || has("lateral units") {
        Program::Gwyddion
    } else {
        Program::Other
    }
}

/// Pairs of key and value in a line. Lines of words have none. Several pairs have the form `key=value` each, with
/// blanks between the pairs.
fn key_value_pairs(text: &str) -> Vec<(String, String)> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let is_pair = |word: &&str| word.matches('=').count() == 1 && !word.starts_with('=');
    // Several pairs, such as `nx=48 ny=32`.
    if words.len() > 1 && words.iter().all(is_pair) {
        return words.iter().filter_map(|word| word.split_once('=')).map(|(k, v)| (k.into(), v.into())).collect();
    }
    // The third sign is the full-width colon of Chinese and Japanese texts.
    let by_sign = || text.split_once(['=', ':', '：']);
    // Two cells of a table, such as `Width;48`.
    let by_cell = || text.split_once(['\t', ';', ',']);
    // `ncols 48`: the value begins at the number.
    let by_number = || {
        let start = text.find(|c: char| c.is_ascii_digit() || "+-.".contains(c))?;
        let starts_word = text[..start].ends_with(char::is_whitespace);
        let is_key = text[..start].split_whitespace().count() <= KEY_WORDS_MAX;
        (starts_word && is_key && quantity(&text[start..]).is_some()).then(|| text.split_at(start))
    };
    let Some((key, value)) = by_sign().or_else(by_cell).or_else(by_number) else { return Vec::new() };
    let (key, value) = (key.trim(), value.trim());
    // A unit in brackets behind the key, such as `width (µm)` or `factor (-> m)`, is moved to the value.
    let unit_at = key.find(['[', '(']);
    let unit = unit_at.and_then(|at| bracketed(&key[at..]).map(|(unit, _)| (at, unit.trim_start_matches("-> "))));
    match unit {
        Some((at, unit)) if micrometres(unit).is_ok() => {
            vec![(key[..at].trim().to_owned(), format!("{value} {unit}"))]
        }
        _ => vec![(key.to_owned(), value.to_owned())],
    }
}

impl Header {
    /// Whether the header has the properties that Gwyddion writes for a matrix, whatever the language: both lengths and
    /// the unit of the heights, but no numbers of points.
    fn is_of_gwyddion(&self) -> bool {
        self.extent_um.iter().all(Option::is_some)
            && self.counts == [None, None]
            && self.height_unit != HeightUnit::NotGiven
    }

    /// Stores the property of one pair of a line. Returns `false` if the key is unknown.
    ///
    /// # Errors
    /// A value that does not fit its key, and a unit that is not a length.
    fn store_pair(&mut self, program: Program, (line, text): Line, key: &str, value: &str) -> Result<bool, String> {
        let refuse = || not_understood(line, text);
        // The value as one or two numbers with a unit, or an error.
        let parsed = || quantity(value).ok_or_else(refuse);
        // The value as a single number, whatever its unit.
        let number = || -> Result<f64, String> {
            match parsed()?.numbers.as_slice() {
                [number] => Ok(*number),
                _ => Err(refuse()),
            }
        };
        match role(key) {
            Role::Irrelevant => {}
            Role::Channel => self.channel = Some(value.to_owned()),
            Role::HeightUnit => self.height_unit = height_unit(value).unwrap_or_else(HeightUnit::NoLength),
            Role::HeightFactor => {
                // Height of a stored number of 1: the unit of the stored numbers in µm.
                let unit_um = parsed()?.lengths_um().ok_or_else(refuse)?[0];
                self.height_unit = HeightUnit::Length(value.to_owned(), unit_um);
            }
            Role::LateralUnit => self.lateral_um = Some([micrometres(value)?; 2]),
            Role::NmPerValue => {
                let nm = number()?;
                if self.height_unit == HeightUnit::NotGiven {
                    self.height_unit = HeightUnit::Length(format!("{nm} nm"), nm * 1e-3);
                }
            }
            Role::MaskedPoints => self.has_mask = number()? > 0.0,
            Role::NoData => self.no_data = Some(number()?),
            Role::HeightRange => {
                let unit = parsed()?.unit;
                if program == Program::Wsxm {
                    self.height_unit = height_unit(&unit)?;
                } else if !unit.is_empty() && self.height_unit == HeightUnit::NotGiven {
                    // In files of other programs the unit of the range need not be that of the heights.
                    return Err(refuse());
                }
            }
            Role::Step(along) => {
                let found = parsed()?;
                let steps = found.per_point_um().or_else(|| lengths(program, &found)).ok_or_else(refuse)?;
                self.store_steps(along, &steps);
            }
            Role::Size(along) => self.store_size(program, along, line, key, &parsed()?).ok_or_else(refuse)?,
            Role::Unknown => return Ok(false),
        }
        Ok(true)
    }

    /// Stores a size, whose unit tells its kind; `None` if the value does not fit.
    ///
    /// - A length for each point (`nm/px`), or a length if the key names pixels or a resolution, is a spacing.
    /// - Another length is an extent.
    /// - A number without a unit, or with points as its unit, is a number of points.
    fn store_size(&mut self, program: Program, along: Along, line: usize, key: &str, found: &Quantity) -> Option<()> {
        let key = key.to_lowercase();
        let is_pixel_size = key.contains("pixel") || key.contains("resolution");
        if let Some(steps) = found.per_point_um().or_else(|| found.lengths_um().filter(|_| is_pixel_size)) {
            self.store_steps(along, &steps);
            return Some(());
        }
        // SPIP omits the unit of lengths.
        let is_length = found.lengths_um().is_some() || (program == Program::Spip && key.contains("length"));
        // A key without an axis has two numbers, or one, which is kept without an axis.
        if is_length {
            match (along.axis(), lengths(program, found)?.as_slice()) {
                (None, [edge]) => self.edge_um = Some(*edge),
                (None, [x, y]) => self.extent_um = [Some(*x), Some(*y)],
                (Some(axis), [length]) => self.extent_um[axis] = Some(*length),
                _ => return None,
            }
        } else {
            match (along.axis(), found.counts()?.as_slice()) {
                (None, [count]) => self.loose_counts.push(LooseCount { line, count: *count }),
                (None, [x, y]) => self.counts = [Some(*x), Some(*y)],
                (Some(axis), [count]) => self.counts[axis] = Some(*count),
                _ => return None,
            }
        }
        Some(())
    }

    /// Stores a spacing in µm. `steps` holds one number for each axis, or a single one for the axes of `along`.
    fn store_steps(&mut self, along: Along, steps: &[f64]) {
        let (x, y) = (steps[0], steps[steps.len() - 1]);
        match along {
            Along::X => self.step_um[0] = Some(x),
            Along::Y => self.step_um[1] = Some(y),
            Along::Both => self.step_um = [Some(x), Some(y)],
        }
    }

    /// Stores the units of titled columns.
    fn store_columns(&mut self, titles: Columns) {
        self.has_points = true;
        if let Some(lateral_um) = titles.lateral_um {
            self.lateral_um = Some(lateral_um);
        }
        if let Some((unit, unit_um)) = titles.height {
            self.height_unit = HeightUnit::Length(unit, unit_um);
        }
    }

    /// Interprets a line without a key: a unit of the heights in words, such as `heights in nm`, or prose.
    ///
    /// # Errors
    /// A line with a length, or with a unit of length for another quantity than the heights.
    fn interpret_words(&mut self, line: usize, text: &str) -> Result<(), String> {
        let Some(unit) = named_unit(text) else {
            return if mentions_length(text) { Err(not_understood(line, text)) } else { Ok(()) };
        };
        let nouns = ["height", "value", "data", "topography", "elevation", "relief", "z"];
        let lower = text.to_lowercase();
        let mut words = lower.split(|c: char| !c.is_alphanumeric());
        // A noun may be in the plural.
        if !words.any(|word| nouns.contains(&word.trim_end_matches('s'))) {
            return Err(not_understood(line, text));
        }
        self.height_unit = height_unit(&unit)?;
        Ok(())
    }
}

/// Numbers as lengths in µm; `None` unless their unit is a length. Numbers without a unit are in nm in SPIP's files,
/// and are taken for µm in ESRI's grids.
fn lengths(program: Program, found: &Quantity) -> Option<Vec<f64>> {
    let in_unit =
        |unit_um: f64| found.unit.is_empty().then(|| found.numbers.iter().map(|number| number * unit_um).collect());
    found.lengths_um().or_else(|| match program {
        Program::Spip => in_unit(1e-3),
        Program::Esri => in_unit(1.0),
        _ => None,
    })
}

/// Unit of the heights from a value, which may be in brackets or quotes.
///
/// # Errors
/// A unit that is not a length.
fn height_unit(unit: &str) -> Result<HeightUnit, String> {
    let unit = unit.trim().trim_matches(|c| "[](){}\"".contains(c)).trim();
    if unit.is_empty() {
        return Ok(HeightUnit::Empty);
    }
    let unit_um = micrometres(unit).map_err(|error| format!("the heights have {error}"))?;
    Ok(HeightUnit::Length(unit.to_owned(), unit_um))
}

/// Unit of length, in brackets or after the word "in", in a line such as `Height (nm)` or `heights in nm`; `None`
/// without one.
fn named_unit(text: &str) -> Option<String> {
    let in_brackets = text.find(['[', '(']).and_then(|at| bracketed(&text[at..])).map(|(unit, _)| unit);
    let words: Vec<&str> = text.split_whitespace().collect();
    let after_in = words.windows(2).find(|pair| pair[0].eq_ignore_ascii_case("in")).map(|pair| pair[1]);
    let is_unit = |unit: &&str| micrometres(unit).is_ok();
    in_brackets.filter(is_unit).or_else(|| after_in.filter(is_unit)).map(str::to_owned)
}

/// Whether a text contains a number with a unit of length, such as `scan of 10 µm`.
fn mentions_length(text: &str) -> bool {
    let words: Vec<&str> = text.split(|c: char| c.is_whitespace() || ",;()[]".contains(c)).collect();
    let is_length = |text: &str| quantity(text).is_some_and(|found| found.lengths_um().is_some());
    words.iter().any(|word| is_length(word)) || words.windows(2).any(|pair| is_length(&pair.join(" ")))
}
