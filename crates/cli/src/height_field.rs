//! `sunbeam height-field`: the properties of a relief, and its conversion to other files.
//!
//! The heights are read and processed first ([`run`]). The report, the files and the tables then describe the processed
//! heights. Their phase screen, the effect of the relief on the phase of light, is expanded in Chebyshev polynomials
//! (docs/model.md#the-two-expansions); tables hold its power spectrum.

use super::arguments::SHORTEST_VISIBLE_UM;
use super::encode;
use super::output::{Output, output};
use super::progress::{BUILDING, with_bar};
use super::surface_args::SurfaceArgs;
use super::term::Term;
use super::{Outcome, print_json};
use clap::builder::RangedU64ValueParser;
use serde::Serialize;
use std::error::Error;
use std::f64::consts::PI;
use sunbeam::cache::Origin;
use sunbeam::config::{SurfaceConfig, Theory};
use sunbeam::grating::{GratingBody, GratingReport, profile_of};
use sunbeam::height_field::{HeightField, Provenance, Roughness, Seams, TileReport};
use sunbeam::lobe::SurfaceReport;
use sunbeam::methods::TERMS_MAX;
use sunbeam::scattering::SpectralIndex;
use sunbeam::table::Tiling;
use sunbeam::transform::{Periods, chebyshev_terms, periods};

/// Length of the preview's longer side in pixels. A preview need not show every height.
const PREVIEW_PIXELS: f64 = 512.0;

/// Describe a height field as JSON; fill, crop, level, tile and convert it
///
/// The heights are processed in this order: missing points are filled (--fill), a rectangle is cut out (--crop), the
/// heights are levelled (--level), and opposite edges are blended (--make-tileable). The report describes the result.
///
/// periods are the strongest along each axis in the power spectrum of the heights, with the direction of their waves in
/// degrees from +x and their fraction of the variance. seams compare the step across the tile's edges with the steps
/// between neighbours inside. chebyshev_terms is the number of transforms that the phase screen needs for --tolerance
/// at 380 nm. table_bytes_estimate is the size of the table for --coherence-length.
#[derive(clap::Args)]
pub(crate) struct HeightFieldArgs {
    #[command(flatten)]
    surface: SurfaceArgs,
    /// Rectangle to keep: position from the lower left corner and size, in µm
    #[arg(long, value_name = "X,Y,WIDTH,HEIGHT", value_parser = Rectangle::parse, allow_hyphen_values = true)]
    crop: Option<Rectangle>,
    // `None` without the flag; `Some(None)` is the flag without a width.
    /// Blend opposite edges over WIDTH in µm, so that the tile is periodic [default width: a tenth of each side]
    #[arg(long, value_name = "WIDTH", num_args = 0..=1, require_equals = true)]
    make_tileable: Option<Option<f64>>,
    /// File for the heights: .exr (32-bit floats, µm), .gsf, .npy (64-bit floats, µm) or .png (16 bit)
    #[arg(short, long, value_name = "FILE", value_parser = output(&["exr", "gsf", "npy", "png"]))]
    output: Option<Output>,
    /// Write |DFT((h/H)ᴺ)| to --output in place of the heights
    ///
    /// h is the height from the middle of the range, and 2H the range; order 0 is in the middle of the output. A .png
    /// is logarithmic over five decades, a .npy has 64-bit floats.
    #[arg(long, value_name = "N", requires = "output", value_parser = term_numbers(), allow_negative_numbers = true)]
    term: Option<usize>,
    /// File for a grey picture of the heights, black the lowest, +x right and +y up (.png)
    #[arg(long, value_name = "FILE", value_parser = output(&["png"]))]
    preview: Option<Output>,
    /// Build the tables and report their size, build time, measured error and mean albedo
    #[arg(long)]
    tables: bool,
}

/// A parser for the number N of a term, from 1 to [`TERMS_MAX`].
fn term_numbers() -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(1..=TERMS_MAX as u64)
}

/// A rectangle; (x, y) is its lower left corner, relative to the lower left corner of the field.
#[derive(Clone, Copy)]
struct Rectangle {
    x_um: f64,
    y_um: f64,
    width_um: f64,
    height_um: f64,
}

impl Rectangle {
    /// Parses `X,Y,WIDTH,HEIGHT`.
    fn parse(text: &str) -> Result<Self, String> {
        let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
        match numbers.as_deref() {
            Ok(&[x_um, y_um, width_um, height_um]) => Ok(Self { x_um, y_um, width_um, height_um }),
            _ => Err("it must be four numbers in µm: X,Y,WIDTH,HEIGHT".to_owned()),
        }
    }
}

/// The JSON object that the command prints.
#[derive(Serialize)]
struct Report<'a> {
    /// Channel that was read; `None` for formats with a single one.
    #[serde(skip_serializing_if = "Option::is_none")]
    channel: Option<String>,
    /// Number of points that the file lacks and `--fill` filled; `None` without `--fill`.
    #[serde(skip_serializing_if = "Option::is_none")]
    filled_points: Option<usize>,
    /// Origin of each property that the heights need besides the file's numbers, such as their unit: the file itself,
    /// its format, an argument, a default or a guess.
    #[serde(skip_serializing_if = "Option::is_none")]
    provenance: Option<Provenance>,
    /// Warnings of implausible properties of the file.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    doubts: Vec<String>,
    /// Number of pixels along x and y.
    pixels: [usize; 2],
    /// Edges of a pixel along x and y.
    pixel_um: [f64; 2],
    /// Size of the field along x and y.
    extent_um: [f64; 2],
    /// Lowest and highest height in µm.
    range_um: [f64; 2],
    peak_to_valley_um: f64,
    mean_um: f64,
    /// Root mean square deviation from the mean height.
    rms_um: f64,
    /// Root mean square slope along x and y, dimensionless.
    rms_slope: [f64; 2],
    roughness: Roughness,
    periods: Periods,
    seams: Seams,
    /// Change of the heights by `--make-tileable`; `None` without it.
    #[serde(skip_serializing_if = "Option::is_none")]
    made_tileable: Option<TileReport>,
    /// The term of `--term`; `None` without it.
    #[serde(skip_serializing_if = "Option::is_none")]
    term: Option<Term>,
    /// Number of Chebyshev terms that the phase screen needs for the tolerance at 380 nm.
    chebyshev_terms: usize,
    /// Estimated size in bytes of the tables by the scalar theory for the coherence length.
    table_bytes_estimate: usize,
    /// The tables of `--tables`; `None` without it.
    #[serde(skip_serializing_if = "Option::is_none")]
    tables: Option<Tables>,
    #[serde(skip_serializing_if = "Option::is_none")]
    output: &'a Option<Output>,
    #[serde(skip_serializing_if = "Option::is_none")]
    preview: &'a Option<Output>,
}

/// Report of the tables of either theory, and whether they were built or read from the cache.
#[derive(Serialize)]
#[serde(untagged)]
enum Tables {
    Scalar {
        origin: Origin,
        #[serde(flatten)]
        report: SurfaceReport,
    },
    Rigorous {
        origin: Origin,
        #[serde(flatten)]
        report: GratingReport,
    },
}

/// Runs `sunbeam height-field`.
pub(crate) fn run(args: &HeightFieldArgs) -> Outcome {
    if let (Some(_), Some(file)) = (args.term, &args.output) {
        Term::check_output(file)?;
    }
    let mut config = args.surface.config()?;
    if args.make_tileable.is_some() {
        // The blended tile is periodic, and the report is to describe it so. `--tiling` takes precedence.
        config.tiling.get_or_insert(Tiling::Periodic);
    }
    // Missing points are filled, but the heights are not levelled yet.
    let read = config.raw_height_field()?;
    let cropped = match args.crop {
        Some(Rectangle { x_um, y_um, width_um, height_um }) => read.field.cropped(x_um, y_um, width_um, height_um)?,
        None => read.field,
    };
    let levelled = cropped.levelled(config.level());
    let (field, made_tileable) = match args.make_tileable {
        Some(width_um) => levelled.made_tileable(width_um).map(|(field, report)| (field, Some(report)))?,
        None => (levelled, None),
    };
    let term = args.term.map(|n| Term::new(&field, n));
    args.write_files(&field, term.as_ref())?;
    let tables = if args.tables { Some(args.build_tables(&config, &field)?) } else { None };
    let options = config.options();
    // The relief whose phase screen is expanded and tabulated. The index of a cover, or of a body that transmits,
    // magnifies it: there the wavelength is shorter by that factor.
    let inside = config.inside(field.clone());
    // κH, the largest phase of the screen. The phase rate κ = 2π/λ·(cosθi + cosθo) is largest along the normal, 4π/λ,
    // and H is half of the range of heights.
    let kappa_h = 4.0 * PI / SHORTEST_VISIBLE_UM * 0.5 * inside.peak_to_valley_um();
    print_json(&Report {
        channel: read.channel,
        filled_points: config.fill.map(|_| read.filled),
        provenance: read.provenance,
        doubts: read.doubts.iter().map(ToString::to_string).collect(),
        pixels: field.size().into(),
        pixel_um: [field.dx_um(), field.dy_um()],
        extent_um: field.extent_um().into(),
        range_um: field.range_um().into(),
        peak_to_valley_um: field.peak_to_valley_um(),
        mean_um: field.mean_um(),
        rms_um: field.rms_um(),
        rms_slope: field.rms_slope().into(),
        roughness: field.roughness(),
        periods: periods(&field, options.tiling == Tiling::Periodic),
        seams: field.seams(),
        made_tileable,
        term,
        chebyshev_terms: chebyshev_terms(kappa_h, options.tolerance),
        table_bytes_estimate: options.demand(&inside).table_bytes() as usize,
        tables,
        output: &args.output,
        preview: &args.preview,
    })
}

impl HeightFieldArgs {
    /// Writes the heights or the term, and the preview.
    fn write_files(&self, field: &HeightField, term: Option<&Term>) -> Outcome {
        match (&self.output, term) {
            (Some(file), Some(term)) => file.write(&term.encoded(file)?)?,
            (Some(file), None) => field.write(file.path())?,
            (None, _) => {}
        }
        if let Some(file) = &self.preview {
            file.write(&preview_png(field)?)?;
        }
        Ok(())
    }

    /// Builds the tables of the processed heights.
    fn build_tables(&self, config: &SurfaceConfig, field: &HeightField) -> Result<Tables, Box<dyn Error>> {
        // Under a cover or on a body that transmits, tables are built from a magnified relief, not the reported one.
        config.require_bare("--tables")?;
        let cache = self.surface.cache()?;
        match config.theory {
            Theory::Scalar => {
                let options = config.options();
                let (surface, origin) = with_bar(BUILDING, |progress| cache.surface(field, &options, progress))?;
                Ok(Tables::Scalar { origin, report: surface.report().clone() })
            }
            Theory::Rigorous => {
                let index = config.index().map(SpectralIndex::Constant);
                let body = GratingBody::Reflector(index.as_ref());
                // Presets have an exact profile. The profile of a cropped or blended relief comes from its heights.
                let is_changed = self.crop.is_some() || self.make_tileable.is_some();
                let profile = if is_changed { profile_of(field, config.tolerance)? } else { config.profile()? };
                let (length_um, limit) = (config.coherence_length, config.build_limit);
                let built =
                    with_bar(BUILDING, |progress| cache.shared_grating(&profile, body, length_um, limit, progress))?;
                let (surface, origin) = &*built;
                Ok(Tables::Rigorous { origin: origin.clone(), report: *surface.report() })
            }
        }
    }
}

/// The preview as PNG: the tile in its true proportions, +y up. Each pixel shows one height, without interpolation.
fn preview_png(field: &HeightField) -> Result<Vec<u8>, Box<dyn Error>> {
    let (lx, ly) = field.extent_um();
    let preview_pixel_um = lx.max(ly) / PREVIEW_PIXELS;
    let pixels_along = |extent_um: f64| (extent_um / preview_pixel_um).round().max(1.0) as usize;
    let (width, height) = (pixels_along(lx), pixels_along(ly));
    let (nx, ny) = field.size();
    let (lowest, highest) = field.range_um();
    let scale = if highest > lowest { 255.0 / (highest - lowest) } else { 0.0 };
    let mut greys = Vec::with_capacity(width * height);
    for row in 0..height {
        // Rows of the picture go down, rows of the field go up.
        let iy = ny - 1 - row * ny / height;
        for column in 0..width {
            let h = field.heights_um()[[iy, column * nx / width]];
            greys.push(((h - lowest) * scale).round() as u8);
        }
    }
    encode::png((width, height), png::ColorType::Grayscale, &greys)
}
