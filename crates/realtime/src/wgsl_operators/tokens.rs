//! The tokens of WGSL, as far as its operators ask for them.

use std::ops::Range;

/// Tokens of punctuation, the longer first.
const PUNCTUATION: [&str; 46] = [
    "<<=", ">>=", "<<", ">>", "<=", ">=", "==", "!=", "&&", "||", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "->",
    "++", "--", "+", "-", "*", "/", "%", "&", "|", "^", "<", ">", "!", "~", "=", "(", ")", "[", "]", "{", "}", ",",
    ";", ":", ".", "@", "_",
];
const BINARY_OR_UNARY: [&str; 20] =
    ["<<", ">>", "<=", ">=", "==", "!=", "&&", "||", "+", "-", "*", "/", "%", "&", "|", "^", "<", ">", "!", "~"];
/// Words that an expression may follow and that are no operand of it.
const STATEMENTS: [&str; 23] = [
    "alias",
    "break",
    "case",
    "const",
    "const_assert",
    "continue",
    "continuing",
    "default",
    "diagnostic",
    "discard",
    "else",
    "enable",
    "fn",
    "for",
    "if",
    "let",
    "loop",
    "override",
    "requires",
    "return",
    "struct",
    "switch",
    "while",
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Operand,
    Operator,
    /// A bracket, or the `<` of a template list.
    Open,
    Close,
    /// Whatever else an expression does not go beyond.
    End,
}

pub(super) struct Token {
    pub(super) kind: Kind,
    pub(super) place: Range<usize>,
}

/// The tokens of a module without comments. What is not WGSL is passed over: naga has been asked already.
pub(super) fn tokens(source: &str) -> Vec<Token> {
    let templates = template_lists(source);
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(first) = source[at..].chars().next() {
        let rest = &source[at..];
        let is_template = |end: fn(&Range<usize>) -> usize| templates.iter().any(|list| end(list) == at);
        let (kind, length) = if first.is_whitespace() {
            (None, first.len_utf8())
        } else if is_template(|list| list.start) {
            (Some(Kind::Open), 1)
        } else if is_template(|list| list.end) {
            (Some(Kind::Close), 1)
        } else if let Some(length) = number(rest) {
            (Some(Kind::Operand), length)
        } else if let Some(length) = word(rest) {
            let kind = if STATEMENTS.contains(&&rest[..length]) { Kind::End } else { Kind::Operand };
            (Some(kind), length)
        } else if let Some(punctuation) = PUNCTUATION.iter().find(|known| rest.starts_with(**known)) {
            let kind = match *punctuation {
                "(" | "[" => Some(Kind::Open),
                ")" | "]" => Some(Kind::Close),
                // What they join or follow is an operand already.
                "." | "++" | "--" => None,
                "_" => Some(Kind::Operand),
                other if BINARY_OR_UNARY.contains(&other) => Some(Kind::Operator),
                _ => Some(Kind::End),
            };
            (kind, punctuation.len())
        } else {
            (None, first.len_utf8())
        };
        found.extend(kind.map(|kind| Token { kind, place: at..at + length }));
        at += length;
    }
    found
}

/// The length of the identifier or keyword that the text begins with.
fn word(text: &str) -> Option<usize> {
    let length = text.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(text.len());
    let first = text.chars().next()?;
    (length > 0 && !first.is_ascii_digit() && text[..length] != *"_").then_some(length)
}

/// The length of the number that the text begins with. Signs belong to exponents only.
fn number(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let digit = |at: usize| bytes.get(at).is_some_and(u8::is_ascii_digit);
    if !(digit(0) || bytes[0] == b'.' && digit(1)) {
        return None;
    }
    let hexadecimal = matches!(bytes, [b'0', b'x' | b'X', ..]);
    let exponent = if hexadecimal { *b"pP" } else { *b"eE" };
    let mut length = if hexadecimal { 2 } else { 0 };
    while let Some(&byte) = bytes.get(length) {
        let sign = matches!(byte, b'+' | b'-') && exponent.contains(&bytes[length - 1]);
        if !(byte.is_ascii_alphanumeric() || byte == b'.' || sign) {
            break;
        }
        length += 1;
    }
    Some(length)
}

/// The same text with blanks for comments, so that lines stay where they are. Block comments nest.
pub(super) fn without_comments(source: &str) -> String {
    let mut kept = String::with_capacity(source.len());
    let mut rest = source;
    while let Some(first) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            block_comment(rest)
        } else {
            0
        };
        let (comment, after) = rest.split_at(length);
        kept.extend(comment.chars().map(|c| if c == '\n' { '\n' } else { ' ' }));
        rest = after;
        if length == 0 {
            kept.push(first);
            rest = &rest[first.len_utf8()..];
        }
    }
    kept
}

/// The length of the block comment that the text begins with.
fn block_comment(text: &str) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < text.len() {
        let rest = &text.as_bytes()[at..];
        let (step, deeper) = match rest {
            [b'/', b'*', ..] => (2, 1),
            [b'*', b'/', ..] => (2, -1),
            _ => (1, 0),
        };
        at += step;
        depth += deeper;
        if depth == 0 {
            break;
        }
    }
    at
}

/// Where the `<` and the `>` of each template list are: the algorithm of WGSL, section 3.9 "Template Lists", which tells
/// them from comparisons and shifts.
fn template_lists(source: &str) -> Vec<Range<usize>> {
    let bytes = source.as_bytes();
    let is = |at: usize, byte: u8| bytes.get(at) == Some(&byte);
    let mut found = Vec::new();
    // Where each is, and how deep in brackets.
    let mut candidates: Vec<(usize, usize)> = Vec::new();
    let mut depth = 0usize;
    let mut at = 0;
    while at < bytes.len() {
        if !source.is_char_boundary(at) {
            at += 1;
            continue;
        }
        if let Some(length) = number(&source[at..]) {
            at += length;
            continue;
        }
        if let Some(length) = word(&source[at..]) {
            at += length;
            at += source[at..].len() - source[at..].trim_start().len();
            if is(at, b'<') {
                // `<<` is a shift, and `<=` a comparison.
                if !is(at + 1, b'<') && !is(at + 1, b'=') {
                    candidates.push((at, depth));
                    at += 1;
                } else {
                    at += 2;
                }
            }
            continue;
        }
        match bytes[at] {
            b'>' => match candidates.last() {
                Some(&(start, same)) if same == depth => {
                    found.push(start..at);
                    candidates.pop();
                }
                _ => at += usize::from(is(at + 1, b'=')),
            },
            b'(' | b'[' => depth += 1,
            b')' | b']' => {
                candidates.retain(|candidate| candidate.1 < depth);
                depth = depth.saturating_sub(1);
            }
            b'!' => at += usize::from(is(at + 1, b'=')),
            b'=' if is(at + 1, b'=') => at += 1,
            b'=' | b';' | b'{' | b':' => {
                depth = 0;
                candidates.clear();
            }
            b'&' | b'|' if is(at + 1, bytes[at]) => {
                candidates.retain(|candidate| candidate.1 < depth);
                at += 1;
            }
            _ => {}
        }
        at += 1;
    }
    found
}
