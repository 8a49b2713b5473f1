//! A service on stdin and stdout: one answer for each line, in order.

use super::Outcome;
use super::reflector::Reflector;
use serde::Serialize;
use std::io::{self, BufRead, BufReader, Read, Write};

/// Size in bytes of the buffer for stdin.
///
/// The complete lines in the buffer are answered together. A client that sends one line and waits gets its answer at
/// once, and a file is answered in large batches. Larger buffers keep all cores busier, and need more memory.
const BUFFER_BYTES: usize = 1 << 20;

/// The answer to a line that could not be answered.
#[derive(Serialize)]
struct Refusal {
    error: String,
}

/// Answers every line of stdin on stdout, in order. A line that `answer` refuses gets `{"error": …}` in its place.
/// `reflector` says whether lines may be answered concurrently.
pub(crate) fn serve<A: Serialize>(
    reflector: &Reflector,
    answer: impl Fn(&[u8]) -> Result<A, String> + Sync + Send,
) -> Outcome {
    let mut input = BufReader::with_capacity(BUFFER_BYTES, io::stdin().lock());
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

/// The next complete lines of the input, with their line ends. An empty list means the end of the input. The last line
/// of the input may lack its end.
///
/// The first line is read until it is complete or the input ends. All further lines that are complete in the buffer
/// follow.
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

/// An answer as one line of JSON.
fn json(answer: &impl Serialize) -> String {
    // Answers are structs of numbers and strings, whose serialisation cannot fail.
    serde_json::to_string(answer).unwrap_or_else(|error| format!("{{\"error\":{:?}}}", error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All batches of `next_lines`, from an input whose reads return these pieces of at most 16 bytes.
    fn batches(reads: &[&str]) -> Vec<Vec<String>> {
        /// A reader that returns one piece in each call, as a pipe does.
        struct Pipe<'a>(std::slice::Iter<'a, &'a str>);
        impl Read for Pipe<'_> {
            fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
                let Some(piece) = self.0.next() else { return Ok(0) };
                buffer[..piece.len()].copy_from_slice(piece.as_bytes());
                Ok(piece.len())
            }
        }
        let mut input = BufReader::with_capacity(16, Pipe(reads.iter()));
        let mut batches = Vec::new();
        loop {
            let lines = next_lines(&mut input).unwrap();
            if lines.is_empty() {
                return batches;
            }
            batches.push(lines.iter().map(|line| String::from_utf8_lossy(line).into_owned()).collect());
        }
    }

    #[test]
    fn lines_of_one_read_are_one_batch() {
        assert_eq!(batches(&["a\nb\n", "c\n"]), [vec!["a\n", "b\n"], vec!["c\n"]]);
    }

    #[test]
    fn a_line_split_between_reads_is_whole_in_the_later_batch() {
        assert_eq!(batches(&["a\nbb", "bb\nc\n"]), [vec!["a\n"], vec!["bbbb\n", "c\n"]]);
    }

    #[test]
    fn a_line_longer_than_a_read_is_whole() {
        assert_eq!(batches(&["aaa", "bbb", "ccc\nd\n"]), [["aaabbbccc\n", "d\n"]]);
    }

    #[test]
    fn a_last_line_without_its_end_is_answered() {
        assert_eq!(batches(&["a\n", "\n", "b"]), [["a\n"], ["\n"], ["b"]]);
    }
}
