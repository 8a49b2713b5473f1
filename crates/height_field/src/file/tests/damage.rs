//! Damaged files are read or refused, without panics or large allocations.

use super::samples;
use super::*;
use rand::{RngExt, SeedableRng};

/// Seed of the damage.
const SEED: u64 = 2026;
/// Mutations of every sample.
const MUTATIONS: usize = 3000;

fn read_anyhow(name: &str, bytes: &[u8]) {
    let path = Path::new(name);
    let format = Format::of(path).unwrap();
    // Any outcome is right: some bytes are only heights.
    for (channel, fill) in [(None, Fill::None), (Some("1"), Fill::Laplace)] {
        for scale in [scale(0.1, 0.4), NO_SCALE] {
            let options = ReadOptions { scale, channel: channel.map(str::to_owned), fill };
            if let Err(error) = format.read(path, bytes, &options) {
                let message = error.to_string();
                assert!(!message.contains('\n') && message.contains(name), "one line that names the file: {message}");
            }
        }
    }
}

fn is_refused(name: &str, bytes: &[u8], scale: FileScale) -> bool {
    let options = ReadOptions { scale, ..Default::default() };
    Format::of(Path::new(name)).unwrap().read(Path::new(name), bytes, &options).is_err()
}

fn all_samples() -> Vec<(&'static str, Vec<u8>)> {
    let folder = tempfile::tempdir().unwrap();
    let mut all = Vec::new();
    for name in ["a.exr", "a.gsf", "a.png", "a.npy"] {
        let path = folder.path().join(name);
        sample().write(&path).unwrap();
        all.push((name, std::fs::read(path).unwrap()));
    }
    all.extend([
        ("a.txt", b"1 2 4 3\n3 4 1 2\n2 1 4 4\n".to_vec()),
        ("b.txt", samples::texts()[2].clone()),
        ("a.grd", samples::surfer().into_bytes()),
        ("a.xyz", samples::xyz().into_bytes()),
        ("a.gwy", samples::gwy(true)),
        ("b.sdf", samples::sdf_binary("ISO-2.0", 5)),
        ("c.sdf", samples::sdf_binary("BCR-1.0", 7)),
        ("d.sdf", samples::sdf_text("BAD").into_bytes()),
        ("a.x3p", samples::x3p(true)),
        ("a.spm", samples::nanoscope(true)),
        ("a.tif", samples::tiff(Some("ImageJ=1\nunit=um\n"), Some((3, 20_000)))),
    ]);
    all
}

#[test]
fn changed_bytes_and_truncated_files_do_not_panic() {
    for (name, bytes) in all_samples() {
        for at in 0..bytes.len() {
            // The padding of NanoScope's sample.
            if bytes[at] == b'?' {
                continue;
            }
            for value in [bytes[at] ^ 1, 0xff] {
                let mut damaged = bytes.clone();
                damaged[at] = value;
                read_anyhow(name, &damaged);
            }
            let is_text = ["txt", "xyz", "grd"].iter().any(|end| name.ends_with(end));
            // Truncation may lose bytes that are not needed: the trailer of a surface data file, the end of a TIFF's
            // directory, and other channels.
            let has_trailer = ["d.sdf", "a.tif", "a.spm"].contains(&name);
            if !is_text && !has_trailer {
                assert!(is_refused(name, &bytes[..at], NO_SCALE), "{name} cut to {at} bytes");
            }
            read_anyhow(name, &bytes[..at]);
        }
    }
}

#[test]
fn mutated_files_do_not_panic() {
    let mut random = rand_pcg::Pcg64::seed_from_u64(SEED);
    for (name, bytes) in all_samples() {
        // Places of all bytes but padding.
        let places: Vec<usize> = (0..bytes.len()).filter(|at| bytes[*at] != b'?').collect();
        for _ in 0..MUTATIONS {
            let mut damaged = bytes.clone();
            for _ in 0..random.random_range(1..6) {
                let at = places[random.random_range(0..places.len())];
                match random.random_range(0..5) {
                    0 => damaged[at.min(bytes.len() - 1)] = random.random(),
                    1 => damaged[at] = [0, 1, 0x7f, 0x80, 0xff, b'0', b'9', b'-'][random.random_range(0..8)],
                    // The largest length or count.
                    2 => damaged.iter_mut().skip(at).take(4).for_each(|byte| *byte = 0xff),
                    3 => {
                        let from = random.random_range(0..damaged.len());
                        let count = random.random_range(1..9).min(damaged.len() - from.max(at));
                        let to = at.min(damaged.len() - count);
                        damaged.copy_within(from..from + count, to);
                    }
                    _ => damaged.iter_mut().skip(at).take(8).for_each(|byte| *byte = byte.wrapping_add(1)),
                }
            }
            read_anyhow(name, &damaged);
        }
    }
}

#[test]
fn noise_is_refused() {
    let mut random = rand_pcg::Pcg64::seed_from_u64(SEED);
    for (name, bytes) in all_samples() {
        for length in [0, 1, 7, 100, 5000] {
            let mut noise = vec![0_u8; length];
            random.fill(&mut noise[..]);
            assert!(is_refused(name, &noise, scale(0.1, 0.4)), "{name} of {length} bytes of noise");
            // Noise after the format's first bytes.
            read_anyhow(name, &[&bytes[..bytes.len().min(8)], &noise].concat());
        }
    }
}
