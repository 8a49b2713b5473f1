//! JSON form of the parameter `channel`, which chooses one of several height fields in a file by its title or by the
//! number that it has in the file.

use serde::{Deserialize, Deserializer};

/// A channel in JSON. `expecting` is the error message for any other value.
#[derive(Deserialize)]
#[serde(untagged, expecting = "a channel's title or its number, which is whole and not negative")]
enum Channel {
    Number(u64),
    Title(String),
}

/// Deserialises a number, a string or null. A number becomes its decimal digits, the form in which command lines and
/// scene files give it. Readers of files take digits as a number first, then as a title.
pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<String>, D::Error> {
    Ok(Option::<Channel>::deserialize(deserializer)?.map(|channel| match channel {
        Channel::Number(number) => number.to_string(),
        Channel::Title(title) => title,
    }))
}
