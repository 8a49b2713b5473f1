//! Mutated files of all formats are read or refused: no panic, no long wait, no large allocation. Accepted fields pass
//! the estimate of a build.

#![allow(clippy::unwrap_used, reason = "helpers of tests unwrap as tests do")]

#[path = "../src/file/tests/samples.rs"]
#[allow(dead_code, reason = "some samples serve the unit tests only")]
mod samples;

use ndarray::Array2;
use peak_alloc::PeakAlloc;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};
use sunbeam::height_field::{FileScale, Fill, HeightField, Level, MAX_LENGTH_UM, ReadOptions};
use sunbeam::lobe::Surface;
use sunbeam::scattering::Options;
use sunbeam::table::{Model, Tiling};

#[global_allocator]
static ALLOCATED: PeakAlloc = PeakAlloc;

/// Seed of the mutations.
const SEED: u64 = 20_261;
/// Mutations of each format.
const MUTATIONS: usize = 2000;
/// Largest allocation for a file of a few kilobytes. Packed formats may hold some thousand times their size.
const MEMORY_MAX: usize = 96 << 20;
/// Longest time for a file on a busy machine; most take microseconds.
const TIME_MAX: Duration = Duration::from_secs(5);
/// Surfaces built for each format.
const BUILT: usize = 5;
/// Largest number of pixels of a built surface.
const BUILT_PIXELS: usize = 64;

/// Numbers that replace those of text headers.
const WORDS: [&str; 14] = [
    "0",
    "-1",
    "1",
    "3",
    "65536",
    "2147483648",
    "4294967295",
    "18446744073709551615",
    "1e9",
    "1e38",
    "-1e308",
    "1e-320",
    "nan",
    "inf",
];

fn formats() -> Vec<(&'static str, Vec<Vec<u8>>)> {
    let folder = tempfile::tempdir().unwrap();
    let heights = Array2::from_shape_fn((5, 7), |(iy, ix)| 0.1 + 0.03 * ix as f64 + 0.04 * (iy * iy) as f64 / 5.0);
    let field = HeightField::new(heights, 0.065, 0.11).unwrap();
    let written = |name: &str| {
        let path = folder.path().join(name);
        field.write(&path).unwrap();
        std::fs::read(path).unwrap()
    };
    let imagej = "ImageJ=1\nunit=um\nvunit=nm\ncf=0\nc0=0\nc1=0.5\n";
    vec![
        ("exr", vec![written("a.exr")]),
        ("gsf", vec![written("a.gsf")]),
        ("png", vec![written("a.png")]),
        ("npy", vec![written("a.npy")]),
        ("txt", samples::texts()),
        ("grd", vec![samples::surfer().into_bytes()]),
        ("xyz", vec![samples::xyz().into_bytes()]),
        ("gwy", vec![samples::gwy(true), samples::gwy(false)]),
        (
            "sdf",
            vec![
                samples::sdf_binary("ISO-1.0", 5),
                samples::sdf_binary("ISO-2.0", 7),
                samples::sdf_binary("BCR-1.0", 7),
                samples::sdf_text("BAD").into_bytes(),
            ],
        ),
        ("x3p", vec![samples::x3p(true), samples::x3p(false)]),
        ("spm", vec![samples::nanoscope(false), samples::nanoscope(true)]),
        ("tif", vec![samples::tiff(Some(imagej), Some((3, 20_000))), samples::tiff(None, None)]),
    ]
}

fn mutate(random: &mut Pcg64, bytes: &mut Vec<u8>, donors: &[Vec<u8>]) {
    for _ in 0..random.random_range(1..4) {
        if bytes.is_empty() {
            return;
        }
        let at = random.random_range(0..bytes.len());
        match random.random_range(0..8) {
            0 => bytes[at] ^= 1 << random.random_range(0..8),
            1 => bytes[at] = random.random(),
            2 => bytes.truncate(at),
            3 => {
                // A piece of another or of this file, inserted or in place of the bytes there.
                let donor = &donors[random.random_range(0..donors.len())];
                let from = random.random_range(0..donor.len());
                let piece = donor[from..(from + random.random_range(1..40)).min(donor.len())].to_vec();
                let replaced = if random.random() { piece.len().min(bytes.len() - at) } else { 0 };
                bytes.splice(at..at + replaced, piece);
            }
            4 => {
                let end = (at + random.random_range(1..16)).min(bytes.len());
                bytes.drain(at..end);
            }
            5 | 6 => {
                let words: [&[u8]; 12] = [
                    &[0xff; 4],
                    &[0xff; 2],
                    &[0, 0, 0, 0x80],
                    &[0x7f, 0xff, 0xff, 0xff],
                    &[0; 8],
                    &f64::MAX.to_le_bytes(),
                    &f64::NAN.to_le_bytes(),
                    &f64::NEG_INFINITY.to_le_bytes(),
                    &5e-324_f64.to_le_bytes(),
                    &1e9_f64.to_le_bytes(),
                    &1e38_f32.to_le_bytes(),
                    &0x0001_0000_u32.to_le_bytes(),
                ];
                let word = words[random.random_range(0..words.len())];
                bytes.iter_mut().skip(at).zip(word).for_each(|(to, from)| *to = *from);
            }
            _ => {
                // The next number of a text.
                let is_digit = |byte: &u8| byte.is_ascii_digit() || b".-e".contains(byte);
                let Some(start) = bytes[at..].iter().position(u8::is_ascii_digit).map(|skipped| at + skipped) else {
                    continue;
                };
                let length = bytes[start..].iter().position(|byte| !is_digit(byte)).unwrap_or(bytes.len() - start);
                bytes.splice(start..start + length, WORDS[random.random_range(0..WORDS.len())].bytes());
            }
        }
    }
}

/// Mutates bytes under a checksum or a compression, so that damage passes it.
fn mutate_within(random: &mut Pcg64, extension: &str, bytes: &[u8], donors: &[Vec<u8>]) -> Option<Vec<u8>> {
    match extension {
        "x3p" => {
            let z = "<DataType>I</DataType><Increment>1e-9</Increment><Offset>2.5e-7</Offset>";
            let mut xml = samples::x3p_description("I", z, 1, samples::X3P_LINK).into_bytes();
            let mut data: Vec<u8> = (0..12).map(|_| random.random()).collect();
            if random.random() {
                mutate(random, &mut xml, donors);
            } else {
                mutate(random, &mut data, donors);
            }
            Some(samples::archive(&[("main.xml", &xml), ("bindata/data.bin", &data)]))
        }
        "png" => {
            let mut damaged = bytes.to_vec();
            mutate(random, &mut damaged, donors);
            mend_checksums(&mut damaged);
            Some(damaged)
        }
        _ => None,
    }
}

/// Corrects the checksum of each chunk of a PNG.
fn mend_checksums(png: &mut [u8]) {
    let mut at = 8;
    while let Some(header) = png.get(at..at + 8) {
        let length = u32::from_be_bytes([header[0], header[1], header[2], header[3]]) as usize;
        let Some(end) = (at + 8).checked_add(length).filter(|end| end + 4 <= png.len()) else { return };
        let checksum = crc32(&png[at + 4..end]);
        png[end..end + 4].copy_from_slice(&checksum.to_be_bytes());
        at = end + 4;
    }
}

/// The CRC-32 of ISO 3309.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0xedb8_8320 } else { crc >> 1 })
    })
}

#[test]
fn checksum_matches_the_standard() {
    assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
}

/// Result of reading a mutated file.
enum Outcome {
    Refused,
    Accepted(HeightField),
}

fn read(path: &Path, number: usize) -> Outcome {
    let scale = match number / 2 % 3 {
        0 => FileScale { pixel_size_um: Some(0.1), max_height_um: Some(0.4) },
        1 => FileScale { pixel_size_um: Some(0.1), max_height_um: None },
        _ => FileScale::default(),
    };
    let channel = (number % 7 == 3).then(|| "1".to_owned());
    let fill = [Fill::Laplace, Fill::None, Fill::Mean][number % 3];
    match HeightField::read_with(path, &ReadOptions { scale, channel, fill }) {
        Err(error) => {
            let message = error.to_string();
            assert!(!message.contains('\n') && message.len() < 4000, "one line: {message}");
            Outcome::Refused
        }
        Ok(read) => Outcome::Accepted(read.field),
    }
}

/// Levels the field as a scan, and returns it with options if the estimate allows a build.
fn estimated(field: &HeightField, number: usize) -> Option<(HeightField, Options)> {
    let model = if number % 2 == 0 { Model::Ensemble } else { Model::Patch };
    let tiling = if number % 3 == 0 { Tiling::Periodic } else { Tiling::Aperiodic };
    let options = Options {
        model,
        tiling,
        coherence_length_um: 2.0,
        conserve_energy: false,
        tolerance: 0.1,
        ..Options::default()
    };
    // Fields of any size are estimated, since only the configuration checks sizes first.
    let checked = options.demand(field).check(1.0);
    if let Err(error) = &checked {
        assert!(!error.to_string().contains('\n'), "one line: {error}");
    }
    field.check_size(MAX_LENGTH_UM).ok()?;
    let levelled = field.levelled(Level::Plane);
    assert!(levelled.heights_um().iter().all(|h| h.is_finite()));
    options.demand(&levelled).check(1.0).ok()?;
    Some((levelled, options))
}

#[test]
fn mutated_files_are_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let formats = formats();
    let donors: Vec<Vec<u8>> = formats.iter().flat_map(|(_, samples)| samples.clone()).collect();
    let mut random = Pcg64::seed_from_u64(SEED);
    for (extension, samples) in &formats {
        let path = folder.path().join(format!("damaged.{extension}"));
        let (mut accepted, mut buildable, mut built, mut longest, mut largest) = (0, 0, 0, Duration::ZERO, 0);
        for number in 0..MUTATIONS {
            let sample = &samples[number % samples.len()];
            let within = if random.random() { mutate_within(&mut random, extension, sample, &donors) } else { None };
            let damaged = within.unwrap_or_else(|| {
                let mut damaged = sample.clone();
                mutate(&mut random, &mut damaged, &donors);
                damaged
            });
            std::fs::write(&path, &damaged).unwrap();
            ALLOCATED.reset_peak_usage();
            let before = ALLOCATED.current_usage();
            let start = Instant::now();
            let outcome = catch_unwind(AssertUnwindSafe(|| {
                let Outcome::Accepted(field) = read(&path, number) else { return None };
                let plan = estimated(&field, number);
                Some((field, plan))
            }));
            let (elapsed, peak) = (start.elapsed(), ALLOCATED.peak_usage().saturating_sub(before));
            (longest, largest) = (longest.max(elapsed), largest.max(peak));
            let Ok(outcome) = outcome else { panic!("mutation {number} of {extension} panics: {damaged:?}") };
            assert!(elapsed < TIME_MAX, "mutation {number} of {extension} took {elapsed:?}: {damaged:?}");
            assert!(peak < MEMORY_MAX, "mutation {number} of {extension} took {peak} bytes: {damaged:?}");
            let Some((field, plan)) = outcome else { continue };
            accepted += 1;
            let Some((levelled, options)) = plan else { continue };
            buildable += 1;
            if built < BUILT && field.heights_um().len() <= BUILT_PIXELS && levelled.peak_to_valley_um() < 10.0 {
                let surface = Surface::new(&levelled, &options).unwrap();
                let f = surface.eval([0.1, 0.0, 0.99f64.sqrt()], [-0.1, 0.0, 0.99f64.sqrt()], 550.0);
                assert!(
                    f.is_finite() && f >= 0.0,
                    "mutation {number} of {extension}: {f} of {levelled:?} with {options:?}"
                );
                built += 1;
            }
        }
        println!(
            "{extension}: {accepted} of {MUTATIONS} accepted, {buildable} within the limits, {built} built; at most \
             {longest:?} and {:.2} MB",
            largest as f64 / 1e6
        );
        // Damage to heights alone leaves a readable file, so some must be accepted.
        assert!(accepted > MUTATIONS / 200 && built > 0, "{extension}: {accepted} accepted, {built} built");
    }
}
