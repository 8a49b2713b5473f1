//! Lines of a header with unknown keys, interpreted by their order and their units.
//!
//! Gwyddion translates its keys into the user's language, but keeps their order. For a matrix it writes the channel,
//! the width (extent along x), the height (extent along y) and the unit of the values. For points it writes the unit
//! of x and y, then the unit of the values.

use super::super::super::units::micrometres;
use super::super::quantity::Quantity;
use super::{Header, HeightUnit, height_unit, mentions_length, not_understood};

/// A pair of an unknown key and its value. A line with several such pairs gives several entries.
pub(super) struct UnknownPair<'a> {
    /// Number of the line in the file.
    pub line: usize,
    /// The whole line.
    pub text: &'a str,
    /// Text after the key, followed by the unit that stood in brackets behind the key, if any.
    pub value: String,
    /// The value as numbers with a unit.
    pub quantity: Option<Quantity>,
    /// Whether the line has been interpreted.
    pub is_used: bool,
}

impl UnknownPair<'_> {
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
    /// A line with a length or a unit that could not be interpreted; a unit of the values that is not a length.
    pub(super) fn interpret_unknown(&mut self, mut pairs: Vec<UnknownPair>) -> Result<(), String> {
        self.interpret_matrix_lines(&mut pairs)?;
        self.interpret_unit_lines(&mut pairs);
        let carries_length = |entry: &UnknownPair| {
            entry.length_um().is_some() || micrometres(&entry.value).is_ok() || mentions_length(&entry.value)
        };
        match pairs.iter().find(|entry| !entry.is_used && carries_length(entry)) {
            Some(entry) => Err(not_understood(entry.line, entry.text)),
            None => Ok(()),
        }
    }

    /// Interprets the lines that Gwyddion writes for a matrix: channel, width, height, and unit of the values.
    ///
    /// The first two consecutive lines with lengths are the width and the height. Without such lines, or with a known
    /// extent along either axis, nothing is interpreted. The lines directly before and after them count if they have
    /// unknown keys, too:
    ///
    /// - The line before is the channel. A channel from an English key is kept.
    /// - The line after is the unit, unless an English key has given one.
    ///
    /// # Errors
    /// A unit of the values that is not a length.
    fn interpret_matrix_lines(&mut self, pairs: &mut [UnknownPair]) -> Result<(), String> {
        // Whether entry `i + 1` exists and is the next line of the file.
        let has_next = |i: usize| pairs.get(i + 1).is_some_and(|next| next.line == pairs[i].line + 1);
        let length_at = |i: usize| pairs.get(i).and_then(UnknownPair::length_um);
        let found = (0..pairs.len()).find(|&i| has_next(i) && length_at(i).is_some() && length_at(i + 1).is_some());
        let Some(width_at) = found.filter(|_| self.extent_um == [None, None]) else { return Ok(()) };
        let height_at = width_at + 1;
        let channel_at = (width_at > 0 && has_next(width_at - 1)).then(|| width_at - 1);
        let unit_at = (has_next(height_at) && self.height_unit == HeightUnit::NotGiven).then_some(height_at + 1);
        self.extent_um = [length_at(width_at), length_at(height_at)];
        if let Some(at) = channel_at {
            self.channel.get_or_insert_with(|| pairs[at].value.clone());
        }
        if let Some(at) = unit_at {
            self.height_unit = height_unit(&pairs[at].value)?;
        }
        for at in [Some(width_at), Some(height_at), channel_at, unit_at].into_iter().flatten() {
            pairs[at].is_used = true;
        }
        Ok(())
    }

    /// Interprets the lines that Gwyddion writes for points: the unit of x and y, then the unit of the values. Does
    /// nothing if one of these units is known, or unless exactly two unused lines have a unit of length as their value.
    fn interpret_unit_lines(&mut self, pairs: &mut [UnknownPair]) {
        if self.lateral_um.is_some() || self.height_unit != HeightUnit::NotGiven {
            return;
        }
        let unused = pairs.iter_mut().filter(|entry| !entry.is_used);
        let mut units: Vec<(&mut UnknownPair, f64)> =
            unused.filter_map(|entry| micrometres(&entry.value).ok().map(|unit_um| (entry, unit_um))).collect();
        if let [(lateral, lateral_um), (values, values_um)] = units.as_mut_slice() {
            self.lateral_um = Some([*lateral_um; 2]);
            self.height_unit = HeightUnit::Length(values.value.trim().to_owned(), *values_um);
            lateral.is_used = true;
            values.is_used = true;
        }
    }
}
