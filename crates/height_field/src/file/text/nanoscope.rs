//! Text exported by NanoScope Analysis: the header of its binary files, then an optional line of titles, and numbers.

use super::super::channel::{self, Channel};
use super::super::nanoscope::{pixel_size, sections};
use super::super::raw::FirstRow;
use super::super::units::micrometres;
use super::super::{Meaning, Parsed, Raw};
use super::numbers::{self, Line};
use super::quantity::bracketed;
use ndarray::Array2;

/// Whether a text begins with the header of NanoScope's files.
pub(super) fn is_export(lines: &[Line]) -> bool {
    lines.iter().find(|(_, text)| !text.trim().is_empty()).is_some_and(|(_, text)| is_header(text))
}

/// Whether a line belongs to the header, whose lines begin with a backslash and may be in quotes.
fn is_header(text: &str) -> bool {
    text.trim_start_matches('"').starts_with('\\')
}

/// Reads the channel that `channel_option` names (number from 1, or title), or the default one of `channel.rs`.
///
/// The header gives nx points a row and ny rows. Numbers come in one of two layouts: ny lines of nx numbers (a matrix)
/// for a single channel, or nx·ny lines with one number for each channel. Both begin with the bottom row of the scan.
pub(super) fn parse(lines: &[Line], channel_option: Option<&str>) -> Parsed {
    let header: Vec<&str> =
        lines.iter().filter(|(_, text)| is_header(text)).map(|(_, text)| text.trim_matches('"')).collect();
    let header = header.join("\n");
    let header_sections = sections(&header);
    // All channels have the size of the first image, since they share the lines.
    let image = header_sections.iter().find(|section| section.is_image()).ok_or("its header describes no image")?;
    let (nx, ny) = (image.count("Samps/line")?, image.count("Number of lines")?);
    let mut body: Vec<Line> =
        lines.iter().copied().filter(|(_, text)| !is_header(text) && !text.trim().is_empty()).collect();
    let titles = match body.first() {
        Some((_, text)) if !numbers::is_numeric(text) => body.remove(0).1,
        _ => "",
    };
    let table = numbers::table(&body)?;
    let columns = table.columns()?;
    let total = nx.checked_mul(ny).ok_or("its size is too large")?;
    let pixel = pixel_size(image, &header_sections, (nx, ny))?;
    let is_matrix = columns == nx && table.rows.len() == ny;
    if !is_matrix && table.rows.len() != total {
        let rows = table.rows.len();
        return Err(format!("its header promises {nx} × {ny} points, but {rows} lines of {columns} numbers follow"));
    }
    let channels = column_channels(titles, if is_matrix { 1 } else { columns });
    // Without the option a single channel is read whatever its title.
    let column =
        if channels.len() == 1 && channel_option.is_none() { 0 } else { channel::choose(&channels, channel_option)? };
    let values =
        if is_matrix { table.values } else { table.values.into_iter().skip(column).step_by(columns).collect() };
    let (name, unit) = title_and_unit(titles, column);
    // A unit of length makes the values heights; without a unit the scale must be given; other units are refused.
    let meaning = match micrometres(&unit) {
        Ok(unit_um) => Meaning::in_unit(&unit, unit_um),
        Err(_) if unit.is_empty() => Meaning::Unknown,
        Err(error) => return Err(format!("its channel \"{name}\" has {error}")),
    };
    let values = Array2::from_shape_vec((ny, nx), values).map_err(|error| error.to_string())?;
    let raw = Raw::new(values, meaning, FirstRow::Bottom).pixel_or_reason(pixel);
    Ok(if name.is_empty() { raw } else { raw.channel(name, channel_option) })
}

/// Title and unit of a column by its index from 0, from titles such as `Height_Sensor(nm)`. A missing title or unit is
/// empty. Empty titles do not count, since lines may end with a separator.
fn title_and_unit(titles: &str, column: usize) -> (String, String) {
    let cell =
        titles.split(['\t', ',', ';']).map(str::trim).filter(|cell| !cell.is_empty()).nth(column).unwrap_or_default();
    let cell = cell.trim_matches('"');
    let Some(start) = cell.find(['(', '[']) else { return (cell.replace('_', " "), String::new()) };
    let unit = bracketed(&cell[start..]).map_or("", |(unit, _)| unit);
    (cell[..start].trim().replace('_', " "), unit.to_owned())
}

/// A channel for each of `columns` columns, numbered from 1, with its title and unit.
fn column_channels(titles: &str, columns: usize) -> Vec<Channel> {
    let channel = |column: usize| {
        let (title, unit) = title_and_unit(titles, column);
        Channel::new(column + 1, title, unit)
    };
    (0..columns).map(channel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_is_a_single_channel() {
        let header = [r"\*Ciao image list", r"\Scan Size: 1 1 ~m", r"\Samps/line: 2", r"\Number of lines: 2"];
        let lines: Vec<Line> = (1..).zip(header.into_iter().chain(["Height(nm)", "1 2", "3 4"])).collect();
        for accepted in [None, Some("1"), Some("height")] {
            assert!(parse(&lines, accepted).is_ok());
        }
        assert!(parse(&lines, Some("Phase")).is_err_and(|message| message.contains("there is no `channel` \"Phase\"")));
    }
}
