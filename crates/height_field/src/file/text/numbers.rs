//! Numbers of a text, with any separator and decimal mark.
//!
//! A comma may be a decimal mark (`0,41`) or a separator (`1,2,3`). All lines are searched for evidence ([`Commas`]);
//! ambiguous texts are refused. A *cell* is the text between commas, semicolons or tabs. It holds one number, or
//! several with blanks between them. Empty cells are missing points (NaN).

/// Words for a missing point, in lower case. [`number`] also accepts `1.#QNAN` and the like of Windows' C library.
const MISSING: [&str; 9] = ["nan", "bad", "na", "n/a", "null", "none", "void", "nodata", "masked"];

/// Separators and decimal mark of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Style {
    /// Whether the comma is the decimal mark rather than a separator.
    pub decimal_comma: bool,
    /// Whether each tab ends a cell, which may be empty. Otherwise any sequence of blanks is one separator.
    pub tab_cells: bool,
}

/// Number of a line in the file, from 1, and its text.
pub(super) type Line<'a> = (usize, &'a str);

/// All numbers of a text, line by line.
pub(super) struct Table {
    /// All numbers in the order of the text; NaN at missing points.
    pub values: Vec<f64>,
    /// For each line: its number in the file, and its count of numbers.
    pub rows: Vec<(usize, usize)>,
}

impl Table {
    /// Count of numbers in each line.
    ///
    /// # Errors
    /// No lines, or lines with different counts.
    pub(super) fn columns(&self) -> Result<usize, String> {
        let (first, columns) = *self.rows.first().ok_or("it holds no numbers")?;
        match self.rows.iter().find(|(_, count)| *count != columns) {
            Some((line, count)) => Err(format!("line {line} has {count} numbers, line {first} has {columns}")),
            None => Ok(columns),
        }
    }
}

/// Whether a line consists of numbers, whatever the separators and the decimal mark.
pub(super) fn is_numeric(line: &str) -> bool {
    let words = || words_of(line).flat_map(|word| word.split(',')).filter(|word| !word.is_empty());
    words().next().is_some() && words().all(|word| number(word).is_some())
}

/// Words between blanks, semicolons and quotes.
fn words_of(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| c.is_whitespace() || c == ';' || c == '"').filter(|word| !word.is_empty())
}

/// A number with a decimal point; NaN for words for missing points and for an empty text; `None` for other words.
///
/// Accepts exponents of Fortran (`1.5D-07`), the typographic minus, and `inf`, which `holes.rs` makes a missing
/// point.
pub(super) fn number(word: &str) -> Option<f64> {
    if let Ok(value) = word.parse() {
        return Some(value);
    }
    let lower = word.to_lowercase().replace('\u{2212}', "-");
    let is_of_windows = [".#qnan", ".#ind", ".#inf", ".#snan"].iter().any(|mark| lower.contains(mark));
    // Hyphens alone stand for a missing point, too. The empty text also passes this test.
    if is_of_windows || MISSING.contains(&lower.as_str()) || lower.chars().all(|c| c == '-') {
        return Some(f64::NAN);
    }
    lower.replace('d', "e").parse().ok()
}

/// Evidence for the meaning of commas. Each field is the number of the first line that shows it; `None` without
/// one.
#[derive(Default)]
struct Commas {
    /// A comma between two digits.
    tight: Option<usize>,
    /// A comma before a blank.
    spaced: Option<usize>,
    /// A decimal point.
    point: Option<usize>,
    /// Another separator: a semicolon, a blank that is not next to a comma, or quotes around the comma.
    other: Option<usize>,
    /// An integer with a leading zero between commas, such as the `05` of `0,05`, with its line. It probably is the
    /// decimals of a number.
    leading_zero: Option<(usize, String)>,
}

impl Commas {
    /// Collects the evidence in `lines`.
    fn of(lines: &[Line]) -> Self {
        let mut found = Self::default();
        for &(line, text) in lines {
            let bytes = text.trim().as_bytes();
            for (at, byte) in bytes.iter().enumerate() {
                let before = at.checked_sub(1).and_then(|at| bytes.get(at));
                let after = bytes.get(at + 1);
                let are_both = |is: fn(&u8) -> bool| before.is_some_and(is) && after.is_some_and(is);
                let evidence = match byte {
                    b'.' => &mut found.point,
                    b';' => &mut found.other,
                    b',' if are_both(u8::is_ascii_digit) => &mut found.tight,
                    b',' if after.is_some_and(u8::is_ascii_whitespace) => &mut found.spaced,
                    b' ' | b'\t' if are_both(|byte| !b", \t;".contains(byte)) => &mut found.other,
                    _ => continue,
                };
                evidence.get_or_insert(line);
            }
            if found.leading_zero.is_none() {
                let has_leading_zero = |word: &&str| {
                    word.len() > 1 && word.starts_with('0') && word.bytes().all(|byte| byte.is_ascii_digit())
                };
                let word = text.split(',').map(str::trim).find(has_leading_zero);
                found.leading_zero = word.map(|word| (line, word.to_owned()));
            }
        }
        found
    }

    /// Whether commas are decimal marks. The first case that applies decides.
    ///
    /// # Errors
    /// Ambiguous commas, with a line that shows them.
    fn are_decimal(&self) -> Result<bool, String> {
        let advice = "write decimal points, or separate the numbers by tabs or semicolons";
        match self {
            // Without a comma between digits, commas separate the numbers.
            Self { tight: None, .. } => Ok(false),
            // The comma may also separate thousands, as in `1,234.5 2,345.6`.
            Self { tight: Some(line), point: Some(_), other: Some(_), .. } => {
                Err(format!("line {line} has commas within words, and numbers have decimal points elsewhere: {advice}"))
            }
            // Decimal marks are points, so commas separate the numbers.
            Self { point: Some(_), .. } => Ok(false),
            Self { tight: Some(line), spaced: Some(spaced_line), .. } => Err(format!(
                "commas stand between digits in line {line} and before blanks in line {spaced_line}, so they could be \
                 decimal or separators: {advice}"
            )),
            // Another character separates the numbers, or quotes do, so the commas between digits are decimal marks.
            Self { other: Some(_), .. } => Ok(true),
            // Without another separator, commas separate the numbers, unless the text is one column of decimal numbers.
            // An integer with a leading zero suggests such a column.
            Self { leading_zero: Some((line, word)), .. } => Err(format!(
                "\"{word}\" in line {line} stands alone between commas, as the decimals of a number would: {advice}"
            )),
            _ => Ok(false),
        }
    }
}

/// All numbers of `lines`. A blank line has one missing point.
///
/// # Errors
/// Ambiguous commas, and words that are no numbers.
pub(super) fn table(lines: &[Line]) -> Result<Table, String> {
    if !lines.iter().any(|(_, text)| text.contains('"')) {
        return unquoted_table(lines, Commas::of(lines));
    }
    let unquoted: Vec<(usize, String)> = lines.iter().map(|&(line, text)| (line, without_quotes(text))).collect();
    let lines: Vec<Line> = unquoted.iter().map(|(line, text)| (*line, text.as_str())).collect();
    let mut commas = Commas::of(&lines);
    // The remaining commas were inside quotes, so they separate no cells, even in a single column.
    commas.other = commas.other.or(commas.tight);
    unquoted_table(&lines, commas)
}

/// All numbers of lines without quotes. `commas` is the evidence for the meaning of their commas.
fn unquoted_table(lines: &[Line], commas: Commas) -> Result<Table, String> {
    let style = Style { decimal_comma: commas.are_decimal()?, tab_cells: false };
    let by_blanks = read(lines, style)?;
    // Different counts may be due to empty cells between tabs.
    if by_blanks.columns().is_err() && lines.iter().all(|(_, text)| text.contains('\t')) {
        let by_tabs = read(lines, Style { tab_cells: true, ..style })?;
        if by_tabs.columns().is_ok() {
            return Ok(by_tabs);
        }
    }
    Ok(by_blanks)
}

/// The line without quotes. Commas outside quotes separate cells and become semicolons. Commas inside quotes stay; the
/// semicolons then count as evidence that they are decimal marks ([`Commas::other`]).
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

/// All numbers in the given style.
fn read(lines: &[Line], style: Style) -> Result<Table, String> {
    let mut table = Table { values: Vec::new(), rows: Vec::with_capacity(lines.len()) };
    let is_separator = |c: char| c == ';' || (c == ',' && !style.decimal_comma) || (c == '\t' && style.tab_cells);
    for &(line, text) in lines {
        let before = table.values.len();
        // Tabs at the ends are blanks, unless they end cells.
        let mut cells = text.trim_matches(|c: char| c.is_whitespace() && !(c == '\t' && style.tab_cells));
        // A separator at the end of a line does not begin another cell.
        cells = cells.strip_suffix(is_separator).unwrap_or(cells);
        for cell in cells.split(is_separator) {
            let mut words = cell.split_whitespace().peekable();
            if words.peek().is_none() {
                table.values.push(f64::NAN);
            }
            for word in words {
                let value = match word.matches(',').count() {
                    0 => number(word),
                    _ if !style.decimal_comma => number(word),
                    1 => number(&word.replace(',', ".")),
                    // A number has one decimal mark.
                    _ => None,
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
        let found = table(&lines)?;
        Ok((found.values.clone(), found.columns()?))
    }

    #[test]
    fn separators_and_decimal_marks_are_recognised() {
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
        // A single column.
        assert_eq!(values("\"0,41\"\n\"0,40\"\n\"12\""), Ok((vec![0.41, 0.4, 12.0], 1)));
        // Integers between commas.
        assert_eq!(values("1,20,3\n4,5,6"), Ok((vec![1.0, 20.0, 3.0, 4.0, 5.0, 6.0], 3)));
        // Only the second line has a decimal comma.
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
            ("\"1,234.5\"\n\"2,345.6\"", "line 1"),
            ("\"1,2,3\"\n\"4,5,6\"", "\"1,2,3\" in line 1"),
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
        for word in ["x", "1x", "0x10", "e5", "d", "#", "1.2.3"] {
            assert!(number(word).is_none(), "{word}");
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
