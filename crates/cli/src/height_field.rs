use super::encode;
use super::output::{Output, output};
use super::progress::{BUILDING, with_bar};
use super::surface_args::SurfaceArgs;
use super::term::Term;
use super::{Outcome, print_json};
use clap::builder::RangedU64ValueParser;
use serde::Serialize;
use std::error::Error;
use std::f64::consts::TAU;
use sunbeam::cache::Origin;
use sunbeam::config::Theory;
use sunbeam::grating::{GratingReport, profile_of};
use sunbeam::height_field::{HeightField, Provenance, Roughness, Seams, TileReport};
use sunbeam::lobe::SurfaceReport;
use sunbeam::methods::TERMS_MAX;
use sunbeam::scattering::SpectralIndex;
use sunbeam::table::Tiling;
use sunbeam::transform::{Periods, chebyshev_terms, periods};

/// Longer side of the preview, in pixels.
const PREVIEW_PIXELS: f64 = 512.0;
/// Shortest visible wavelength in µm, which needs the most terms.
const WAVELENGTH_UM: f64 = 0.38;

/// Describe a surface as JSON; fill, crop, level it, make it tile, and write it where asked to
///
/// In this order: missing points are filled (--fill), the rectangle is cut out (--crop), the heights are levelled (--level),
/// and the edges are blended (--make-tileable); the report is about what comes out. Periods are the strongest along each axis in
/// the power spectrum of the heights, with the direction of their waves in degrees from +x and their share of the variance. Seams
/// compare the step across the tile's edges with those between neighbours inside. chebyshev_terms is the number of transforms that
/// the phase screen needs for --tolerance at 380 nm and any angle, table_bytes_estimate the size of the table for the given
/// coherence length.
#[derive(clap::Args)]
pub struct HeightFieldArgs {
    #[command(flatten)]
    surface: SurfaceArgs,
    /// Keep the rectangle at X, Y from the lower left corner, all in µm
    #[arg(long, value_name = "X,Y,WIDTH,HEIGHT", value_parser = Rectangle::parse, allow_hyphen_values = true)]
    crop: Option<Rectangle>,
    /// Blend opposite edges into each other over so many µm, so that the tile repeats [default width: a tenth of each axis]
    #[arg(long, value_name = "WIDTH", num_args = 0..=1, require_equals = true)]
    make_tileable: Option<Option<f64>>,
    /// Write the heights: .exr (32-bit floats, µm), .gsf, .npy (64-bit floats, µm) or .png (16 bit)
    #[arg(short, long, value_name = "FILE", value_parser = output(&["exr", "gsf", "npy", "png"]))]
    output: Option<Output>,
    /// Write |DFT((h/H)ⁿ)| to --output instead, heights h about the middle of their range 2H: .png (logarithmic, five decades,
    /// order 0 in the middle) or .npy (64-bit floats)
    #[arg(long, value_name = "N", requires = "output", value_parser = RangedU64ValueParser::<usize>::new().range(1..=TERMS_MAX as u64))]
    term: Option<usize>,
    /// Write a grey picture, black the lowest height, +x right and +y up (.png)
    #[arg(long, value_name = "FILE", value_parser = output(&["png"]))]
    preview: Option<Output>,
    /// Build the tables and report their size, build time, measured error and mean albedo
    #[arg(long)]
    tables: bool,
}

/// A rectangle in µm from the lower left corner of a field.
#[derive(Clone, Copy)]
struct Rectangle {
    x: f64,
    y: f64,
    width: f64,
    height: f64,
}

impl Rectangle {
    fn parse(text: &str) -> Result<Self, String> {
        let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
        match numbers.as_deref() {
            Ok(&[x, y, width, height]) => Ok(Self { x, y, width, height }),
            _ => Err("four numbers in µm are needed: X,Y,WIDTH,HEIGHT".to_owned()),
        }
    }
}

#[derive(Serialize)]
struct Report<'a> {
    /// The channel that was read, of a file that can hold several.
    #[serde(skip_serializing_if = "Option::is_none")]
    channel: Option<String>,
    /// Points of the file without a height, which were filled.
    #[serde(skip_serializing_if = "Option::is_none")]
    filled_points: Option<usize>,
    /// Origin of the file's size, unit, orientation, channel and holes.
    #[serde(skip_serializing_if = "Option::is_none")]
    provenance: Option<Provenance>,
    /// Properties that no relief has.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    doubts: Vec<String>,
    /// Pixels along x and y.
    pixels: [usize; 2],
    pixel_um: [f64; 2],
    extent_um: [f64; 2],
    /// Lowest and highest height.
    range_um: [f64; 2],
    peak_to_valley_um: f64,
    mean_um: f64,
    rms_um: f64,
    /// Along x and y, dimensionless.
    rms_slope: [f64; 2],
    roughness: Roughness,
    periods: Periods,
    seams: Seams,
    #[serde(skip_serializing_if = "Option::is_none")]
    made_tileable: Option<TileReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    term: Option<Term>,
    chebyshev_terms: usize,
    table_bytes_estimate: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    tables: Option<Tables>,
    #[serde(skip_serializing_if = "Option::is_none")]
    output: &'a Option<Output>,
    #[serde(skip_serializing_if = "Option::is_none")]
    preview: &'a Option<Output>,
}

/// By either theory.
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
pub fn run(args: &HeightFieldArgs) -> Outcome {
    if let (Some(_), Some(file)) = (args.term, &args.output) {
        Term::check_output(file)?;
    }
    let mut config = args.surface.config()?;
    if args.make_tileable.is_some() {
        // What is made to repeat is described as what repeats.
        config.tiling.get_or_insert(Tiling::Periodic);
    }
    let read = config.raw_height_field()?;
    let cropped = match args.crop {
        Some(Rectangle { x, y, width, height }) => read.field.cropped(x, y, width, height)?,
        None => read.field,
    };
    let levelled = cropped.levelled(config.level());
    let (field, made_tileable) = match args.make_tileable {
        Some(width) => levelled.made_tileable(width).map(|(field, report)| (field, Some(report)))?,
        None => (levelled, None),
    };
    let term = args.term.map(|n| Term::new(&field, n));
    match (&args.output, &term) {
        (Some(file), Some(term)) => file.write(&term.encoded(file)?)?,
        (Some(file), None) => field.write(file.path())?,
        (None, _) => {}
    }
    if let Some(file) = &args.preview {
        file.write(&preview_png(&field)?)?;
    }
    let options = config.options();
    let tables = if args.tables {
        let cache = args.surface.cache()?;
        Some(match config.theory {
            Theory::Scalar => {
                let (surface, origin) = with_bar(BUILDING, |progress| cache.surface(&field, &options, progress))?;
                Tables::Scalar { origin, report: surface.report().clone() }
            }
            Theory::Rigorous => {
                let index = config.index().map(SpectralIndex::Constant);
                // A preset's own profile, unless something else became of its heights.
                let changed = args.crop.is_some() || args.make_tileable.is_some();
                let profile = if changed { profile_of(&field, config.tolerance)? } else { config.profile()? };
                let (length_um, limit) = (config.coherence_length, config.build_limit);
                let built = with_bar(BUILDING, |progress| {
                    cache.shared_grating(&profile, index.as_ref(), length_um, limit, progress)
                })?;
                Tables::Rigorous { origin: built.1.clone(), report: *built.0.report() }
            }
        })
    } else {
        None
    };
    let kappa_h = TAU * 2.0 / WAVELENGTH_UM * 0.5 * field.peak_to_valley_um();
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
        table_bytes_estimate: options.demand(&field).table_bytes() as usize,
        tables,
        output: &args.output,
        preview: &args.preview,
    })
}

/// The tile in its true proportions, sampled at the nearest pixels.
fn preview_png(field: &HeightField) -> Result<Vec<u8>, Box<dyn Error>> {
    let (lx, ly) = field.extent_um();
    let edge = lx.max(ly) / PREVIEW_PIXELS;
    let (width, height) = ((lx / edge).round().max(1.0) as usize, (ly / edge).round().max(1.0) as usize);
    let (nx, ny) = field.size();
    let (lowest, highest) = field.range_um();
    let scale = if highest > lowest { 255.0 / (highest - lowest) } else { 0.0 };
    let mut pixels = Vec::with_capacity(width * height);
    for row in 0..height {
        let iy = ny - 1 - row * ny / height;
        for column in 0..width {
            let h = field.heights_um()[[iy, column * nx / width]];
            pixels.push(((h - lowest) * scale).round() as u8);
        }
    }
    encode::png((width, height), png::ColorType::Grayscale, &pixels)
}
