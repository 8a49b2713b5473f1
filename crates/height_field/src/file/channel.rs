//! Choice of a channel from a file with several.
//!
//! A *channel* is one map of values over the scan: heights, or a signal of the instrument such as phase or friction.
//! The option `channel` selects one by number or title. Without the option, the default is the channel that is most
//! likely a relief by its title and unit ([`Channel::rank`]).

use super::units::micrometres;

/// Parts of titles, in lower case, of signals that are not a relief. Their unit may be a length: the deflection of a
/// cantilever is in nm. They take precedence over [`RELIEF`]: "height error" is no relief.
const NO_RELIEF: [&str; 18] = [
    "error",
    "deflection",
    "amplitude",
    "phase",
    "friction",
    "lateral",
    "adhesion",
    "modulus",
    "dissipation",
    "deformation",
    "indentation",
    "potential",
    "current",
    "setpoint",
    "drive",
    "frequency",
    "stiffness",
    "bias",
];
/// Parts of titles of reliefs, in lower case, without blanks, `_` and `-`. `zsens` stands for the sensor of the z axis;
/// `hauteur`, `höhe` and `altura` mean height.
const RELIEF: [&str; 8] = ["height", "topo", "zsens", "elevation", "relief", "hauteur", "höhe", "altura"];

/// Kind of a channel's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ValueKind {
    /// Lengths in a known unit.
    Lengths,
    /// Numbers without a unit, which the option `max_height` scales.
    Numbers,
    /// Other quantities, such as volts.
    Other,
}

/// A channel of a file, as options select it and messages name it.
pub(super) struct Channel {
    /// Number that selects the channel. Each format counts from 0 or 1, or uses the file's own numbers.
    pub number: usize,
    /// Title that selects the channel, without regard to case; may be empty.
    pub title: String,
    /// Unit of the values, or another remark on them, for messages only.
    pub unit: String,
    /// Kind of the values; [`ValueKind::Other`] cannot be chosen.
    pub kind: ValueKind,
}

impl Channel {
    /// A channel whose kind follows from its unit.
    pub(super) fn new(number: usize, title: String, unit: String) -> Self {
        let kind = match micrometres(&unit) {
            Ok(_) => ValueKind::Lengths,
            Err(_) if unit.trim().is_empty() => ValueKind::Numbers,
            Err(_) => ValueKind::Other,
        };
        Self { number, title, unit: unit.trim().to_owned(), kind }
    }

    /// Name in reports: the title, or the number of a channel without one.
    pub(super) fn name(&self) -> String {
        if self.title.is_empty() { self.number.to_string() } else { self.title.clone() }
    }

    /// Entry in a list in a message.
    fn listed(&self) -> String {
        let unit = if self.unit.is_empty() { "no unit" } else { &self.unit };
        if self.title.is_empty() {
            format!("{} ({unit})", self.number)
        } else {
            format!("{} \"{}\" ({unit})", self.number, self.title)
        }
    }

    /// Priority as the default channel, from 0 (highest) to 3; `None` for a channel that is not a relief.
    fn rank(&self) -> Option<usize> {
        let title = self.title.to_lowercase();
        let has = |parts: &[&str], text: &str| parts.iter().any(|part| text.contains(part));
        // "z" must be the whole title: as a part of titles it is too common.
        let title_is_relief = has(&RELIEF, &title.replace([' ', '_', '-'], "")) || title == "z";
        match self.kind {
            ValueKind::Other => None,
            _ if has(&NO_RELIEF, &title) => None,
            ValueKind::Lengths => Some(if title_is_relief { 0 } else { 1 }),
            ValueKind::Numbers => Some(if title_is_relief { 2 } else { 3 }),
        }
    }
}

/// Largest number of channels that a message lists, so that it stays readable.
const LISTED_MAX: usize = 16;

/// The channels as a list for messages, at most [`LISTED_MAX`] of them.
fn list(channels: &[Channel]) -> String {
    let mut listed: Vec<String> = channels.iter().take(LISTED_MAX).map(Channel::listed).collect();
    if channels.len() > LISTED_MAX {
        listed.push(format!("and {} more", channels.len() - LISTED_MAX));
    }
    listed.join(", ")
}

/// Index in `channels` of the channel whose number or title is `channel_option`, or of the default channel without the
/// option. A number takes precedence over an equal title. A blank option names no channel.
///
/// The default is the first channel in a unit of length whose title names a relief, else the first other one in a unit
/// of length. Without such channels it is the first channel without a unit whose title names a relief, else the first
/// other one without a unit. Signals of [`NO_RELIEF`] are chosen only by the option.
///
/// # Errors
/// With the option: no channel has the number or title, or its unit is not a length. Without the option: no channel may
/// be a relief. The message lists the channels.
pub(super) fn choose(channels: &[Channel], channel_option: Option<&str>) -> Result<usize, String> {
    if channels.is_empty() {
        return Err("it holds no channels of data".to_owned());
    }
    let Some(wanted) = channel_option else {
        let ranks = channels.iter().enumerate().filter_map(|(at, channel)| Some((channel.rank()?, at)));
        return ranks.min().map(|(_, at)| at).ok_or_else(|| {
            if channels.iter().any(|channel| channel.kind == ValueKind::Lengths) {
                format!("no channel is a height by its title, choose one with `channel`; there are {}", list(channels))
            } else {
                format!("no channel is in units of length; there are {}", list(channels))
            }
        });
    };
    let wanted = wanted.trim();
    let number = wanted.parse::<usize>().ok();
    let by_number = channels.iter().position(|channel| Some(channel.number) == number);
    let has_title = |channel: &Channel| !wanted.is_empty() && channel.title.to_lowercase() == wanted.to_lowercase();
    let by_title = || channels.iter().position(has_title);
    let found = by_number.or_else(by_title);
    match found {
        None => Err(format!("there is no `channel` \"{wanted}\"; there are {}", list(channels))),
        Some(at) if channels[at].kind == ValueKind::Other => {
            Err(format!("channel {} is not a length; there are {}", channels[at].listed(), list(channels)))
        }
        Some(at) => Ok(at),
    }
}

/// Refuses the option `channel` for formats with a single channel.
pub(super) fn refuse(channel_option: Option<&str>) -> Result<(), String> {
    match channel_option {
        Some(given) => Err(format!("`channel` is \"{given}\", but files of this format hold a single channel")),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(channels: &[(&str, &str)], wanted: Option<&str>) -> Result<usize, String> {
        let channels: Vec<Channel> = channels
            .iter()
            .enumerate()
            .map(|(number, (title, unit))| Channel::new(number, (*title).to_owned(), (*unit).to_owned()))
            .collect();
        choose(&channels, wanted)
    }

    #[test]
    fn default_channel_is_a_relief_and_no_error_signal() {
        assert_eq!(chosen(&[("Deflection Error", "nm"), ("Height", "nm")], None), Ok(1));
        assert_eq!(chosen(&[("Amplitude", "nm"), ("Map", "nm"), ("Z Sensor", "nm")], None), Ok(2));
        assert_eq!(chosen(&[("Map", "nm"), ("ZSensor", "V")], None), Ok(0));
        assert_eq!(chosen(&[("Topography", ""), ("Other", "m")], None), Ok(1));
        assert_eq!(chosen(&[("", "")], None), Ok(0));
        assert_eq!(chosen(&[("Deflection", "nm"), ("Height", "nm")], Some("deflection")), Ok(0));
        let refusal = chosen(&[("Deflection", "nm"), ("Phase", "deg")], None).unwrap_err();
        assert!(refusal.contains("`channel`") && refusal.contains("0 \"Deflection\" (nm)"), "{refusal}");
        assert!(chosen(&[("Phase", "deg")], None).unwrap_err().contains("no channel is in units of length"));
        assert!(chosen(&[("Phase", "deg")], Some("0")).unwrap_err().contains("is not a length"));
        assert!(chosen(&[("", "nm")], Some(" ")).unwrap_err().contains("there is no `channel`"));
    }
}
