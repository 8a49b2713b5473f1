//! The choice among the channels of a file that holds several.

use super::units::micrometres;

/// Parts of titles, in lower case, of signals that are no relief even where their unit is a length: the deflection of a
/// cantilever, say, which its sensitivity turns into nm.
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
/// Parts of titles, in lower case and without blanks, of reliefs.
const RELIEF: [&str; 8] = ["height", "topo", "zsens", "elevation", "relief", "hauteur", "höhe", "altura"];

/// Values of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Holds {
    Lengths,
    /// Numbers without a unit, which `max_height` can scale.
    Numbers,
    /// Something else, such as volts.
    Other,
}

/// A channel as messages and reports name it.
pub(super) struct Channel {
    /// The number that selects it.
    pub number: usize,
    /// The title that selects it, without regard to case; may be empty.
    pub title: String,
    /// What its values are in, for messages: a unit, or a word for their lack.
    pub unit: String,
    pub holds: Holds,
}

impl Channel {
    /// A channel whose values are in `unit`.
    pub fn new(number: usize, title: String, unit: String) -> Self {
        let holds = match micrometres(&unit) {
            Ok(_) => Holds::Lengths,
            Err(_) if unit.trim().is_empty() => Holds::Numbers,
            Err(_) => Holds::Other,
        };
        Self { number, title, unit, holds }
    }

    /// How reports name the channel: its title, or its number where it has none.
    pub fn name(&self) -> String {
        if self.title.is_empty() { self.number.to_string() } else { self.title.clone() }
    }

    fn listed(&self) -> String {
        let unit = if self.unit.is_empty() { "no unit" } else { &self.unit };
        if self.title.is_empty() {
            format!("{} ({unit})", self.number)
        } else {
            format!("{} \"{}\" ({unit})", self.number, self.title)
        }
    }

    /// Place in the order in which channels are taken by default, the lowest first; `None` for what is no relief.
    fn rank(&self) -> Option<usize> {
        let title = self.title.to_lowercase();
        let has = |parts: &[&str], text: &str| parts.iter().any(|part| text.contains(part));
        let title_is_relief = has(&RELIEF, &title.replace([' ', '_', '-'], "")) || title == "z";
        match self.holds {
            Holds::Other => None,
            _ if has(&NO_RELIEF, &title) => None,
            Holds::Lengths => Some(if title_is_relief { 0 } else { 1 }),
            Holds::Numbers => Some(if title_is_relief { 2 } else { 3 }),
        }
    }
}

/// Most channels that a message lists.
const LISTED_MAX: usize = 16;

fn list(channels: &[Channel]) -> String {
    let mut listed: Vec<String> = channels.iter().take(LISTED_MAX).map(Channel::listed).collect();
    if channels.len() > LISTED_MAX {
        listed.push(format!("and {} more", channels.len() - LISTED_MAX));
    }
    listed.join(", ")
}

/// The place in `channels` of the one that is `wanted`, by number or title, or else of the first relief: one whose
/// title says so before other lengths, and these before numbers without a unit. Error signals are taken only where they
/// are wanted.
///
/// # Errors
/// A list of the channels, where nothing fits or what fits is not a length.
pub(super) fn choose(channels: &[Channel], wanted: Option<&str>) -> Result<usize, String> {
    if channels.is_empty() {
        return Err("it holds no channels of data".to_owned());
    }
    let Some(wanted) = wanted else {
        let ranks = channels.iter().enumerate().filter_map(|(at, channel)| Some((channel.rank()?, at)));
        return ranks.min().map(|(_, at)| at).ok_or_else(|| {
            if channels.iter().any(|channel| channel.holds == Holds::Lengths) {
                format!("no channel is a height by its title, choose one with `channel`; there are {}", list(channels))
            } else {
                format!("no channel is in units of length; there are {}", list(channels))
            }
        });
    };
    let wanted = wanted.trim();
    let number = wanted.parse().ok();
    let by_number = channels.iter().position(|channel| Some(channel.number) == number);
    let by_title = || channels.iter().position(|channel| channel.title.to_lowercase() == wanted.to_lowercase());
    let found = by_number.or_else(by_title);
    match found {
        None => Err(format!("there is no `channel` \"{wanted}\"; there are {}", list(channels))),
        Some(at) if channels[at].holds == Holds::Other => {
            Err(format!("channel {} is not a length; there are {}", channels[at].listed(), list(channels)))
        }
        Some(at) => Ok(at),
    }
}

/// Refuses a choice where a format holds one channel and no more.
pub(super) fn refuse(wanted: Option<&str>) -> Result<(), String> {
    match wanted {
        Some(wanted) => Err(format!("`channel` is \"{wanted}\", but files of this format hold a single channel")),
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
    fn reliefs_go_before_error_signals() {
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
    }
}
