//! Which operators of WGSL may stand beside which without parentheses. naga takes mixtures that the grammar does not
//! have, and browsers refuse them.
//!
//! The grammar (WGSL, section 8.18 "Expression Grammar Summary") has no single ladder of precedences. Operands of `<<`
//! and `>>` are unary expressions, so that a shift mixes with no arithmetic. Operands of `&`, `|` and `^` are unary
//! expressions too, and a run of one of these has no other operator in it. Comparisons do not chain, and a run of `&&`
//! has no `||` in it. Within one pair of brackets, this is all that there is to know of a list of binary operators.

mod tokens;

use std::fmt;
use tokens::{Kind, tokens, without_comments};

/// Binary operators that stand beside each other in one expression where the grammar asks for parentheses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mixture {
    /// Counted from 1.
    pub line: usize,
    /// All of the expression's operators at that depth of brackets, in order.
    pub operators: Vec<String>,
}

impl fmt::Display for Mixture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {} need parentheses", self.line, self.operators.join(" "))
    }
}

/// Every mixture in a module.
pub fn mixtures(source: &str) -> Vec<Mixture> {
    let source = without_comments(source);
    let mut found = Vec::new();
    let mut outer: Vec<Run> = Vec::new();
    let mut run = Run::default();
    for token in tokens(&source) {
        match token.kind {
            Kind::Operand => run.after_operand = true,
            Kind::Open => outer.push(std::mem::take(&mut run)),
            Kind::Close => {
                run.end(&mut found);
                run = outer.pop().unwrap_or_default();
                run.after_operand = true;
            }
            Kind::End => run.end(&mut found),
            Kind::Operator if run.after_operand => {
                if run.operators.is_empty() {
                    run.line = 1 + source[..token.place.start].matches('\n').count();
                }
                run.operators.push(source[token.place].to_owned());
                run.after_operand = false;
            }
            // A unary one.
            Kind::Operator => {}
        }
    }
    run.end(&mut found);
    found
}

/// The part of an expression that lies directly between two brackets or separators.
#[derive(Default)]
struct Run {
    /// That of the first operator.
    line: usize,
    operators: Vec<String>,
    after_operand: bool,
}

impl Run {
    fn end(&mut self, found: &mut Vec<Mixture>) {
        let Run { line, operators, .. } = std::mem::take(self);
        if !grammatical(&operators) {
            found.push(Mixture { line, operators });
        }
    }
}

/// Whether the grammar has an expression of unary expressions joined by these binary operators.
fn grammatical<S: AsRef<str>>(operators: &[S]) -> bool {
    let count = |known: &[&str]| operators.iter().filter(|operator| known.contains(&operator.as_ref())).count();
    if count(&["&", "|", "^"]) > 0 {
        return operators.iter().all(|operator| operator.as_ref() == operators[0].as_ref());
    }
    if count(&["&&"]) > 0 && count(&["||"]) > 0 {
        return false;
    }
    operators.split(|operator| matches!(operator.as_ref(), "&&" | "||")).all(|comparison| {
        let mut sides = comparison.split(|operator| COMPARISONS.contains(&operator.as_ref()));
        let shifts = |side: &[S]| side.iter().filter(|operator| matches!(operator.as_ref(), "<<" | ">>")).count();
        sides.clone().count() <= 2 && sides.all(|side| shifts(side) == 0 || side.len() == 1)
    })
}

const COMPARISONS: [&str; 6] = ["<", ">", "<=", ">=", "==", "!="];

/// The module is one of tests as a whole; these are its own.
pub mod tests {
    use super::*;
    use std::process::Command;
    use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

    /// What the compiler of a browser says of a module, where the program `tint` is installed.
    pub fn tint(source: &str) -> Option<Result<(), String>> {
        static FILES: AtomicU32 = AtomicU32::new(0);
        // It takes nothing but a file.
        let name = format!("sunbeam-{}-{}.wgsl", std::process::id(), FILES.fetch_add(1, Relaxed));
        let file = std::env::temp_dir().join(name);
        std::fs::write(&file, source).unwrap();
        let output = Command::new("tint").args(["--format", "wgsl"]).arg(&file).output();
        std::fs::remove_file(&file).unwrap();
        let output = output.ok()?;
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        Some(if output.status.success() { Ok(()) } else { Err(said) })
    }

    /// Expressions of u32 `a` to `d`, bool `p` to `r`, vectors `v` and `w` of u32, an array `s` of them.
    const GRAMMATICAL: [&str; 34] = [
        "a",
        "a + b * c - d / a % b",
        "a << 2u",
        "(a << 2u) | b",
        "(a + b) << (c & 1u)",
        "a << s[b + c]",
        "a & b & c",
        "a | b | (c & d)",
        "a ^ b ^ ~c",
        "a & s[b | c]",
        "u32(a < b) + u32(c > d)",
        "u32(a + b < c * d)",
        "u32(a << 1u < b >> 2u)",
        "u32(a < b && c > d)",
        "u32(a <= b && c >= d && p)",
        "u32(a == b || c != d || !p)",
        "u32((p && q) || r)",
        "u32((p & q) == r)",
        "u32(p & !q)",
        "select(a, b, c < d)",
        "min(a & b, c | d)",
        "max(a << b, c >> d)",
        "a - (b & c)",
        "u32(-i32(a) < -2)",
        "bitcast<u32>(1e-3f) & bitcast<u32>(2.5e+1) & 0xe5u",
        "vec2<u32>(a, b).x | vec3<u32>(c).y",
        "(vec2<u32>(a, b) & v).x",
        "array<u32, 4>(a, b, c, d)[1]",
        "array<vec2<u32>, 2>(v, w)[1].x",
        "array<vec2<u32>,2>(v, w)[0].y | b",
        "u32(all(v < w))",
        "a /* << b | */ + c // & d",
        "a /* | /* ^ */ & */ | c",
        "u32(s[a] >= s[b]) | c",
    ];

    /// The same, where the grammar asks for parentheses; naga takes some of them.
    const MIXED: [&str; 25] = [
        "a << 16u | b",
        "a >> b & 1u",
        "a & b | c",
        "a | b ^ c",
        "a + b << c",
        "a << b + c",
        "a << b << c",
        "a * b >> c",
        "a & b + c",
        "a * b | c",
        "a & b << c",
        "u32(a & b == c)",
        "u32(a == b & c)",
        "u32(a < b | c)",
        "u32(a < b < c)",
        "u32(a == b == c)",
        "u32(a < b == p)",
        "u32(p && q || r)",
        "u32(p || q && r)",
        "u32(p & q && r)",
        "u32(p || q | r)",
        "u32(a << b + c < d)",
        "s[a << b | c]",
        "vec2<u32>(a, b & c | d).x",
        "min(a, (b ^ c & d))",
    ];

    fn module(expression: &str) -> String {
        format!(
            "@group(0) @binding(0) var<storage, read_write> s: array<u32>;
@compute @workgroup_size(1) fn main() {{
    let a = s[0]; let b = s[1]; let c = s[2]; let d = s[3];
    let p = a == 1u; let q = b == 1u; let r = c == 1u;
    let v = vec2<u32>(a, b); let w = vec2<u32>(c, d);
    s[4] = {expression}
    ;
}}
"
        )
    }

    #[test]
    fn what_the_grammar_has_is_taken() {
        for expression in GRAMMATICAL {
            assert_eq!(mixtures(&module(expression)), [], "{expression}");
        }
    }

    #[test]
    fn what_asks_for_parentheses_is_found_once() {
        for expression in MIXED {
            let found = mixtures(&module(expression));
            assert!(found.len() == 1 && found[0].line == 6, "{expression}: {found:?}");
        }
    }

    #[test]
    fn statements_part_expressions() {
        let source = "
fn f(a: u32, p: ptr<function, u32>) -> u32 {
    var x = a | 1u;
    x <<= 2u;
    x |= a << 3u;
    *p = x & 7u;
    for (var i = 0u; i < a; i++) { x += i; }
    if a < x { return a << 1u; } else if (a & 1u) == 0u { return a & x; }
    switch a { case 1u, 2u: { return a | x; } default: { return a ^ x; } }
    while a > x { x--; }
    _ = x;
    return select(a, x, a < x) + 1u;
}";
        assert_eq!(mixtures(source), []);
        let both = source.replace("a << 1u", "a << 1u | x").replace("a ^ x", "a ^ x & 1u");
        let lines: Vec<usize> = mixtures(&both).iter().map(|mixture| mixture.line).collect();
        assert_eq!(lines, [8, 9]);
    }

    /// The lists above are true, says a program that this project has no part in.
    #[test]
    fn tint_judges_the_same() {
        for (expressions, right) in [(&GRAMMATICAL[..], true), (&MIXED[..], false)] {
            for expression in expressions {
                match tint(&module(expression)) {
                    Some(verdict) => assert_eq!(verdict.is_ok(), right, "{expression}: {verdict:?}"),
                    None => return sunbeam_testing::skip("tint", "tint is not installed"),
                }
            }
        }
    }
}
