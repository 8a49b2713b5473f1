//! Headers of texts: size, unit, orientation and channel of the numbers that follow.
//!
//! A line is `key: value`, `key = value`, titles of columns, or words. A line with a unit or a size must be understood,
//! or the file is refused; other words are ignored. [`parse`] takes the lines in three steps:
//!
//! 1. Keys that only one program writes identify the [`Program`], whose conventions apply where a property is omitted.
//! 2. English keys have a [`Role`] (`keys.rs`), which decides how the value is read (`quantity.rs`).
//! 3. Gwyddion translates its keys into the user's language. Lines with unknown keys are therefore recognised by their
//!    order: channel, width, height, and unit of the values.
//!
//! Lengths are in µm; arrays of two are along x and y.

use super::super::raw::FirstRow;
use super::super::units::micrometres;
use super::columns::{Columns, columns};
use super::keys::{Along, Role, role};
use super::quantity::{Quantity, bracketed, quantity};

/// Most words of a key that is separated from its number by a blank only. Chosen: longer lines are prose.
const KEY_WORDS_MAX: usize = 3;

/// Program that wrote a header; its conventions apply to omitted properties.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Program {
    #[default]
    Other,
    /// SPIP: lengths in nm, rows from the top.
    Spip,
    /// WSxM: rows from the top; heights in the unit of their range.
    Wsxm,
    /// Geographic grids of ESRI: rows from the top, no unit.
    Esri,
    /// Gwyddion: rows from the top.
    Gwyddion,
}

/// Unit of the heights according to a header.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) enum HeightUnit {
    /// Not mentioned.
    #[default]
    Unsaid,
    /// A length: as written, and in µm.
    Length(String, f64),
    /// Mentioned without a value.
    Empty,
    /// Not a length; the text says why. A later line may replace it by a factor, as for holograms in radians.
    Other(String),
}

/// Properties that a header gives.
#[derive(Debug, Default)]
pub(super) struct Header {
    /// Numbers of points along x and y.
    pub counts: [Option<usize>; 2],
    /// Lengths of the field along x and y in µm.
    pub extent_um: [Option<f64>; 2],
    /// Spacings along x and y in µm.
    pub step_um: [Option<f64>; 2],
    /// Length of the scan in µm, where a single one is given for both axes.
    pub edge_um: Option<f64>,
    /// Unit of the heights.
    pub height: HeightUnit,
    /// Units of x and y of points, in µm.
    pub lateral_um: Option<[f64; 2]>,
    /// First row of the file.
    pub first: Option<FirstRow>,
    /// Name of the channel.
    pub channel: Option<String>,
    /// Number of missing points.
    pub no_data: Option<f64>,
    /// Whether a mask of equal size follows the heights: 0 at missing points.
    pub has_mask: bool,
    /// Whether the columns are titled x, y and z.
    pub has_points: bool,
    /// Numbers of points of an unnamed axis, as (line, count), to be checked against the data.
    pub loose_counts: Vec<(usize, usize)>,
}

/// A line with an unknown key.
struct Unexplained<'a> {
    /// Number of the line in the file.
    line: usize,
    /// The whole line.
    text: &'a str,
    /// Text after the key.
    value: String,
    /// The value as numbers with a unit.
    quantity: Option<Quantity>,
}

/// Error for a line with a size or a unit that is not understood.
fn not_understood(line: usize, text: &str) -> String {
    format!(
        "line {line}, \"{}\", carries a size or a unit that is not understood; remove the line, and give `pixel_size`",
        text.trim().chars().take(80).collect::<String>()
    )
}

/// Reads the lines of a header, each with its number in the file.
///
/// # Errors
/// A line with a size or a unit that is not understood, or a unit of heights that is not a length.
pub(super) fn parse(lines: &[(usize, &str)]) -> Result<Header, String> {
    let mut header = Header::default();
    let program = program(lines);
    let mut unexplained = Vec::new();
    for &(line, text) in lines {
        // The line without comment signs, quotes and separators around it.
        let bare = text.trim_start_matches(|c: char| c.is_whitespace() || "#%;*!/'\"".contains(c));
        let bare = bare.trim_end_matches(|c: char| c.is_whitespace() || ",;\"".contains(c));
        if let Some(titles) = columns(bare) {
            header.take_columns(titles.map_err(|unit| format!("line {line}: {unit}"))?);
            continue;
        }
        let pairs = pairs(bare);
        if pairs.is_empty() {
            header.take_words(line, bare)?;
        }
        for (key, value) in pairs {
            if !header.take(program, (line, text), &key, &value)? {
                let quantity = quantity(&value);
                unexplained.push(Unexplained { line, text, value, quantity });
            }
        }
    }
    header.take_by_position(&unexplained)?;
    if let HeightUnit::Other(reason) = header.height {
        return Err(reason);
    }
    // All known programs write the top row first.
    header.first = match program {
        Program::Other if header.is_gwyddion() => Some(FirstRow::Top),
        Program::Other => None,
        _ => Some(FirstRow::Top),
    };
    Ok(header)
}

/// Recognises the program by keys that only it writes.
fn program(lines: &[(usize, &str)]) -> Program {
    let begins = |text: &str, with: &str| text.trim_start_matches(['#', ' ', '\t']).to_lowercase().starts_with(with);
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

/// Keys and values of a line: one pair, or several of the form `key=value`. A unit in brackets behind a key is moved to
/// the value.
fn pairs(text: &str) -> Vec<(String, String)> {
    let several: Vec<&str> = text.split_whitespace().collect();
    if several.len() > 1 && several.iter().all(|word| word.matches('=').count() == 1 && !word.starts_with('=')) {
        return several.iter().filter_map(|word| word.split_once('=')).map(|(k, v)| (k.into(), v.into())).collect();
    }
    let by_sign = || text.split_once(['=', ':', '：']);
    let by_cell = || text.split_once(['\t', ';', ',']);
    // `ncols 48`: the value begins at the number.
    let by_number = || {
        let start = text.find(|c: char| c.is_ascii_digit() || "+-.".contains(c))?;
        let starts_word = text[..start].ends_with(char::is_whitespace);
        // A longer text before the number is prose.
        let is_key = text[..start].split_whitespace().count() <= KEY_WORDS_MAX;
        (starts_word && is_key && quantity(&text[start..]).is_some()).then(|| text.split_at(start))
    };
    let Some((key, value)) = by_sign().or_else(by_cell).or_else(by_number) else { return Vec::new() };
    let (key, value) = (key.trim(), value.trim());
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
    /// Whether the header has exactly the properties that Gwyddion writes.
    fn is_gwyddion(&self) -> bool {
        self.extent_um.iter().all(Option::is_some) && self.counts == [None, None] && self.height != HeightUnit::Unsaid
    }

    /// Stores the property of one pair (`key`, `value`) of a line; returns whether the key is known.
    ///
    /// A value of a size is a spacing where its unit is a length for each point, an extent where it is a length, and
    /// otherwise a number of points.
    ///
    /// # Errors
    /// A value that does not fit its key, and a unit that is not a length.
    fn take(&mut self, program: Program, (line, text): (usize, &str), key: &str, value: &str) -> Result<bool, String> {
        let refuse = || not_understood(line, text);
        let axis = |along: Along| usize::from(along == Along::Y);
        let number = || quantity(value).filter(|found| found.numbers.len() == 1).map(|found| found.numbers[0]);
        match role(key) {
            Role::Irrelevant => {}
            Role::Channel => self.channel = Some(value.to_owned()),
            Role::HeightUnit => match height_unit(value) {
                Ok(unit) => self.height = unit,
                Err(reason) => self.height = HeightUnit::Other(reason),
            },
            Role::HeightFactor => {
                let found = quantity(value).ok_or_else(refuse)?;
                let um = found.lengths_um().ok_or_else(refuse)?[0];
                self.height = HeightUnit::Length(value.to_owned(), um);
            }
            Role::LateralUnit => {
                let um = micrometres(value)?;
                self.lateral_um = Some([um; 2]);
            }
            Role::NmPerValue => {
                // The key `z-unit` takes precedence.
                let nm = number().ok_or_else(refuse)?;
                if self.height == HeightUnit::Unsaid {
                    self.height = HeightUnit::Length(format!("{nm} nm"), nm * 1e-3);
                }
            }
            Role::MaskedPoints => self.has_mask = number().ok_or_else(refuse)? > 0.0,
            Role::NoData => self.no_data = Some(number().ok_or_else(refuse)?),
            Role::HeightRange => {
                let unit = quantity(value).ok_or_else(refuse)?.unit;
                if program == Program::Wsxm {
                    self.height = height_unit(&unit)?;
                } else if !unit.is_empty() && self.height == HeightUnit::Unsaid {
                    // Outside of WSxM the values need not be in the unit of their range.
                    return Err(refuse());
                }
            }
            Role::Step(along) => {
                let found = quantity(value).ok_or_else(refuse)?;
                let steps = found.per_point_um().or_else(|| lengths(program, &found)).ok_or_else(refuse)?;
                self.take_steps(along, &steps);
            }
            Role::Size(along) => {
                let found = quantity(value).ok_or_else(refuse)?;
                let key = key.to_lowercase();
                let is_length = found.lengths_um().is_some() || (program == Program::Spip && key.contains("length"));
                let is_pixel_size = key.contains("pixel") || key.contains("resolution");
                if let Some(steps) = found.per_point_um().or_else(|| found.lengths_um().filter(|_| is_pixel_size)) {
                    self.take_steps(along, &steps);
                } else if is_length {
                    let sizes = lengths(program, &found).ok_or_else(refuse)?;
                    match (along, sizes.as_slice()) {
                        (Along::Both, [edge]) => self.edge_um = Some(*edge),
                        (Along::Both, [x, y]) => self.extent_um = [Some(*x), Some(*y)],
                        (_, [size]) => self.extent_um[axis(along)] = Some(*size),
                        _ => return Err(refuse()),
                    }
                } else {
                    let counts = found.counts().ok_or_else(refuse)?;
                    match (along, counts.as_slice()) {
                        (Along::Both, [count]) => self.loose_counts.push((line, *count)),
                        (Along::Both, [x, y]) => self.counts = [Some(*x), Some(*y)],
                        (_, [count]) => self.counts[axis(along)] = Some(*count),
                        _ => return Err(refuse()),
                    }
                }
            }
            Role::Unknown => return Ok(false),
        }
        Ok(true)
    }

    /// Stores one spacing, or those along x and y.
    fn take_steps(&mut self, along: Along, steps: &[f64]) {
        let last = steps.len() - 1;
        match along {
            Along::X => self.step_um[0] = Some(steps[0]),
            Along::Y => self.step_um[1] = Some(steps[last]),
            Along::Both => self.step_um = [Some(steps[0]), Some(steps[last])],
        }
    }

    /// Stores the units of titled columns.
    fn take_columns(&mut self, titles: Columns) {
        self.has_points = true;
        if let Some(lateral_um) = titles.lateral_um {
            self.lateral_um = Some(lateral_um);
        }
        if let Some((unit, um)) = titles.height {
            self.height = HeightUnit::Length(unit, um);
        }
    }

    /// Interprets a line without a key: a unit of the heights in words, or prose.
    fn take_words(&mut self, line: usize, text: &str) -> Result<(), String> {
        let Some(unit) = named_unit(text) else {
            return if mentions_length(text) { Err(not_understood(line, text)) } else { Ok(()) };
        };
        let lower = text.to_lowercase();
        let is_height = ["height", "value", "data", "topography", "elevation", "relief", "z"]
            .iter()
            .any(|noun| lower.split(|c: char| !c.is_alphanumeric()).any(|word| word.trim_end_matches('s') == *noun));
        if !is_height {
            return Err(not_understood(line, text));
        }
        self.height = height_unit(&unit)?;
        Ok(())
    }

    /// Interprets lines with keys in another language by their order and units.
    ///
    /// # Errors
    /// A line with a length or a unit that is left over.
    fn take_by_position(&mut self, lines: &[Unexplained]) -> Result<(), String> {
        let length = |entry: &Unexplained| {
            entry
                .quantity
                .as_ref()
                .and_then(Quantity::lengths_um)
                .filter(|found| found.len() == 1)
                .map(|found| found[0])
        };
        // Lines that have been interpreted.
        let mut used = vec![false; lines.len()];
        // Gwyddion's matrices: channel, width, height and unit of the values, in consecutive lines. Two consecutive
        // lengths are the width and the height.
        let has_next = |i: usize| lines.get(i + 1).is_some_and(|next| next.line == lines[i].line + 1);
        let width = (0..lines.len())
            .find(|&i| has_next(i) && length(&lines[i]).is_some() && lines.get(i + 1).and_then(length).is_some());
        if let Some(width) = width.filter(|_| self.extent_um == [None, None]) {
            let height = width + 1;
            self.extent_um = [length(&lines[width]), length(&lines[height])];
            used[width] = true;
            used[height] = true;
            if width > 0 && lines[width - 1].line + 1 == lines[width].line {
                self.channel.get_or_insert_with(|| lines[width - 1].value.clone());
                used[width - 1] = true;
            }
            if has_next(height) && self.height == HeightUnit::Unsaid {
                self.height = height_unit(&lines[height + 1].value)?;
                used[height + 1] = true;
            }
        }
        // Gwyddion's points: the unit of x and y, then that of the values.
        let units: Vec<usize> =
            (0..lines.len()).filter(|&i| !used[i] && micrometres(&lines[i].value).is_ok()).collect();
        let are_unsaid = self.lateral_um.is_none() && self.height == HeightUnit::Unsaid;
        if let ([lateral, value], true) = (&units[..], are_unsaid) {
            let (lateral, value) = (*lateral, *value);
            self.lateral_um = Some([micrometres(&lines[lateral].value)?; 2]);
            self.height = height_unit(&lines[value].value)?;
            used[lateral] = true;
            used[value] = true;
        }
        let left = lines.iter().zip(used).find(|(entry, used)| {
            !used && (length(entry).is_some() || micrometres(&entry.value).is_ok() || mentions_length(&entry.value))
        });
        left.map_or(Ok(()), |(entry, _)| Err(not_understood(entry.line, entry.text)))
    }
}

/// Lengths in µm. Numbers without a unit are nm in SPIP's files and µm in geographic grids.
fn lengths(program: Program, found: &Quantity) -> Option<Vec<f64>> {
    let bare = |um: f64| found.unit.is_empty().then(|| found.numbers.iter().map(|number| number * um).collect());
    found.lengths_um().or_else(|| match program {
        Program::Spip => bare(1e-3),
        Program::Esri => bare(1.0),
        _ => None,
    })
}

/// Unit of the heights from a value, which may be in brackets.
fn height_unit(unit: &str) -> Result<HeightUnit, String> {
    let unit = unit.trim().trim_matches(|c| "[](){}\"".contains(c)).trim();
    if unit.is_empty() {
        return Ok(HeightUnit::Empty);
    }
    let um = micrometres(unit).map_err(|error| format!("the heights have {error}"))?;
    Ok(HeightUnit::Length(unit.to_owned(), um))
}

/// Unit of length in a line such as `heights in nm` or `Height (nm)`.
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
