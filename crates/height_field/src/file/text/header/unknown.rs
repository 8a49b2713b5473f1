//! Lines of a header with unknown keys, interpreted by their order and their units: Gwyddion writes channel, width (the
//! extent along x), height (along y) and unit of the values in this order, with keys in the user's language.

use super::super::super::units::micrometres;
use super::super::quantity::Quantity;
use super::{Header, HeightUnit, height_unit, mentions_length, not_understood};

/// A line with an unknown key. A line with several pairs of key and value gives one of these for each.
pub(super) struct UnknownLine<'a> {
    /// Number of the line in the file.
    pub line: usize,
    /// The whole line.
    pub text: &'a str,
    /// Text after the key, with the unit that stood in brackets behind the key.
    pub value: String,
    /// The value as numbers with a unit.
    pub quantity: Option<Quantity>,
    /// Whether the line has been interpreted.
    pub is_used: bool,
}

impl UnknownLine<'_> {
    /// The value in µm, if it is a single length.
    fn length_um(&self) -> Option<f64> {
        match self.quantity.as_ref()?.lengths_um()?.as_slice() {
            [length] => Some(*length),
            _ => None,
        }
    }
}

impl Header {
    /// Interprets lines with keys in another language by their order and units.
    ///
    /// # Errors
    /// A line with a length or a unit that is left over, and a unit of the values that is not a length.
    pub(super) fn take_unknown(&mut self, mut lines: Vec<UnknownLine>) -> Result<(), String> {
        self.take_matrix_lines(&mut lines)?;
        self.take_unit_lines(&mut lines);
        let carries_length = |entry: &UnknownLine| {
            entry.length_um().is_some() || micrometres(&entry.value).is_ok() || mentions_length(&entry.value)
        };
        match lines.iter().find(|entry| !entry.is_used && carries_length(entry)) {
            Some(entry) => Err(not_understood(entry.line, entry.text)),
            None => Ok(()),
        }
    }

    /// Interprets the lines that Gwyddion writes for a matrix: channel, width, height, and unit of the values.
    ///
    /// The first two consecutive lines with lengths are the width and the height. The channel is the line before them,
    /// the unit the line after them, if these are consecutive, too. A channel known from an English key is kept. Where
    /// the unit is known, the line after them is left over. Without two such lines, or with a known extent along either
    /// axis, nothing is interpreted.
    ///
    /// # Errors
    /// A unit of the values that is not a length.
    fn take_matrix_lines(&mut self, lines: &mut [UnknownLine]) -> Result<(), String> {
        // Whether entry `i + 1` exists and is the next line of the file.
        let has_next = |i: usize| lines.get(i + 1).is_some_and(|next| next.line == lines[i].line + 1);
        let length_at = |i: usize| lines.get(i).and_then(UnknownLine::length_um);
        let found = (0..lines.len()).find(|&i| has_next(i) && length_at(i).is_some() && length_at(i + 1).is_some());
        let Some(width_at) = found.filter(|_| self.extent_um == [None, None]) else { return Ok(()) };
        let height_at = width_at + 1;
        let channel_at = (width_at > 0 && has_next(width_at - 1)).then(|| width_at - 1);
        let unit_at = (has_next(height_at) && self.height_unit == HeightUnit::NotGiven).then_some(height_at + 1);
        self.extent_um = [length_at(width_at), length_at(height_at)];
        if let Some(at) = channel_at {
            self.channel.get_or_insert_with(|| lines[at].value.clone());
        }
        if let Some(at) = unit_at {
            self.height_unit = height_unit(&lines[at].value)?;
        }
        for at in [Some(width_at), Some(height_at), channel_at, unit_at].into_iter().flatten() {
            lines[at].is_used = true;
        }
        Ok(())
    }

    /// Interprets the lines that Gwyddion writes for points: the unit of x and y, then that of the values. Does nothing
    /// if either unit is known, or unless exactly two lines are left whose value is a unit of length.
    fn take_unit_lines(&mut self, lines: &mut [UnknownLine]) {
        if self.lateral_um.is_some() || self.height_unit != HeightUnit::NotGiven {
            return;
        }
        let unused = lines.iter_mut().filter(|entry| !entry.is_used);
        let mut units: Vec<(&mut UnknownLine, f64)> =
            unused.filter_map(|entry| micrometres(&entry.value).ok().map(|unit_um| (entry, unit_um))).collect();
        if let [(lateral, lateral_um), (values, values_um)] = units.as_mut_slice() {
            self.lateral_um = Some([*lateral_um; 2]);
            self.height_unit = HeightUnit::Length(values.value.trim().to_owned(), *values_um);
            lateral.is_used = true;
            values.is_used = true;
        }
    }
}
