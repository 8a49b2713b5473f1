//! The exports, called from Rust. Programs in C and C++ are in `tests/c_abi/`; they also call from several threads.
//!
//! `f` is the BRDF in 1/sr, `pdf` a density in 1/sr. An item of a batch is a group of floats (`batch.rs`).

use super::*;
use std::ffi::{CStr, CString, c_char};
use std::ptr::{null, null_mut};

/// Configuration of a surface that builds in milliseconds, and differs between x and y.
const QUICK: &str = r#"{"preset":"blazed","period":2.0,"coherence_length":8,"conserve_energy":false,"tolerance":0.01}"#;
/// The direction into the surface.
const DOWN: [f32; 3] = [0.0, 0.0, -1.0];
/// Largest accepted deviation of a sample's density and weights from those computed at the returned direction, relative
/// to the sum of both.
///
/// The returned direction is rounded to single precision, by up to 3e-8, half of the step of floats in [0.5, 1). At
/// 450 nm this shifts the spatial frequency by 3e-8/0.45 µm = 6.7e-8/µm. The coherence length of 8 µm is four standard
/// deviations s of the window, so an order has the standard deviation 1/(√8·π·s) = 0.056/µm. The shift is 1.2e-6 of it.
/// The order's Gaussian changes most at its edge: by 4 · 1.2e-6 = 5e-6 at four standard deviations.
const SAMPLE_TOLERANCE: f32 = 1e-5;

/// The message of the last error of this thread.
fn message() -> String {
    // SAFETY: the library's own string, read before the next call.
    unsafe { CStr::from_ptr(sunbeam_last_error()) }.to_str().unwrap().to_owned()
}

/// A surface of a configuration, or the status and the message of the failure. The caller frees the surface.
fn new(json: &str) -> Result<*mut SurfaceHandle, (Status, String)> {
    let json = CString::new(json).unwrap();
    let mut surface = null_mut();
    // SAFETY: both are valid.
    match unsafe { sunbeam_surface_new(json.as_ptr(), &mut surface) } {
        Status::Ok => Ok(surface),
        status => {
            assert!(surface.is_null());
            Err((status, message()))
        }
    }
}

/// An input whose items begin `stride` floats apart.
fn floats(values: &[f32], stride: isize) -> Floats {
    Floats { data: values.as_ptr(), stride }
}

/// An output whose items begin `stride` floats apart.
fn out(values: &mut [f32], stride: isize) -> FloatsOut {
    FloatsOut { data: values.as_mut_ptr(), stride }
}

#[test]
fn batches_match_the_library() {
    let surface = new(QUICK).unwrap();
    let config = sunbeam::config::SurfaceConfig::from_json(QUICK).unwrap();
    let (direct, _) = config.build(&sunbeam::cache::Cache::off()).unwrap();
    // Directions begin five floats apart, with NaN between them. All items have the same three wavelengths (stride 0).
    // `f` lies in reverse order: that of item i begins at 57 − 3i.
    let mut wi = Vec::new();
    let mut wo = Vec::new();
    for i in 0..20 {
        let x = 0.09 * i as f32 - 0.9;
        wi.extend([0.6, 0.0, 0.8, f32::NAN, f32::NAN]);
        wo.extend([x, 0.1, (0.99 - x * x).sqrt(), f32::NAN, f32::NAN]);
    }
    let wavelengths = [400.0, 550.0, 700.0];
    let (mut f, mut pdf, mut again) = ([0.0; 60], [0.0; 20], [0.0; 20]);
    // SAFETY: the arrays are as large as the strides say.
    unsafe {
        let last = FloatsOut { data: f.as_mut_ptr().add(57), stride: -3 };
        let (wi, wo, nm) = (floats(&wi, 5), floats(&wo, 5), floats(&wavelengths, 0));
        assert_eq!(sunbeam_surface_eval_pdf(surface, 20, wi, wo, 3, nm, last, out(&mut pdf, 1)), Status::Ok);
        assert_eq!(sunbeam_surface_pdf(surface, 20, wi, wo, 3, nm, out(&mut again, 1)), Status::Ok);
        let mut alone = [0.0; 60];
        assert_eq!(sunbeam_surface_eval(surface, 20, wi, wo, 3, nm, out(&mut alone, 3)), Status::Ok);
        for i in 0..20 {
            assert_eq!(alone[3 * i..][..3], f[57 - 3 * i..][..3]);
        }
    }
    assert_eq!(pdf, again);
    // Number of values above 0.1/sr, about 5. Some must be: equality of zeros alone would show nothing.
    let mut lit = 0;
    for i in 0..20 {
        let unit = |v: &[f32]| sunbeam::scattering::unit_vector([v[0], v[1], v[2]].map(f64::from)).unwrap();
        let (wi, wo) = (unit(&wi[5 * i..]), unit(&wo[5 * i..]));
        for (k, nm) in wavelengths.into_iter().enumerate() {
            let expected = direct.eval_pdf(wi, wo, f64::from(nm)).f as f32;
            assert_eq!(f[57 - 3 * i + k], expected);
            lit += usize::from(expected > 0.1);
        }
        assert_eq!(pdf[i], direct.pdf(wi, wo, &wavelengths.map(f64::from)) as f32);
    }
    assert!(lit > 3, "only {lit} of 60 values are not dark");
    // SAFETY: made above, used no more.
    unsafe { sunbeam_surface_free(surface) };
}

#[test]
fn sample_weights_match_eval_and_pdf() {
    let surface = new(r#"{"preset":"blazed","coherence_length":8,"conserve_energy":false,"eta":1.5}"#).unwrap();
    let count = 200;
    // Multiples of the golden ratio: numbers that fill [0, 1) evenly.
    let u: Vec<f32> = (0..3 * count).map(|i| (i as f32 * 0.618_034).fract()).collect();
    // Incidence at 74°, from which some samples fall below the horizon.
    let (wi, nm) = ([0.96, 0.0, 0.28], [450.0, 600.0]);
    let (mut wo, mut pdf, mut weight) = (vec![0.0; 3 * count], vec![0.0; count], vec![0.0; 2 * count]);
    let (mut f, mut density) = (vec![0.0; 2 * count], vec![0.0; count]);
    // SAFETY: the arrays are as large as the strides say.
    unsafe {
        let (wi, nm) = (floats(&wi, 0), floats(&nm, 0));
        let (wo_out, pdf_out, weight_out) = (out(&mut wo, 3), out(&mut pdf, 1), out(&mut weight, 2));
        let status = sunbeam_surface_sample(surface, count, wi, 2, nm, floats(&u, 3), wo_out, pdf_out, weight_out);
        assert_eq!(status, Status::Ok, "{}", message());
        // A sample below the horizon has zeros for its direction, which `eval_pdf` refuses. DOWN, which it accepts,
        // also has `f` and `pdf` of 0.
        for sampled in wo.chunks_mut(3).filter(|w| w[2] == 0.0) {
            sampled.copy_from_slice(&DOWN);
        }
        let (f_out, density_out) = (out(&mut f, 2), out(&mut density, 1));
        let status = sunbeam_surface_eval_pdf(surface, count, wi, floats(&wo, 3), 2, nm, f_out, density_out);
        assert_eq!(status, Status::Ok, "{}", message());
        sunbeam_surface_free(surface);
    }
    let is_close = |a: f32, b: f32| (a - b).abs() <= SAMPLE_TOLERANCE * (a.abs() + b.abs());
    let mut above = 0;
    for i in 0..count {
        assert!(is_close(pdf[i], density[i]), "{} {}", pdf[i], density[i]);
        for k in 0..2 {
            let expected = if pdf[i] > 0.0 { f[2 * i + k] * wo[3 * i + 2] / density[i] } else { 0.0 };
            assert!(is_close(weight[2 * i + k], expected), "{} {expected}", weight[2 * i + k]);
        }
        above += usize::from(pdf[i] > 0.0);
    }
    assert!((count / 2..count).contains(&above), "{above} of {count} samples are above the horizon");
}

#[test]
fn bad_items_are_counted_and_others_computed() {
    let surface = new(QUICK).unwrap();
    // Item 0 is good, items 1 and 2 have no unit vector, item 3 has a wavelength out of range, and item 4 is good but
    // below the horizon.
    let wi: Vec<f32> = [[0.6, 0.0, 0.8], [f32::NAN, 0.0, 1.0], [0.0; 3], [0.0, 0.0, 1.0], DOWN].concat();
    let nm = [550.0, 550.0, 550.0, 900.0, 550.0];
    // Values that every item overwrites.
    let (mut f, mut pdf) = ([7.0; 5], [7.0; 5]);
    // SAFETY: the arrays are as large as the strides say.
    let status = unsafe {
        let (wi, wo, nm) = (floats(&wi, 3), floats(&[0.0, 0.0, 1.0], 0), floats(&nm, 1));
        sunbeam_surface_eval_pdf(surface, 5, wi, wo, 1, nm, out(&mut f, 1), out(&mut pdf, 1))
    };
    assert_eq!(status, Status::BadValue);
    assert_eq!(
        message(),
        "3 of 5 items are not usable; the first is item 1: `wi` has length NaN; it must be 1 within 0.001"
    );
    assert!(f[0] > 0.0 && pdf[0] > 0.0 && f[1..] == [0.0; 4] && pdf[1..] == [0.0; 4], "{f:?} {pdf:?}");
    // A random number of 1 is out of range.
    let (mut wo, mut weight) = ([7.0; 3], [7.0]);
    // SAFETY: as above.
    let status = unsafe {
        let (wo_out, pdf_out, weight_out) = (out(&mut wo, 3), out(&mut pdf, 1), out(&mut weight, 1));
        let (up, u) = (floats(&[0.0, 0.0, 1.0], 0), floats(&[0.5, 1.0, 0.5], 3));
        sunbeam_surface_sample(surface, 1, up, 1, floats(&[550.0], 0), u, wo_out, pdf_out, weight_out)
    };
    assert_eq!((status, wo, weight), (Status::BadValue, [0.0; 3], [0.0]));
    assert!(message().contains("`u` holds 1") && message().contains("[0, 1)"), "{}", message());
    // SAFETY: made above, used no more.
    unsafe { sunbeam_surface_free(surface) };
}

#[test]
fn null_and_misaligned_pointers_are_errors() {
    let surface = new(QUICK).unwrap();
    let (up, nm) = ([0.0, 0.0, 1.0], [550.0]);
    let mut result = [0.0; 8];
    let (good, nm) = (floats(&up, 0), floats(&nm, 0));
    let nothing = Floats { data: null(), stride: 3 };
    let odd = Floats { data: up.as_ptr().wrapping_byte_add(1), stride: 0 };
    // SAFETY: pointers are valid, except null and misaligned ones, which are refused before they are read.
    unsafe {
        let to = out(&mut result, 1);
        let eval = |surface, wi, wo, nm, f| (sunbeam_surface_eval(surface, 1, wi, wo, 1, nm, f), message());
        let nowhere = FloatsOut { data: null_mut(), stride: 1 };
        let odd_out = FloatsOut { data: to.data.wrapping_byte_add(1), stride: 1 };
        for (name, outcome) in [
            ("surface", eval(null(), good, good, nm, to)),
            ("surface", eval(surface.wrapping_byte_add(1), good, good, nm, to)),
            ("wi", eval(surface, nothing, good, nm, to)),
            ("wo", eval(surface, good, odd, nm, to)),
            ("wavelength_nm", eval(surface, good, good, nothing, to)),
            ("f", eval(surface, good, good, nm, nowhere)),
            ("f", eval(surface, good, good, nm, odd_out)),
        ] {
            assert_eq!(outcome.0, Status::BadPointer);
            assert!(outcome.1.contains(&format!("`{name}`")), "{}", outcome.1);
        }
        // A batch without items needs no arrays.
        assert_eq!(sunbeam_surface_eval(surface, 0, nothing, nothing, 1, nothing, nowhere), Status::Ok);
        // An item without wavelengths, and one with too many.
        assert_eq!(sunbeam_surface_eval(surface, 1, good, good, 0, nm, to), Status::BadValue);
        assert_eq!(sunbeam_surface_eval(surface, 1, good, good, usize::MAX, nm, to), Status::BadValue);
        // Results of three wavelengths that begin one float apart.
        assert_eq!(sunbeam_surface_eval(surface, 2, good, good, 3, nm, to), Status::BadValue);
        assert!(message().contains("overlap"), "{}", message());
        // A missing configuration, and no place for the surface.
        assert_eq!(sunbeam_surface_new(null(), &mut null_mut()), Status::BadPointer);
        assert_eq!(sunbeam_surface_new(c"{}".as_ptr(), null_mut()), Status::BadPointer);
        // No buffer although it has a capacity, and no place for its required size.
        assert_eq!(sunbeam_surface_describe(surface, null_mut(), 1 << 20, &mut 0), Status::BadPointer);
        assert_eq!(sunbeam_surface_describe(surface, null_mut(), 0, null_mut()), Status::BadPointer);
        let mut needed = 0_usize;
        let odd_needed = (&raw mut needed).wrapping_byte_add(1);
        assert_eq!(sunbeam_surface_describe(surface, null_mut(), 0, odd_needed), Status::BadPointer);
        assert!(message().contains("`needed` is not aligned to"), "{}", message());
        let mut created: *mut SurfaceHandle = null_mut();
        let odd_created = (&raw mut created).wrapping_byte_add(1);
        assert_eq!(sunbeam_surface_new(c"{}".as_ptr(), odd_created), Status::BadPointer);
        assert!(message().contains("`surface` is not aligned to"), "{}", message());
        // Null is ignored.
        sunbeam_surface_free(null_mut());
        sunbeam_surface_free(surface);
    }
}

#[test]
fn configurations_are_refused_by_kind() {
    for (json, status, mentioned) in [
        ("{", Status::BadConfig, "JSON"),
        (r#"{"preset":"cobra"}"#, Status::BadConfig, "xenopeltis"),
        (r#"{"coherence_length":-1}"#, Status::BadConfig, "[1e-3, 1e5]"),
        (r#"{"k":1}"#, Status::BadConfig, "\"eta\""),
        (r#"{"filename":"no/such.gsf"}"#, Status::BadHeightField, "no/such.gsf"),
        // The period is too long for the solver (crates/rigorous/src/limits.rs), whatever the build limit.
        (
            r#"{"preset":"lamellar","period":50,"eta":1.5,"theory":"rigorous","build_limit":1e6}"#,
            Status::BadTables,
            "at most 108 wavelengths",
        ),
    ] {
        let (found, message) = new(json).unwrap_err();
        assert_eq!(found, status, "{message}");
        assert!(message.contains(mentioned), "{message}");
    }
    // 0xe9 is é in Latin-1, and begins a longer character in UTF-8.
    let latin = [b'{' as c_char, 0xe9u8 as c_char, 0];
    // SAFETY: a string with its terminating NUL.
    assert_eq!(unsafe { sunbeam_surface_new(latin.as_ptr(), &mut null_mut()) }, Status::BadConfig);
    assert!(message().contains("UTF-8"), "{}", message());
}

#[test]
fn heights_from_memory_are_those_of_a_scan() {
    // Rows begin ten floats apart. The first six of them are heights.
    let (nx, ny) = (6, 4);
    let heights: Vec<f32> = (0..10 * ny).map(|i| 0.02 * ((i * i) % 7) as f32).collect();
    let json = r#"{"coherence_length":2,"tolerance":0.01,"conserve_energy":false}"#;
    // Pixels are `pixel` × 0.2 µm.
    let make = |json: &str, nx: usize, ny: usize, pixel: f64| {
        let (json, mut surface) = (CString::new(json).unwrap(), null_mut());
        // SAFETY: the array holds `ny` rows of `nx` heights, or the size is refused before any height is read.
        let status = unsafe {
            sunbeam_surface_from_heights(json.as_ptr(), floats(&heights, 10), nx, ny, pixel, 0.2, &mut surface)
        };
        (status, surface)
    };
    let (status, surface) = make(json, nx, ny, 0.1);
    assert_eq!(status, Status::Ok, "{}", message());
    let rows = ndarray::Array2::from_shape_fn((ny, nx), |(iy, ix)| f64::from(heights[10 * iy + ix]));
    let field = sunbeam::height_field::HeightField::new(rows, 0.1, 0.2).unwrap();
    // Aperiodic tiling, and levelling by a plane below, are the defaults for scans and for heights from memory.
    let options = sunbeam::scattering::Options {
        coherence_length_um: 2.0,
        tiling: sunbeam::table::Tiling::Aperiodic,
        conserve_energy: false,
        tolerance: 0.01,
        ..Default::default()
    };
    let direct = sunbeam::lobe::Surface::new(&field.levelled(sunbeam::height_field::Level::Plane), &options).unwrap();
    let mut f = [0.0];
    let nm = [500.0];
    // SAFETY: one item each.
    let status = unsafe {
        let (wi, wo) = (floats(&[0.6, 0.0, 0.8], 3), floats(&[0.0, 0.28, 0.96], 3));
        sunbeam_surface_eval(surface, 1, wi, wo, 1, floats(&nm, 1), out(&mut f, 1))
    };
    assert_eq!(status, Status::Ok);
    let unit = |v: [f32; 3]| sunbeam::scattering::unit_vector(v.map(f64::from)).unwrap();
    let expected = direct.eval_pdf(unit([0.6, 0.0, 0.8]), unit([0.0, 0.28, 0.96]), 500.0).f as f32;
    assert!(expected > 0.0 && f[0] == expected, "{f:?} {expected}");
    // SAFETY: made above, used no more.
    unsafe { sunbeam_surface_free(surface) };
    for (json, nx, ny, pixel, status, mentioned) in [
        // Rows without heights, also with the largest number of rows.
        (json, 0, ny, 0.1, Status::BadHeightField, "pixel"),
        (json, 0, usize::MAX, 0.1, Status::BadHeightField, "pixel"),
        // Pixels without a width.
        (json, nx, ny, 0.0, Status::BadHeightField, "finite and positive"),
        // `nx * ny` overflows.
        (json, usize::MAX, 2, 0.1, Status::BadValue, "nx"),
        (json, 1 << 40, 1 << 40, 0.1, Status::BadValue, "`build_limit`"),
        // More heights than the default build limit allows: 8 GB, at 24 bytes for each height (`handle.rs`).
        (json, 1 << 20, 1 << 20, 0.1, Status::BadValue, "at most 333333333, with `ny` 1048576"),
        // 2^48 = 2.8e14 heights: more than memory holds, but fewer than the 3.3e14 that this build limit allows.
        (r#"{"build_limit":1e6}"#, 1 << 24, 1 << 24, 0.1, Status::BadValue, "fit memory"),
        // A parameter of presets.
        (r#"{"preset":"flat"}"#, nx, ny, 0.1, Status::BadConfig, "\"preset\""),
    ] {
        let (found, surface) = make(json, nx, ny, pixel);
        assert_eq!(found, status, "{}", message());
        assert!(surface.is_null() && message().contains(mentioned), "{}", message());
    }
}

#[test]
fn missing_heights_are_refused_or_filled() {
    let (nx, ny) = (6, 4);
    let mut heights: Vec<f32> = (0..nx * ny).map(|i| 0.02 * ((i * i) % 7) as f32).collect();
    let quick = r#""coherence_length":2,"tolerance":0.01,"conserve_energy":false"#;
    let f_at = |heights: &[f32], json: String| {
        let (json, mut surface, mut f) = (CString::new(json).unwrap(), null_mut(), [0.0]);
        // SAFETY: the array holds `ny` rows of `nx` heights.
        let status = unsafe {
            sunbeam_surface_from_heights(json.as_ptr(), floats(heights, nx as isize), nx, ny, 0.1, 0.1, &mut surface)
        };
        if status != Status::Ok {
            return Err((status, message()));
        }
        // SAFETY: one item each; the surface was made above and is used no more after it was freed.
        unsafe {
            let (wi, wo) = (floats(&[0.6, 0.0, 0.8], 3), floats(&[0.0, 0.28, 0.96], 3));
            assert_eq!(sunbeam_surface_eval(surface, 1, wi, wo, 1, floats(&[500.0], 1), out(&mut f, 1)), Status::Ok);
            sunbeam_surface_free(surface);
        }
        Ok(f[0])
    };
    // Without a missing height, `fill` has no effect.
    let whole = f_at(&heights, format!(r#"{{{quick},"fill":"laplace"}}"#)).unwrap();
    assert_eq!(f_at(&heights, format!("{{{quick}}}")).unwrap(), whole);
    heights[nx + 3] = f32::NAN;
    let (status, refusal) = f_at(&heights, format!("{{{quick}}}")).unwrap_err();
    assert_eq!(status, Status::BadHeightField);
    assert!(refusal.contains("1 of 24") && refusal.contains("row 1, column 3; `fill`"), "{refusal}");
    let filled = f_at(&heights, format!(r#"{{{quick},"fill":"mean"}}"#)).unwrap();
    assert!(filled > 0.0 && filled != whole);
}

#[test]
fn description_fits_a_buffer_of_the_returned_size() {
    let surface = new(QUICK).unwrap();
    let mut needed = 0;
    // SAFETY: the buffers have the given sizes.
    unsafe {
        assert_eq!(sunbeam_surface_describe(surface, null_mut(), 0, &mut needed), Status::BufferTooSmall);
        let mut buffer = vec![1 as c_char; needed];
        assert_eq!(
            sunbeam_surface_describe(surface, buffer.as_mut_ptr(), needed - 1, &mut needed),
            Status::BufferTooSmall
        );
        assert_eq!(sunbeam_surface_describe(surface, buffer.as_mut_ptr(), needed, &mut needed), Status::Ok);
        let text = CStr::from_ptr(buffer.as_ptr()).to_str().unwrap();
        assert_eq!(text.len() + 1, needed);
        let description: serde_json::Value = serde_json::from_str(text).unwrap();
        assert_eq!(description["config"]["period"], 2.0);
        assert!(description["table"]["relative_error"].as_f64().unwrap() < 0.01);
        sunbeam_surface_free(surface);
        assert_eq!(CStr::from_ptr(sunbeam_version()).to_str().unwrap(), env!("CARGO_PKG_VERSION"));
    }
}

#[test]
fn panics_become_a_status_and_messages_belong_to_threads() {
    // The message leaves out the NUL, which would end it as a C string.
    assert_eq!(status::call(|| panic!("a defect\0of ours")), Status::Internal);
    assert!(message().contains("a defect") && message().contains("report it"), "{}", message());
    let elsewhere = std::thread::spawn(message).join().unwrap();
    assert_eq!(elsewhere, "");
}

#[test]
fn films_give_samples_on_both_sides() {
    let json = r#"{"preset":"blazed","coherence_length":8,"conserve_energy":false,"eta":1.5,"transmission":"film"}"#;
    let surface = new(json).unwrap();
    let count = 200;
    // Multiples of the golden ratio: numbers that fill [0, 1) evenly.
    let u: Vec<f32> = (0..3 * count).map(|i| (i as f32 * 0.618_034).fract()).collect();
    let (wi, nm) = ([0.6, 0.0, 0.8], [550.0]);
    let (mut wo, mut pdf, mut weight) = (vec![0.0; 3 * count], vec![0.0; count], vec![0.0; count]);
    // SAFETY: the arrays are as large as the strides say.
    unsafe {
        let (wo_out, pdf_out, weight_out) = (out(&mut wo, 3), out(&mut pdf, 1), out(&mut weight, 1));
        let (wi, nm) = (floats(&wi, 0), floats(&nm, 0));
        let status = sunbeam_surface_sample(surface, count, wi, 1, nm, floats(&u, 3), wo_out, pdf_out, weight_out);
        assert_eq!(status, Status::Ok, "{}", message());
        sunbeam_surface_free(surface);
    }
    // About 190 of the 200 samples pass, and about 10 are reflected. Both limits leave a margin.
    let below = wo.chunks(3).filter(|wo| wo[2] < 0.0).count();
    let above = wo.chunks(3).filter(|wo| wo[2] > 0.0).count();
    assert!(below > 150 && above > 2, "{below} below, {above} above");
    assert!(weight.iter().zip(&pdf).all(|(weight, pdf)| *weight >= 0.0 && (*weight == 0.0 || *pdf > 0.0)));
    // The mean weight estimates the fraction of the light that leaves, about 0.91.
    let mean = weight.iter().sum::<f32>() / count as f32;
    assert!((0.7..1.01).contains(&mean), "{mean}");
}
