//! The choice among the channels of a file that holds several.

/// A channel as messages and reports name it.
pub(super) struct Channel {
    /// The number that selects it.
    pub number: usize,
    /// The title that selects it, without regard to case; may be empty.
    pub title: String,
    /// What its values are in, for messages: a unit, or a word for their lack.
    pub unit: String,
    /// Whether its values are lengths, so that it can be a height field.
    pub is_height: bool,
}

impl Channel {
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

/// The place in `channels` of the one that is `wanted`, by number or title, or else of the first in units of length.
///
/// # Errors
/// A list of what there is, where nothing fits or what fits is not a length.
pub(super) fn choose(channels: &[Channel], wanted: Option<&str>) -> Result<usize, String> {
    if channels.is_empty() {
        return Err("it holds no channels of data".to_owned());
    }
    let Some(wanted) = wanted else {
        let first = channels.iter().position(|channel| channel.is_height);
        return first.ok_or_else(|| format!("no channel is in units of length; there are {}", list(channels)));
    };
    let wanted = wanted.trim();
    let number = wanted.parse().ok();
    let by_number = channels.iter().position(|channel| Some(channel.number) == number);
    let by_title = || channels.iter().position(|channel| channel.title.to_lowercase() == wanted.to_lowercase());
    let found = by_number.or_else(by_title);
    match found {
        None => Err(format!("there is no `channel` \"{wanted}\"; there are {}", list(channels))),
        Some(at) if !channels[at].is_height => {
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
