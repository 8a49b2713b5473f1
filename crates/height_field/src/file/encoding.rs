//! Text encodings: UTF-8, UTF-16, and Latin-1 for all others.

/// Number of bytes at the start of a file that are tested for UTF-16 without a byte order mark. In most files the first
/// words are ASCII. A longer test may meet other characters; a shorter one has less evidence.
const PROBE_BYTES: usize = 64;

/// Text of a whole file, without its byte order mark.
///
/// UTF-16 is recognised by its byte order mark, or by NUL at the same place of most pairs of the first bytes
/// ([`has_nul_at`]). Text that is neither UTF-16 nor valid UTF-8 is taken for Latin-1, in which every byte is a
/// character.
///
/// # Errors
/// NUL characters in the text: the file is binary.
pub(super) fn text(bytes: &[u8]) -> Result<String, String> {
    let decoded = match bytes {
        // The byte order marks of UTF-16, little- and big-endian, and of UTF-8.
        [0xff, 0xfe, rest @ ..] => utf16(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => utf16(rest, u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, rest @ ..] => utf8_or_latin1(rest),
        // No mark: the upper byte of an ASCII character in UTF-16 is NUL. In little-endian order it is the second byte.
        _ if has_nul_at(bytes, 1) => utf16(bytes, u16::from_le_bytes),
        _ if has_nul_at(bytes, 0) => utf16(bytes, u16::from_be_bytes),
        _ => utf8_or_latin1(bytes),
    };
    if decoded.contains('\0') { Err("it is binary, not text".to_owned()) } else { Ok(decoded) }
}

/// Text in UTF-8, or in Latin-1 if the bytes are not valid UTF-8.
pub(super) fn utf8_or_latin1(bytes: &[u8]) -> String {
    std::str::from_utf8(bytes).map_or_else(|_| bytes.iter().copied().map(char::from).collect(), str::to_owned)
}

/// Text of UTF-16 bytes. `unit` converts two bytes to a code unit in the file's byte order. Invalid units become
/// replacement characters. A single byte left at the end is ignored.
fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> String {
    let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
}

/// Whether most pairs of the first [`PROBE_BYTES`] have a NUL at `index` (0 or 1), and none has one at the other index.
/// False for fewer than two pairs, which tell too little.
fn has_nul_at(bytes: &[u8], index: usize) -> bool {
    let pairs = || bytes[..bytes.len().min(PROBE_BYTES)].chunks_exact(2);
    let with_nul = pairs().filter(|pair| pair[index] == 0).count();
    bytes.len() >= 4 && 2 * with_nul > pairs().len() && pairs().all(|pair| pair[1 - index] != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_encoding_gives_the_same_text() {
        let expected = "# Width: 2 µm\n1 2\n";
        let latin: Vec<u8> = expected.chars().map(|c| c as u8).collect();
        let units: Vec<u16> = expected.encode_utf16().collect();
        let little: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
        let big: Vec<u8> = units.iter().flat_map(|unit| unit.to_be_bytes()).collect();
        let encodings = [
            expected.as_bytes().to_vec(),
            [b"\xef\xbb\xbf", expected.as_bytes()].concat(),
            latin,
            [b"\xff\xfe", &little[..]].concat(),
            [b"\xfe\xff", &big[..]].concat(),
            little,
            big,
        ];
        for bytes in encodings {
            assert_eq!(text(&bytes).unwrap(), expected, "{bytes:?}");
        }
        assert!(text(b"GWYP\0\0\0\0").unwrap_err().contains("binary"));
    }
}
