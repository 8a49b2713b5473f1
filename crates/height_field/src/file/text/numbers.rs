//! Numbers of a text: separators and decimal mark, told apart by all of its lines.

/// Words for a missing point, in lower case. `#QNAN`, `#IND` and `#INF` are how a C library of Windows prints one.
const MISSING: [&str; 9] = ["nan", "bad", "na", "n/a", "null", "none", "void", "nodata", "masked"];

/// Columns and decimal mark of the numbers of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Style {
    /// The comma is the decimal mark; otherwise it separates numbers.
    pub decimal_comma: bool,
    /// Each tab ends a cell, which may be empty. Otherwise blanks of any length are one separator.
    pub tab_cells: bool,
}

/// A line of numbers and its number in the file, from 1.
pub(super) type Line<'a> = (usize, &'a str);

/// The numbers of all lines, and how many of them are in each line.
pub(super) struct Table {
    pub values: Vec<f64>,
    /// Line number and count of numbers.
    pub rows: Vec<(usize, usize)>,
}

impl Table {
    /// Numbers in every line.
    ///
    /// # Errors
    /// Lines of different length.
    pub fn columns(&self) -> Result<usize, String> {
        let (first, columns) = *self.rows.first().ok_or("it holds no numbers")?;
        match self.rows.iter().find(|(_, count)| *count != columns) {
            Some((line, count)) => Err(format!("line {line} has {count} numbers, line {first} has {columns}")),
            None => Ok(columns),
        }
    }
}

/// Whether a line holds numbers and nothing else, under any style.
pub(super) fn is_numeric(line: &str) -> bool {
    let words = || words_of(line).flat_map(|cell| cell.split(',')).filter(|word| !word.is_empty());
    words().next().is_some() && words().all(|word| number(word).is_some())
}

fn words_of(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| c.is_whitespace() || c == ';' || c == '"').filter(|word| !word.is_empty())
}

/// A number with a decimal point, NaN for the words of a missing one, `None` for anything else.
///
/// Exponents may be Fortran's (`1.5D-07`), and a minus the typographic one.
pub(super) fn number(word: &str) -> Option<f64> {
    if let Ok(value) = word.parse() {
        return Some(value);
    }
    let lower = word.to_lowercase().replace('\u{2212}', "-");
    let windows = [".#qnan", ".#ind", ".#inf", ".#snan"].iter().any(|mark| lower.contains(mark));
    if windows || MISSING.contains(&lower.as_str()) || lower.chars().all(|c| c == '-') {
        return Some(f64::NAN);
    }
    lower
        .replace('d', "e")
        .parse()
        .ok()
        .filter(|_| lower.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)))
}

/// Evidence for the meaning of commas in lines of numbers. Each is the line in which it is seen first.
#[derive(Default)]
struct Commas {
    /// A comma between two digits.
    tight: Option<usize>,
    /// A comma before a blank.
    spaced: Option<usize>,
    /// A decimal point.
    point: Option<usize>,
    /// A semicolon, or a blank that is not beside a comma.
    other: Option<usize>,
    /// A word between commas with a leading zero that no whole number has, as in `0,05`.
    leading_zero: Option<(usize, String)>,
}

impl Commas {
    fn of(lines: &[Line]) -> Self {
        let mut seen = Self::default();
        for &(line, text) in lines {
            let bytes = text.trim().as_bytes();
            for (at, byte) in bytes.iter().enumerate() {
                let before = at.checked_sub(1).and_then(|at| bytes.get(at));
                let after = bytes.get(at + 1);
                let are_both = |is: fn(&u8) -> bool| before.is_some_and(is) && after.is_some_and(is);
                let place = match byte {
                    b'.' => &mut seen.point,
                    b';' => &mut seen.other,
                    b',' if are_both(u8::is_ascii_digit) => &mut seen.tight,
                    b',' if after.is_some_and(u8::is_ascii_whitespace) => &mut seen.spaced,
                    b' ' | b'\t' if are_both(|byte| !b", \t;".contains(byte)) => &mut seen.other,
                    _ => continue,
                };
                place.get_or_insert(line);
            }
            if seen.leading_zero.is_none() {
                let is_odd = |word: &&str| {
                    word.len() > 1 && word.starts_with('0') && word.bytes().all(|byte| byte.is_ascii_digit())
                };
                let word = text.split(',').map(str::trim).find(is_odd);
                seen.leading_zero = word.map(|word| (line, word.to_owned()));
            }
        }
        seen
    }

    /// Whether commas are decimal marks.
    ///
    /// # Errors
    /// Lines in which they could be either, with a line that shows it.
    fn are_decimal(&self) -> Result<bool, String> {
        let advice = "write decimal points, or separate the numbers by tabs or semicolons";
        match self {
            Self { tight: None, .. } => Ok(false),
            Self { tight: Some(line), point: Some(_), other: Some(_), .. } => {
                Err(format!("line {line} has commas within words, and numbers have decimal points elsewhere: {advice}"))
            }
            Self { point: Some(_), .. } => Ok(false),
            Self { tight: Some(line), spaced: Some(other), .. } => Err(format!(
                "commas stand between digits in line {line} and before blanks in line {other}, so they could be decimal or \
                 separators: {advice}"
            )),
            Self { other: Some(_), .. } => Ok(true),
            Self { leading_zero: Some((line, word)), .. } => Err(format!(
                "\"{word}\" in line {line} stands alone between commas, as the decimals of a number would: {advice}"
            )),
            _ => Ok(false),
        }
    }
}

/// All numbers of `lines`.
///
/// # Errors
/// Commas that could be decimal or separators, and words that are no numbers.
pub(super) fn table(lines: &[Line]) -> Result<Table, String> {
    // Within quotes a comma is decimal, between them a separator.
    let unquoted: Option<Vec<(usize, String)>> = lines
        .iter()
        .any(|(_, text)| text.contains('"'))
        .then(|| lines.iter().map(|&(line, text)| (line, without_quotes(text))).collect());
    if let Some(unquoted) = unquoted {
        let lines: Vec<Line> = unquoted.iter().map(|(line, text)| (*line, text.as_str())).collect();
        return table(&lines);
    }
    let style = Style { decimal_comma: Commas::of(lines).are_decimal()?, tab_cells: false };
    let by_blanks = read(lines, style)?;
    // Empty cells between tabs show as lines of different length.
    if by_blanks.columns().is_err() && lines.iter().all(|(_, text)| text.contains('\t')) {
        let by_tabs = read(lines, Style { tab_cells: true, ..style })?;
        if by_tabs.columns().is_ok() {
            return Ok(by_tabs);
        }
    }
    Ok(by_blanks)
}

fn without_quotes(text: &str) -> String {
    let mut quoted = false;
    let mut result = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => result.push(';'),
            _ => result.push(c),
        }
    }
    result
}

fn read(lines: &[Line], style: Style) -> Result<Table, String> {
    let mut table = Table { values: Vec::new(), rows: Vec::with_capacity(lines.len()) };
    let is_separator = |c: char| c == ';' || (c == ',' && !style.decimal_comma) || (c == '\t' && style.tab_cells);
    for &(line, text) in lines {
        let before = table.values.len();
        let mut cells = text.trim_matches(|c: char| c.is_whitespace() && !(c == '\t' && style.tab_cells));
        // A separator at the end of a line ends its last number.
        cells = cells.strip_suffix(is_separator).unwrap_or(cells);
        for cell in cells.split(is_separator) {
            let mut words = cell.split_whitespace().peekable();
            if words.peek().is_none() {
                table.values.push(f64::NAN);
            }
            for word in words {
                let value = if style.decimal_comma && word.contains(',') {
                    Some(word)
                        .filter(|word| word.matches(',').count() == 1)
                        .and_then(|word| number(&word.replace(',', ".")))
                } else {
                    number(word)
                };
                table.values.push(value.ok_or_else(|| format!("\"{word}\" in line {line} is not a number"))?);
            }
        }
        table.rows.push((line, table.values.len() - before));
    }
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(text: &str) -> Result<(Vec<f64>, usize), String> {
        let lines: Vec<Line> = text.lines().enumerate().map(|(at, text)| (at + 1, text)).collect();
        let table = table(&lines)?;
        Ok((table.values.clone(), table.columns()?))
    }

    #[test]
    fn separators_and_decimal_marks_are_told_by_all_lines() {
        let expected = (vec![0.41, 0.4, -3.0, 1e-7, 2.0, 0.5], 3);
        for text in [
            "0.41 0.40 -3\n1e-7 2 .5",
            "0.41,0.40,-3\n1e-7,2,.5",
            "0.41, 0.40, -3\n1e-7, 2, .5",
            "0.41;0.40;-3\n1e-7;2;.5",
            "  0.41\t0.40\t-3  \n1E-007\t2.\t+.5\t",
            "0,41\t0,40\t-3\n1e-7\t2\t0,5",
            "0,41;0,40;-3\n1E-7;2;0,5",
            "0,41 0,40  \u{2212}3\n1,0D-7 2 ,5",
            "\"0,41\",\"0,40\",\"-3\"\n\"1e-7\",\"2\",\"0,5\"",
            "0.41,0.40,-3,\n1e-7,2,.5,",
        ] {
            assert_eq!(values(text), Ok(expected.clone()), "{text}");
        }
        // Whole numbers between commas only.
        assert_eq!(values("1,20,3\n4,5,6"), Ok((vec![1.0, 20.0, 3.0, 4.0, 5.0, 6.0], 3)));
        // The first line has no decimals: the second tells.
        assert_eq!(values("1\t2\n0,5\t3"), Ok((vec![1.0, 2.0, 0.5, 3.0], 2)));
    }

    #[test]
    fn ambiguous_commas_are_refused_with_their_line() {
        for (text, word) in [
            ("1,234.5\t2,345.6", "line 1"),
            ("1.5,2.5;3.5", "line 1"),
            ("0,41, 0,40", "decimal or separators"),
            ("0,41,0,05", "\"05\" in line 1"),
            ("1,2,3\t4", "\"1,2,3\" in line 1"),
        ] {
            let refusal = values(text).unwrap_err();
            assert!(refusal.contains(word), "{text}: {refusal}");
        }
    }

    #[test]
    fn missing_cells_and_words_are_holes() {
        for text in
            ["1,,3\n4,5,6", "1;;3\n4;5;6", "1\t\t3\n4\t5\t6", "1 nan 3\n4 5 6", "1 BAD 3\n4 5 6", "1 -- 3\n4 5 6"]
        {
            let (found, columns) = values(text).unwrap();
            assert!(columns == 3 && found[1].is_nan() && found[2] == 3.0 && found.len() == 6, "{text}: {found:?}");
        }
        for word in ["1.#QNAN", "-1.#IND", "1.#INF00", "NULL", "N/A"] {
            assert!(number(word).unwrap().is_nan(), "{word}");
        }
        for word in ["", "x", "1x", "0x10", "e5", "d", "#", "1.2.3"] {
            assert!(word.is_empty() || number(word).is_none(), "{word}");
        }
        assert!(values("1 2\n3").unwrap_err().contains("line 2 has 1 numbers, line 1 has 2"));
    }

    #[test]
    fn lines_of_words_are_not_numeric() {
        for line in ["1 2", "0,41\t0,40", "nan", "1;2", "\"0,4\",\"0,5\"", "-1.5E-07"] {
            assert!(is_numeric(line), "{line}");
        }
        for line in ["", "  ", "ncols 48", "X[nm]", "1 x", "# 1", "2.4 µm"] {
            assert!(!is_numeric(line), "{line}");
        }
    }
}
