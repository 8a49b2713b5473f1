//! Inclusion of WGSL sources at compile time. Comments are removed, so that they do not enlarge the compiled program.
//!
//! The macro [`wgsl!`](crate::wgsl) calls [`code_length`], [`code`] and [`utf8`] in constant expressions. The length is
//! a part of the array's type, so one pass counts and another copies. Comments from `//` to the end of the line are
//! removed. WGSL has no strings that could contain `//`. The sources must not have block comments.

/// Includes a WGSL file, by its path relative to the calling file, as a `&'static str` without its comments. Line ends
/// are kept, so that a line in a compiler's message can be found in the file.
#[doc(hidden)]
#[macro_export]
macro_rules! wgsl {
    ($file:literal) => {{
        const SOURCE: &str = include_str!($file);
        const CODE: [u8; $crate::methods::code_length(SOURCE)] = $crate::methods::code(SOURCE);
        const { $crate::methods::utf8(&CODE) }
    }};
}

/// Number of bytes of a source without its comments.
pub const fn code_length(source: &str) -> usize {
    let bytes = source.as_bytes();
    let (mut length, mut at) = (0, 0);
    while at < bytes.len() {
        at = after_comment(bytes, at);
        if at < bytes.len() {
            length += 1;
            at += 1;
        }
    }
    length
}

/// Bytes of a source without its comments; `N` must be [`code_length`] of the source.
pub const fn code<const N: usize>(source: &str) -> [u8; N] {
    let bytes = source.as_bytes();
    let mut code = [0; N];
    let (mut length, mut at) = (0, 0);
    while at < bytes.len() {
        at = after_comment(bytes, at);
        if at < bytes.len() {
            code[length] = bytes[at];
            length += 1;
            at += 1;
        }
    }
    code
}

/// Converts the bytes of [`code`] to text.
///
/// # Panics
/// If the bytes are not UTF-8. In a constant expression this is an error of compilation. Removing whole comments leaves
/// valid UTF-8, since `/` and `\n` never occur inside a multi-byte character.
pub const fn utf8(code: &[u8]) -> &str {
    match std::str::from_utf8(code) {
        Ok(code) => code,
        Err(_) => panic!("the source is not UTF-8"),
    }
}

/// Index of the end of the line or of the source if a comment begins at `at`, otherwise `at`.
const fn after_comment(bytes: &[u8], mut at: usize) -> usize {
    if bytes[at] == b'/' && at + 1 < bytes.len() && bytes[at + 1] == b'/' {
        while at < bytes.len() && bytes[at] != b'\n' {
            at += 1;
        }
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_are_removed_and_line_ends_kept() {
        const SOURCE: &str = "// θ\nlet a = b / c; // half\n\n//";
        const CODE: [u8; code_length(SOURCE)] = code(SOURCE);
        assert_eq!(utf8(&CODE), "\nlet a = b / c; \n\n");
    }
}
