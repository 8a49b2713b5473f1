//! The parameter `channel`: a title, or a number written as such.

use serde::{Deserialize, Deserializer};

/// A channel in JSON.
#[derive(Deserialize)]
#[serde(untagged, expecting = "a channel's title or its number, which is whole and not negative")]
enum Channel {
    Number(u64),
    Title(String),
}

/// Reads a number or a title as text.
pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<String>, D::Error> {
    Ok(Option::<Channel>::deserialize(deserializer)?.map(|channel| match channel {
        Channel::Number(number) => number.to_string(),
        Channel::Title(title) => title,
    }))
}
