//! A matrix of numbers in µm: one row a line, separated by blanks, commas or semicolons; `#` begins a comment.

use super::{Parsed, Raw, Values, channel};
use ndarray::Array2;

/// All numbers of a text, row after row, and how many there are in each of them; at least one.
pub(super) fn table(bytes: &[u8]) -> Result<(Vec<f64>, usize), String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is not UTF-8 text")?;
    let mut values: Vec<f64> = Vec::new();
    let mut columns = 0;
    for (line, content) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let content = content.split('#').next().unwrap_or_default();
        let before = values.len();
        for word in content.split(|c: char| c.is_whitespace() || c == ',' || c == ';').filter(|w| !w.is_empty()) {
            let value = word.parse().map_err(|_| format!("\"{word}\" in line {} is not a number", line + 1))?;
            values.push(value);
        }
        let found = values.len() - before;
        if columns == 0 {
            columns = found;
        } else if found != columns && found != 0 {
            return Err(format!("line {} has {found} numbers, the first row has {columns}", line + 1));
        }
    }
    if columns == 0 {
        return Err("it holds no numbers".to_owned());
    }
    Ok((values, columns))
}

pub(super) fn parse(bytes: &[u8], wanted: Option<&str>) -> Parsed {
    channel::refuse(wanted)?;
    let (values, columns) = table(bytes)?;
    let rows = values.len() / columns;
    let values = Array2::from_shape_vec((rows, columns), values).map_err(|error| error.to_string())?;
    Ok(Raw { values, top_down: false, pixel_um: None, meaning: Values::Micrometres, channel: None })
}
