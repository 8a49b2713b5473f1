//! JSON lines in, JSON lines out, in order.

use super::Outcome;
use super::reflector::Reflector;
use serde::Serialize;
use std::io::{self, BufRead, BufReader, Read, Write};

/// Bytes asked of stdin at a time. What one read gives is answered together, so a client that sends a line and waits
/// gets its answer, and a file is worked off in large pieces.
const READ_BYTES: usize = 1 << 20;

/// The answer to a line that could not be answered.
#[derive(Serialize)]
struct Refusal {
    error: String,
}

/// Answers every line of stdin on stdout; a line that `answer` refuses gets `{"error": …}` in its place.
pub fn serve<A: Serialize>(
    reflector: &Reflector,
    answer: impl Fn(&[u8]) -> Result<A, String> + Sync + Send,
) -> Outcome {
    let mut input = BufReader::with_capacity(READ_BYTES, io::stdin().lock());
    let mut output = io::stdout().lock();
    loop {
        let lines = next_lines(&mut input)?;
        if lines.is_empty() {
            return Ok(());
        }
        let answers = reflector.map(&lines, |line| match answer(line) {
            Ok(answer) => json(&answer),
            Err(error) => json(&Refusal { error }),
        });
        let mut text = answers.join("\n");
        text.push('\n');
        output.write_all(text.as_bytes())?;
        output.flush()?;
    }
}

/// The lines that are there already, at least one; none at the end.
fn next_lines<R: Read>(input: &mut BufReader<R>) -> io::Result<Vec<Vec<u8>>> {
    let mut lines = Vec::new();
    loop {
        let mut line = Vec::new();
        if input.read_until(b'\n', &mut line)? == 0 {
            return Ok(lines);
        }
        lines.push(line);
        if !input.buffer().contains(&b'\n') {
            return Ok(lines);
        }
    }
}

fn json(answer: &impl Serialize) -> String {
    // The answers are plain structs of numbers and strings, which always serialise.
    serde_json::to_string(answer).unwrap_or_else(|error| format!("{{\"error\":{:?}}}", error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The batches of lines that `next_lines` gives for `text`, read four bytes at a time.
    fn batches(text: &str) -> Vec<Vec<String>> {
        let mut input = BufReader::with_capacity(4, text.as_bytes());
        let batches = std::iter::from_fn(|| Some(next_lines(&mut input).unwrap()).filter(|lines| !lines.is_empty()));
        batches.map(|lines| lines.into_iter().map(|line| String::from_utf8(line).unwrap()).collect()).collect()
    }

    #[test]
    fn lines_of_one_read_are_answered_together() {
        assert_eq!(batches("a\nb\ncc\n\nd"), [vec!["a\n", "b\n"], vec!["cc\n", "\n"], vec!["d"]]);
    }

    #[test]
    fn lines_across_reads_stay_whole() {
        // Reads give "a\nbc", "def\n", "g\nhi" and "\n".
        assert_eq!(batches("a\nbcdef\ng\nhi\n"), [vec!["a\n"], vec!["bcdef\n"], vec!["g\n"], vec!["hi\n"]]);
    }
}
