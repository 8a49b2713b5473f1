//! Tables read from the cache equal those built, and damaged or foreign entries are ignored.
//!
//! `Origin` says where tables come from: `Kept` were built and written, `NotKept` could not be written,
//! `Read` were in the cache, and `Built` were built with the cache off.

use super::*;
use crate::height_field::Preset;
use crate::scattering::{ComplexIndex, Obliquity, SizeRange, TransparentBody};
use crate::table::{Model, Tiling};
use std::fs;
use std::path::Path;
use tempfile::tempdir;

/// Limit in bytes that no test reaches.
const AMPLE: u64 = 1_000_000_000;

/// A sawtooth relief.
fn field(period_um: f64) -> HeightField {
    Preset::Blazed.build(Some(period_um), None).unwrap()
}

/// Options whose tables build in milliseconds.
fn quick() -> Options {
    Options { model: Model::Patch, conserve_energy: false, coherence_length_um: 10.0, ..Options::default() }
}

/// All tables of a surface, serialised.
fn bytes_of(surface: &Surface) -> Vec<u8> {
    postcard::to_stdvec(surface).unwrap()
}

/// Paths of the files in a folder, sorted by name.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<_> = fs::read_dir(folder).unwrap().map(|file| file.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn tables_read_equal_tables_built() {
    let folder = tempdir().unwrap();
    let cache = Cache::new(folder.path().join("made/when/needed"), AMPLE);
    // A skin has every optional part of a surface.
    let coarse = Options { coherence_length_um: 10.0, tolerance: 0.1, ..Options::default() };
    let skin = (Preset::Elaphe.build(None, None).unwrap(), coarse);
    for (field, options) in [(field(2.5), quick()), (field(2.0), Options::default()), skin] {
        let (built, origin) = cache.surface(&field, &options, &Progress::none()).unwrap();
        assert_eq!(origin, Origin::Kept);
        let (read, origin) = cache.surface(&field, &options, &Progress::none()).unwrap();
        assert_eq!(origin, Origin::Read);
        assert_eq!(bytes_of(&built), bytes_of(&read));
        let [wi, wo] = [[0.6, 0.0, 0.8], [-0.3, 0.1, 0.9_f64.sqrt()]];
        assert_eq!(built.eval_pdf(wi, wo, 550.0), read.eval_pdf(wi, wo, 550.0));
        let u = [0.4, 0.3, 0.2];
        assert_eq!(built.sample(wi, &[550.0], u), read.sample(wi, &[550.0], u));
    }
    assert_eq!(files(cache.folder().unwrap()).len(), 3);
}

#[test]
fn every_input_of_the_tables_changes_the_key() {
    let base = (field(2.5), quick());
    let mut keys = vec![Key::of_surface(&base.0, &base.1)];
    let heights = base.0.heights_um();
    let mut nudged = heights.clone();
    nudged[[0, 7]] += 1e-15;
    let (dx, dy) = (base.0.dx_um(), base.0.dy_um());
    let fields = [
        HeightField::new(nudged, dx, dy),
        HeightField::new(heights.clone(), dx * 1.0001, dy),
        HeightField::new(heights.clone(), dx, dy * 1.0001),
        HeightField::new(heights.t().to_owned(), dx, dy),
    ];
    keys.extend(fields.map(|field| Key::of_surface(&field.unwrap(), &base.1)));
    let options = [
        Options { coherence_length_um: 10.000_000_000_1, ..quick() },
        Options { model: Model::Ensemble, ..quick() },
        Options { tiling: Tiling::Aperiodic, ..quick() },
        Options { obliquity: Obliquity::Unit, ..quick() },
        Options { index: Some(SpectralIndex::Constant(ComplexIndex { eta: 1.5, k: 0.0 })), ..quick() },
        Options { conserve_energy: true, ..quick() },
        Options { shadowing: true, ..quick() },
        Options { reach: 0.5, ..quick() },
        Options { sizes: Some(SizeRange { scale: [1.0, 2.0], depth: [1.0, 1.0] }), ..quick() },
        Options { body: Some(TransparentBody { eta: 1.5, is_film: true, normal_min: 0.1 }), ..quick() },
        Options { tolerance: 2e-3, ..quick() },
    ];
    keys.extend(options.map(|options| Key::of_surface(&base.0, &options)));
    let names: std::collections::HashSet<_> = keys.iter().map(Key::file_name).collect();
    assert_eq!(names.len(), keys.len());
    // The build limit does not change the tables.
    assert_eq!(Key::of_surface(&base.0, &Options { build_limit: 7.0, ..quick() }), keys[0]);
}

#[test]
fn damaged_foreign_and_misnamed_entries_are_rebuilt() {
    let folder = tempdir().unwrap();
    let cache = Cache::new(folder.path(), AMPLE);
    let (field, options) = (field(2.5), quick());
    let first = cache.surface(&field, &options, &Progress::none()).unwrap().0;
    let path = files(folder.path()).remove(0);
    let whole = fs::read(&path).unwrap();
    let other = Cache::new(folder.path().join("other"), AMPLE);
    other.surface(&self::field(2.0), &options, &Progress::none()).unwrap();
    let misnamed = fs::read(files(&folder.path().join("other")).remove(0)).unwrap();

    let mut wrong: Vec<(String, Vec<u8>)> = vec![
        ("empty".into(), Vec::new()),
        ("foreign".into(), b"not a table at all".repeat(100)),
        ("of another surface".into(), misnamed),
        ("longer".into(), [whole.clone(), vec![0]].concat()),
    ];
    // One flipped byte in the magic (from byte 0), the key (16), the hash (48) and the contents (80); and truncation at
    // each of these positions.
    for at in [0, 20, 60, 80, whole.len() / 3, whole.len() / 2, whole.len() - 1] {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x40;
        wrong.push((format!("byte {at}"), bytes));
        wrong.push((format!("cut at {at}"), whole[..at].to_vec()));
    }
    for (damage, bytes) in wrong {
        fs::write(&path, bytes).unwrap();
        let (surface, origin) = cache.surface(&field, &options, &Progress::none()).unwrap();
        assert_eq!(origin, Origin::Kept, "{damage}");
        // Only the words are compared, since the reports differ by the time of building.
        assert!(surface.table().words() == first.table().words(), "{damage}");
        assert_eq!(
            cache.surface(&field, &options, &Progress::none()).unwrap().1,
            Origin::Read,
            "{damage} was not replaced"
        );
    }
    // A valid magic and key, then contents that agree with their hash but are no tables.
    let key = Key::of_surface(&field, &options);
    let mut forged = whole[..16 + 32].to_vec();
    forged.extend_from_slice(blake3::hash(b"short").as_bytes());
    forged.extend_from_slice(b"short");
    assert!(entry::decode::<Surface>(&key, &forged).is_none());
    // The entry was written from `first`, so that their reports agree, too.
    assert_eq!(entry::decode(&key, &whole).map(|surface| bytes_of(&surface)), Some(bytes_of(&first)));
}

#[test]
fn least_recently_used_entries_are_removed_first_and_other_files_stay() {
    let folder = tempdir().unwrap();
    let options = quick();
    let ample = Cache::new(folder.path(), AMPLE);
    // A file of others, which does not count, although it has the extension of entries.
    fs::write(folder.path().join("notes.tables"), vec![0; 1 << 20]).unwrap();
    // Bytes of the entry of a period; `None` without an entry.
    let size = |cache: &Cache, period: f64| {
        let key = Key::of_surface(&field(period), &options);
        fs::metadata(cache.folder().unwrap().join(key.file_name())).map(|metadata| metadata.len()).ok()
    };
    for period in [2.0, 2.1, 2.2] {
        ample.surface(&field(period), &options, &Progress::none()).unwrap();
    }
    // Moves the last use of an entry into the past.
    let age = |period: f64, seconds: u64| {
        let path = folder.path().join(Key::of_surface(&field(period), &options).file_name());
        let then = std::time::SystemTime::now() - std::time::Duration::from_secs(seconds);
        fs::File::options().append(true).open(path).unwrap().set_modified(then).unwrap();
    };
    age(2.0, 300);
    age(2.1, 200);
    age(2.2, 100);
    // Reading the oldest entry makes it the most recently used.
    assert_eq!(ample.surface(&field(2.0), &options, &Progress::none()).unwrap().1, Origin::Read);
    // All entries have about one size: two and a half of it are room for two, not for three.
    let room_for_two = size(&ample, 2.0).unwrap() * 5 / 2;
    let small = Cache::new(folder.path(), room_for_two);
    assert_eq!(small.surface(&field(2.3), &options, &Progress::none()).unwrap().1, Origin::Kept);
    assert!(size(&small, 2.1).is_none() && size(&small, 2.2).is_none());
    assert!(size(&small, 2.0).is_some() && size(&small, 2.3).is_some());
    assert!(folder.path().join("notes.tables").exists());
    // An entry larger than the limit is not kept.
    let (_, origin) = Cache::new(folder.path(), 100).surface(&field(2.4), &options, &Progress::none()).unwrap();
    assert!(matches!(&origin, Origin::NotKept(reason) if reason.contains("100")), "{origin:?}");
}

#[test]
fn unusable_folders_are_no_error() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    let (_, origin) = Cache::new(file.join("below"), AMPLE).surface(&field(2.5), &quick(), &Progress::none()).unwrap();
    assert!(matches!(&origin, Origin::NotKept(reason) if reason.contains("below")), "{origin:?}");
    let (_, origin) = Cache::off().surface(&field(2.5), &quick(), &Progress::none()).unwrap();
    assert_eq!(origin, Origin::Built);
}

#[test]
fn concurrent_writers_of_one_key_leave_one_entry() {
    let folder = tempdir().unwrap();
    let cache = Cache::new(folder.path(), AMPLE);
    let (field, options) = (field(2.5), quick());
    let expected = Surface::new(&field, &options).unwrap();
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| {
                for _ in 0..5 {
                    let (surface, origin) = cache.surface(&field, &options, &Progress::none()).unwrap();
                    assert_eq!(surface.table().words(), expected.table().words());
                    assert!(matches!(origin, Origin::Read | Origin::Kept), "{origin:?}");
                }
            });
        }
    });
    assert_eq!(files(folder.path()).len(), 1, "nothing unfinished is left");
}

#[test]
fn environment_variables_are_read_or_refused() {
    let cache = |variables: &[(&str, &str)]| {
        Cache::from_variables(|name| {
            variables.iter().find(|(known, _)| *known == name).map(|(_, value)| (*value).into())
        })
    };
    assert_eq!(cache(&[(SWITCH, "off"), (FOLDER, "/a")]).unwrap(), Cache::off());
    assert_eq!(cache(&[(FOLDER, "/a")]).unwrap(), Cache::new("/a", DEFAULT_LIMIT_MB * 1_000_000));
    assert_eq!(cache(&[(FOLDER, "/a"), (LIMIT, "5"), (SWITCH, "on")]).unwrap(), Cache::new("/a", 5_000_000));
    for (variable, value) in [(SWITCH, "maybe"), (LIMIT, "much"), (LIMIT, "-1")] {
        let message = cache(&[(variable, value)]).unwrap_err().to_string();
        assert!(message.contains(variable) && message.contains(value), "{message}");
    }
}
