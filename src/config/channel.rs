//! The parameter `channel`, which chooses one of several height fields in a file: a title, or a number from 0 on.

use serde::{Deserialize, Deserializer};

/// A channel in JSON.
#[derive(Deserialize)]
#[serde(untagged, expecting = "a channel's title or its number, which is whole and not negative")]
enum Channel {
    Number(u64),
    Title(String),
}

/// Deserialises a JSON number or string; numbers become their decimal digits.
pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<String>, D::Error> {
    Ok(Option::<Channel>::deserialize(deserializer)?.map(|channel| match channel {
        Channel::Number(number) => number.to_string(),
        Channel::Title(title) => title,
    }))
}
