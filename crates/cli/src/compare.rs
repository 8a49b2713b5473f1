use super::output::{Output, output};
use super::{Outcome, encode, print_json};
use crate::comparison::{Figures, Mask, Picture, compare};
use serde::Serialize;
use std::path::PathBuf;

/// Compare two pictures: RMSE, relative MSE, PSNR, CIEDE2000, FLIP
///
/// Both are linear sRGB in the channels R, G and B of an OpenEXR file; the first is the reference. rmse and
/// relative_mse are of the radiance itself, relative_mse the mean of (b−a)²/(a²+ε²) with ε 1 % of the mean of |a|. The
/// other figures are of the pictures as shown, 2^exposure times brighter and clipped to [0, 1]: psnr_db with sRGB
/// encoding and the peak 1 (null where they are equal), delta_e_2000, and flip at 67 pixels per degree. A p99 is the
/// smallest value that 99 % of the pixels do not exceed. Prints the figures as JSON.
#[derive(clap::Args)]
pub struct CompareArgs {
    /// The reference (.exr)
    a: PathBuf,
    /// What is compared with it (.exr)
    b: PathBuf,
    /// Write a picture of three side by side: a and b as shown, and FLIP's map, black where they look alike (.png)
    #[arg(long, value_name = "FILE", value_parser = output(&["png"]))]
    png: Option<Output>,
    /// Brighten both for the figures of what is seen [default: so that 1 % of a's pixels are clipped]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true)]
    exposure: Option<f64>,
    /// Compare only where this picture is above 0 in some channel; elsewhere both count as black (.exr, .png)
    #[arg(long, value_name = "FILE")]
    mask: Option<PathBuf>,
}

#[derive(Serialize)]
struct Report<'a> {
    a: &'a PathBuf,
    b: &'a PathBuf,
    #[serde(skip_serializing_if = "Option::is_none")]
    mask: &'a Option<PathBuf>,
    #[serde(skip_serializing_if = "Option::is_none")]
    png: &'a Option<Output>,
    size: (usize, usize),
    /// Compared ones.
    pixels: usize,
    exposure_stops: f64,
    #[serde(flatten)]
    figures: Figures,
}

/// Runs `sunbeam compare`.
pub fn run(args: &CompareArgs) -> Outcome {
    let (a, b) = (Picture::read_exr(&args.a)?, Picture::read_exr(&args.b)?);
    let mask = args.mask.as_ref().map(Mask::read).transpose()?;
    let found = compare(&a, &b, mask.as_ref(), args.exposure)?;
    if let Some(file) = &args.png {
        let (size, bytes) = found.shown.sheet(&found.flip_map);
        file.write(&encode::png(size, png::ColorType::Rgb, &bytes)?)?;
    }
    print_json(&Report {
        a: &args.a,
        b: &args.b,
        mask: &args.mask,
        png: &args.png,
        size: a.size(),
        pixels: found.pixels,
        exposure_stops: found.exposure_stops,
        figures: found.figures,
    })
}
