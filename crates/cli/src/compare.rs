//! `sunbeam compare`: differences of two pictures.

use super::output::{Output, output};
use super::{Outcome, encode, print_json};
use crate::comparison::{Figures, Mask, Picture, compare};
use serde::Serialize;
use std::path::PathBuf;

/// Compare two pictures: RMSE, relative MSE, PSNR, CIEDE2000, FLIP
///
/// Both pictures are linear sRGB in the channels R, G and B of an OpenEXR file. The first is the reference. Prints the
/// figures as JSON.
///
/// rmse and relative_mse compare radiance; relative_mse is the mean of (b−a)²/(a²+ε²), where ε is 1 % of the mean of
/// |a|. The other figures compare the pictures as shown, multiplied by 2^exposure and clipped to [0, 1]: psnr_db with
/// sRGB encoding and the peak 1 (null for equal pictures), delta_e_2000, and flip at 67 pixels per degree. A p99 is the
/// smallest value that 99 % of the pixels do not exceed.
#[derive(clap::Args)]
pub(crate) struct CompareArgs {
    /// Reference picture (.exr)
    a: PathBuf,
    /// Picture that is compared with the reference (.exr)
    b: PathBuf,
    /// File for a picture with a, b and FLIP's map side by side; the map is black where a and b look alike (.png)
    #[arg(long, value_name = "FILE", value_parser = output(&["png"]))]
    png: Option<Output>,
    /// Exposure of the pictures as shown, in stops [default: the exposure that clips 1 % of a's pixels that are not
    /// black]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true)]
    exposure: Option<f64>,
    /// Picture of the pixels to compare, those above 0 in any channel; a and b count as black elsewhere (.exr, .png)
    #[arg(long, value_name = "FILE")]
    mask: Option<PathBuf>,
}

/// The JSON object that the command prints. Paths are those of the arguments.
#[derive(Serialize)]
struct Report<'a> {
    a: &'a PathBuf,
    b: &'a PathBuf,
    #[serde(skip_serializing_if = "Option::is_none")]
    mask: &'a Option<PathBuf>,
    #[serde(skip_serializing_if = "Option::is_none")]
    png: &'a Option<Output>,
    /// Width and height in pixels.
    size: (usize, usize),
    /// Number of compared pixels.
    pixels: usize,
    /// Exposure of the pictures as shown: the given one or the default.
    exposure_stops: f64,
    /// The figures of the compared pixels. The other pixels count as black, since FLIP's filters would carry their
    /// colours into the mask.
    #[serde(flatten)]
    figures: Figures,
}

/// Runs `sunbeam compare`.
pub(crate) fn run(args: &CompareArgs) -> Outcome {
    let (a, b) = (Picture::read_exr(&args.a)?, Picture::read_exr(&args.b)?);
    let mask = args.mask.as_ref().map(Mask::read).transpose()?;
    let found = compare(&a, &b, mask.as_ref(), args.exposure)?;
    if let Some(file) = &args.png {
        // Size and 8-bit sRGB bytes of the three pictures side by side.
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
