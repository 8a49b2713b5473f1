//! Inclusion of WGSL sources at compile time with their comments removed, so that programs do not embed the comments.
//!
//! The macro [`wgsl!`](crate::wgsl) calls [`code_length`], [`code`] and [`utf8`] in constant expressions. A line
//! comment from `//` to the end of the line is removed; WGSL sources here have no block comments.

/// Includes a WGSL file, relative to the calling file, as a `&'static str` without its comments. Lines keep their
/// numbers.
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

/// The `N` = [`code_length`] bytes of a source without its comments.
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

/// The bytes of a source as text.
///
/// # Panics
/// If the bytes are not UTF-8, which fails the compilation. It does not happen, because a comment is removed as a
/// whole.
pub const fn utf8(code: &[u8]) -> &str {
    match std::str::from_utf8(code) {
        Ok(code) => code,
        Err(_) => panic!("the source is not UTF-8"),
    }
}

/// The index of the end of the line where a comment begins at `at`, else `at`.
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
    fn comments_go_and_lines_stay() {
        const SOURCE: &str = "// θ\nlet a = b / c; // half\n\n//";
        const CODE: [u8; code_length(SOURCE)] = code(SOURCE);
        assert_eq!(utf8(&CODE), "\nlet a = b / c; \n\n");
    }
}
