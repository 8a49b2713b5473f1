//! Text: matrices of numbers, or points x, y, z, with the headers of many programs.
//!
//! SPIP and WSxM are programs for scanning-probe images, NanoScope is Bruker's; ESRI's and Surfer's grids are
//! geographic.
//!
//! | program | recognised by | properties in the header |
//! | --- | --- | --- |
//! | Gwyddion | `# Width`, `# Height`, `# Value units` in any language | size, unit |
//! | SPIP | `# File Format = ASCII` | numbers of points, size in nm, unit |
//! | WSxM | a line that begins with `WSxM` | size, unit |
//! | ESRI | `ncols`, `nrows` | numbers of points, spacing, missing points |
//! | Surfer | `DSAA` | numbers of points, range of x and y |
//! | NanoScope | `\*File list` | numbers of points, size; a title of each column |
//! | others | `key: value`, `key = value`, titles of columns | all keys of `keys.rs` |
//!
//! Steps: decode the bytes (`encoding.rs`), split header and numbers, interpret the header (`header/`), read the
//! numbers (`numbers.rs`), and decide between a matrix and points. Lists, profiles and tables with coordinates or an
//! index are refused, since each would pass for a relief. Errors complete "not a usable … height field: ".
//!
//! A [`Line`] is a line's number in the file and its text. A [`Table`] holds all numbers of the text. The result is a
//! [`Raw`] (`raw.rs`): heights in the order of the file, with unit ([`Meaning`]), pixel size and place of the first
//! row.

mod columns;
mod header;
mod keys;
mod nanoscope;
mod numbers;
mod points;
mod quantity;
mod surfer;

use super::provenance::{Source, Understood};
use super::raw::{FirstRow, rounded};
use super::{Meaning, Parsed, Raw, channel, encoding};
use header::{Header, HeightUnit};
use ndarray::Array2;
use numbers::{Line, Table};

/// Smallest number of columns of a matrix without a header. Fewer columns are a profile or a list.
const COLUMNS_MIN: usize = 4;
/// Smallest number of rows of a matrix without a header. Fewer rows are profiles.
const ROWS_MIN: usize = 3;
/// Smallest number of lines of three numbers that may be points without a title: a grid of 2 × 2.
const POINTS_MIN: usize = 4;
/// Largest number of columns of a list of points with further numbers, such as an index or an intensity. More columns
/// are a matrix. A larger limit would search more matrices for points by chance.
const POINT_COLUMNS_MAX: usize = 8;
/// Smallest length of a sequence of equal steps that is taken for coordinates. Shorter sequences may be a coincidence
/// in a relief; a larger limit would miss the coordinates of small tables.
const RAMP_MIN: usize = 5;
/// Largest deviation of a number from equal steps, as a fraction of the step. It allows for the rounding of coordinates
/// with few decimals. A larger one would take smooth slopes of a relief for coordinates.
const RAMP_TOLERANCE: f64 = 1e-3;
/// Largest relative difference between a given spacing and the extent divided by the number of points. It allows for
/// the rounding of both in the header. A larger one would overlook contradictions.
const SPACING_AGREEMENT: f64 = 1e-2;

/// Contents that an extension allows.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A matrix, or points.
    Any,
    /// Points x, y, z.
    Points,
}

/// Reads a matrix or points: the parser of `.txt`, `.csv`, `.asc`, `.dat` and `.grd`.
pub(super) fn parse(bytes: &[u8], channel_option: Option<&str>) -> Parsed {
    parse_kind(bytes, channel_option, Kind::Any)
}

/// Reads points only: the parser of `.xyz`.
pub(super) fn parse_points(bytes: &[u8], channel_option: Option<&str>) -> Parsed {
    parse_kind(bytes, channel_option, Kind::Points)
}

/// Reads the contents that `kind` allows; common to [`parse`] and [`parse_points`].
/// `channel_option` must be `None`, except for NanoScope's text.
fn parse_kind(bytes: &[u8], channel_option: Option<&str>, kind: Kind) -> Parsed {
    surfer::refuse_binary(bytes)?;
    let text = encoding::text(bytes)?;
    let lines = numbered_lines(&text);
    if nanoscope::is_export(&lines) {
        return nanoscope::parse(&lines, channel_option);
    }
    channel::refuse(channel_option)?;
    if surfer::is_grid(&lines) {
        return surfer::parse(&lines);
    }
    let (head, data) = split(&lines)?;
    if data.is_empty() {
        return Err("it holds no numbers".to_owned());
    }
    let header = header::parse(&head)?;
    let table = numbers::table(&data)?;
    if header.has_points || kind == Kind::Points {
        return from_points(&header, &table);
    }
    // Numbers of points along x and y from the header, and the count of numbers in each line. `columns` is an error if
    // lines have different counts.
    match (header.counts, table.columns()) {
        ([Some(nx), Some(ny)], columns) => {
            // The header gives the size, so the lines of a matrix may be of any length. But nx·ny lines of three
            // numbers are points, unless nx is 3.
            let total = table.values.len();
            let three_each = nx.checked_mul(ny).and_then(|points| points.checked_mul(3));
            let is_points = columns == Ok(3) && nx != 3 && three_each == Some(total);
            if is_points { from_points(&header, &table) } else { from_matrix(&header, table.values, nx, ny) }
        }
        (_, columns) => {
            let (columns, rows) = (columns?, table.rows.len());
            if columns == 3 && header.extent_um == [None, None] && rows >= POINTS_MIN {
                return from_points(&header, &table).map_err(|reason| {
                    format!(
                        "its three columns are neither points x, y, z ({reason}) nor a height field, which has more \
                         columns"
                    )
                });
            }
            // With a size in its header even a small matrix is a field.
            if header.extent_um == [None, None] && header.step_um == [None, None] {
                refuse_profiles(columns, rows)?;
                refuse_point_lists(&table, columns, rows)?;
                refuse_coordinates(&table, columns)?;
            }
            from_matrix(&header, table.values, columns, rows)
        }
    }
}

/// Lines with their numbers from 1. They end with LF, CR LF or CR; DOS programs may end a file with Ctrl-Z.
fn numbered_lines(text: &str) -> Vec<Line<'_>> {
    let text = text.trim_end_matches('\u{1a}');
    let mut lines: Vec<&str> = text.split('\n').collect();
    if lines.len() == 1 {
        lines = text.split('\r').collect();
    }
    lines.into_iter().enumerate().map(|(at, line)| (at + 1, line.trim_end_matches('\r'))).collect()
}

/// Lines of the header, and lines of numbers.
type Parts<'a> = (Vec<Line<'a>>, Vec<Line<'a>>);

/// Splits lines into header and numbers. The header is all text before the first number, and all comments.
///
/// # Errors
/// Words between numbers.
fn split<'a>(lines: &[Line<'a>]) -> Result<Parts<'a>, String> {
    let (mut head, mut data): Parts = Default::default();
    for &(line, text) in lines {
        let (content, comment) = without_comment(text);
        if !comment.trim().is_empty() {
            head.push((line, comment));
        }
        if content.trim().is_empty() {
            continue;
        }
        if numbers::is_numeric(content) {
            data.push((line, content));
        } else if data.is_empty() && !content.split_whitespace().next().is_some_and(numbers::is_numeric) {
            head.push((line, content));
        } else {
            let word = content.split_whitespace().find(|word| !numbers::is_numeric(word)).unwrap_or(content);
            return Err(format!("\"{word}\" in line {line} is not a number"));
        }
    }
    Ok((head, data))
}

/// Contents and comment of a line. `#` begins a comment at the start of a word; `%`, `!`, `;` and `//` at the start of
/// a line.
fn without_comment(text: &str) -> (&str, &str) {
    let start = text.trim_start();
    if ["%", "!", "//", ";"].iter().any(|sign| start.starts_with(sign)) {
        return ("", text);
    }
    let starts_word =
        |start: &usize| text[..*start].chars().next_back().is_none_or(|c| c.is_whitespace() || ",;\"".contains(c));
    let comment = text.match_indices('#').map(|(start, _)| start).find(starts_word);
    comment.map_or((text, ""), |start| text.split_at(start))
}

/// Refuses matrices with too few columns or rows for a relief.
fn refuse_profiles(columns: usize, rows: usize) -> Result<(), String> {
    let advice = "a height field has at least four columns and three rows";
    match (columns, rows) {
        (1, _) | (_, 1) => Err(format!(
            "it holds one {} of {} numbers, a list or a profile: {advice}",
            if rows == 1 { "row" } else { "column" },
            columns * rows
        )),
        (2, _) => Err(format!("it holds two columns of {rows} numbers, a profile or decimal commas: {advice}")),
        _ if columns < COLUMNS_MIN || rows < ROWS_MIN => {
            Err(format!("it holds {rows} rows of {columns} numbers, profiles or a list: {advice}"))
        }
        _ => Ok(()),
    }
}

/// Refuses points with further columns: an index may come before x, other values after z. `columns` is at least 4.
fn refuse_point_lists(table: &Table, columns: usize, rows: usize) -> Result<(), String> {
    // Lists of points have few columns and many rows.
    if columns > POINT_COLUMNS_MAX || rows <= columns {
        return Ok(());
    }
    // Three consecutive columns of every row, from column `skip` on.
    let three_columns = |skip: usize| -> Vec<f64> {
        table.values.chunks_exact(columns).flat_map(|row| row[skip..skip + 3].iter().copied()).collect()
    };
    // Whether these columns are points x, y, z on a grid of more than one row and column. The unit does not matter, so
    // it is 1.
    let is_list = |skip: usize| {
        points::grid(&three_columns(skip), [1.0; 2]).is_ok_and(|grid| {
            let (ny, nx) = grid.values.dim();
            ny > 1 && nx > 1
        })
    };
    if is_list(0) || is_list(1) {
        return Err(format!("its {columns} columns hold points x, y, z and more: keep the columns x, y and z"));
    }
    Ok(())
}

/// Refuses matrices with coordinates or an index in the first row or column.
fn refuse_coordinates(table: &Table, columns: usize) -> Result<(), String> {
    // First row and column without the corner, which is arbitrary in a table with coordinates.
    let row: Vec<f64> = table.values[1..columns].to_vec();
    let column: Vec<f64> = table.values.iter().skip(columns).step_by(columns).copied().collect();
    let (row_ramp, column_ramp) = (ramp(&row), ramp(&column));
    // An index counts from 0 or 1 in steps of 1. A ramp is the pair of first number and step.
    let is_index = |found: Option<(f64, f64)>| found.is_some_and(|found| found == (0.0, 1.0) || found == (1.0, 1.0));
    // A ramp along one side only may be a relief, unless it is an index.
    let both_are_ramps = row_ramp.is_some() && column_ramp.is_some();
    let which = match (both_are_ramps, is_index(row_ramp), is_index(column_ramp)) {
        (true, ..) => "row and column",
        (_, true, _) => "row",
        (_, _, true) => "column",
        _ => return Ok(()),
    };
    // A plane has equal steps in every column, also in the last, and is a relief.
    let last: Vec<f64> = table.values.iter().skip(columns - 1).step_by(columns).copied().collect();
    if ramp(&last).is_some() {
        return Ok(());
    }
    Err(format!("its first {which} counts in equal steps, as coordinates or an index do: remove it"))
}

/// First number and step of a sequence with equal steps, to rounding; `None` for any other sequence.
fn ramp(numbers: &[f64]) -> Option<(f64, f64)> {
    let (first, last) = (*numbers.first()?, *numbers.last()?);
    let step = (last - first) / (numbers.len() - 1) as f64;
    let is_on_line =
        |(at, value): (usize, &f64)| (value - (first + at as f64 * step)).abs() <= RAMP_TOLERANCE * step.abs();
    let is_ramp =
        numbers.len() >= RAMP_MIN && step != 0.0 && step.is_finite() && numbers.iter().enumerate().all(is_on_line);
    is_ramp.then_some((first, step))
}

/// Meaning of the heights according to a header. Without mention of a unit they are in µm; with an empty unit the
/// option `max_height` gives the scale.
fn meaning(header: &Header) -> Meaning {
    match &header.height_unit {
        HeightUnit::NotGiven => Meaning::Lengths { unit_um: 1.0, unit: Understood::new(Source::Default, "µm") },
        HeightUnit::Length(unit, unit_um) => Meaning::in_unit(unit, *unit_um),
        // `header::parse` has already refused `NoLength`.
        HeightUnit::Empty | HeightUnit::NoLength(_) => Meaning::Unknown,
    }
}

/// Adds the channel's name, if the header has one.
fn with_channel(header: &Header, raw: Raw) -> Raw {
    match &header.channel {
        Some(name) if !name.is_empty() => raw.channel(name, None),
        _ => raw,
    }
}

/// Contents from points x, y, z.
fn from_points(header: &Header, table: &Table) -> Parsed {
    let columns = table.columns()?;
    if columns != 3 {
        return Err(format!("its rows have {columns} numbers; x, y and z are needed"));
    }
    let mut numbers = table.values.clone();
    mark_missing(header, numbers.iter_mut().skip(2).step_by(3));
    // Without a unit in the header, x and y are in µm.
    let grid = points::grid(&numbers, header.lateral_um.unwrap_or([1.0; 2]))?;
    if header.lateral_um.is_none() && header.height_unit != HeightUnit::NotGiven {
        return Err("its header has a unit for z, but none for x and y".to_owned());
    }
    // The coordinates in the file give the order of the rows.
    let source = if header.lateral_um.is_some() { Source::File } else { Source::Default };
    let raw = Raw::new(grid.values, meaning(header), FirstRow::Bottom).pixel(grid.pixel_um).pixel_from(source);
    Ok(with_channel(header, raw.rows_from(Source::File)))
}

/// Contents from a matrix of `nx` by `ny` heights, followed by a mask of equal size if the header says so.
fn from_matrix(header: &Header, mut values: Vec<f64>, nx: usize, ny: usize) -> Parsed {
    let total =
        nx.checked_mul(ny).filter(|total| *total > 0).ok_or("its header promises a size that is not possible")?;
    let expected = if header.has_mask { total.checked_mul(2) } else { Some(total) };
    if Some(values.len()) != expected {
        let mask = if header.has_mask { " and a mask of as many" } else { "" };
        return Err(format!("its header promises {nx} × {ny} heights{mask}, but {} numbers follow", values.len()));
    }
    for (promised, found) in header.counts.into_iter().zip([nx, ny]) {
        if let Some(promised) = promised.filter(|promised| *promised != found) {
            return Err(format!("its header promises {promised} points along an axis, but {found} follow"));
        }
    }
    // Counts for which the header names no axis.
    if let Some(loose) = header.loose_counts.iter().find(|loose| ![nx, ny, total].contains(&loose.count)) {
        return Err(format!("line {} says {} points, but {nx} × {ny} follow", loose.line, loose.count));
    }
    // The mask is 0 at missing points.
    let mask = values.split_off(total);
    for (value, flag) in values.iter_mut().zip(mask) {
        if flag == 0.0 {
            *value = f64::NAN;
        }
    }
    mark_missing(header, values.iter_mut());
    let (pixel_um, source) = pixel(header, nx, ny)?;
    let values = Array2::from_shape_vec((ny, nx), values).map_err(|error| error.to_string())?;
    let first_row = header.first_row.unwrap_or(FirstRow::Bottom);
    // The convention of a known program counts as given by the format.
    let rows_source = if header.first_row.is_some() { Source::Format } else { Source::Default };
    let raw = Raw::new(values, meaning(header), first_row).pixel(pixel_um).pixel_from(source).rows_from(rows_source);
    Ok(with_channel(header, raw))
}

/// Replaces by NaN the value that stands for a missing point according to the header.
fn mark_missing<'a>(header: &Header, values: impl Iterator<Item = &'a mut f64>) {
    let Some(no_data) = header.no_data else { return };
    for value in values.filter(|value| **value == no_data) {
        *value = f64::NAN;
    }
}

/// Pixel size along x and y in µm from a header, and its source: the spacing, or the extent divided by the number of
/// points. `None` without either.
///
/// # Errors
/// A spacing that contradicts the extent, or a size along one axis only.
fn pixel(header: &Header, nx: usize, ny: usize) -> Result<(Option<(f64, f64)>, Source), String> {
    let counts = [nx as f64, ny as f64];
    let mut pixel_um = [None; 2];
    for axis in 0..2 {
        let by_extent = header.extent_um[axis].map(|length| length / counts[axis]);
        if let (Some(step), Some(length)) = (header.step_um[axis], header.extent_um[axis]) {
            let agrees = |count: f64| (step * count / length - 1.0).abs() < SPACING_AGREEMENT;
            // Some programs count the extent from the first point to the last: one interval less than points.
            if !agrees(counts[axis]) && !agrees(counts[axis] - 1.0) {
                return Err(format!(
                    "its header gives a spacing of {} µm and a length of {} µm for {} points",
                    rounded(step),
                    rounded(length),
                    counts[axis]
                ));
            }
        }
        pixel_um[axis] = header.step_um[axis].or(by_extent);
    }
    match (pixel_um, header.edge_um) {
        ([Some(dx), Some(dy)], _) => Ok((Some((dx, dy)), Source::File)),
        // One length for both axes is that of the longer side, with square pixels.
        ([None, None], Some(edge)) => {
            let step = edge / counts[0].max(counts[1]);
            Ok((Some((step, step)), if nx == ny { Source::File } else { Source::Guess }))
        }
        // The option `pixel_size` is then needed.
        ([None, None], None) => Ok((None, Source::Option)),
        ([along_x, _], _) => {
            let (given, missing) = if along_x.is_some() { ("x", "y") } else { ("y", "x") };
            Err(format!("its header gives a size along {given} and none along {missing}"))
        }
    }
}
