//! Meaning of the English keys in headers of texts.
//!
//! A key is split into words in lower case, which the lists below sort into kinds. [`role`] combines the kinds. `Pixel
//! width`, for example, is the distance between points along x, since `pixel width` is a size of pixels and `width` is
//! in the list [`X`]. SPIP and WSxM are programs for scanning-probe images; `samps` are NanoScope's samples (points).

/// Axis of a property; `Both` if the key names none or both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Along {
    X,
    Y,
    Both,
}

impl Along {
    /// Index of the axis in arrays of two; `None` for both axes.
    pub(super) fn axis(self) -> Option<usize> {
        match self {
            Self::X => Some(0),
            Self::Y => Some(1),
            Self::Both => None,
        }
    }
}

/// Property that a key stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// Extent of the field or number of points; the unit of the value decides.
    Size(Along),
    /// Distance between points.
    Step(Along),
    /// Unit of the heights.
    HeightUnit,
    /// Unit of x and y.
    LateralUnit,
    /// Height, with a unit, that a stored number of 1 stands for. In holograms it is the height of a radian of phase.
    HeightFactor,
    /// Range of the heights.
    HeightRange,
    /// Height in nm of a stored number of 1 (SPIP).
    NmPerValue,
    /// Name of the channel.
    Channel,
    /// Value that marks a missing point.
    NoData,
    /// Number of missing points (SPIP). If it is not 0, a mask of these points follows the data.
    MaskedPoints,
    /// Irrelevant for size, unit and orientation.
    Irrelevant,
    /// Unknown key.
    Unknown,
}

/// Words of keys that do not describe the field's size, even if their value is a length.
const IRRELEVANT: [&str; 71] = [
    "offset",
    "xoffset",
    "yoffset",
    "center",
    "centre",
    "origin",
    "corner",
    "xllcorner",
    "yllcorner",
    "xllcenter",
    "yllcenter",
    "rate",
    "speed",
    "scanspeed",
    "velocity",
    "tip",
    "radius",
    "stylus",
    "force",
    "load",
    "date",
    "time",
    "setpoint",
    "frequency",
    "gain",
    "bias",
    "position",
    "location",
    "diameter",
    "cutoff",
    "filter",
    "duration",
    "angle",
    "rotation",
    "cantilever",
    "spring",
    "serial",
    "version",
    "comment",
    "comments",
    "note",
    "memo",
    "description",
    "original",
    "file",
    "filename",
    "created",
    "software",
    "instrument",
    "operator",
    "objective",
    "magnification",
    "wavelength",
    "laser",
    "temperature",
    "humidity",
    "forcecurve",
    "max",
    "maximum",
    "min",
    "minimum",
    "mean",
    "rms",
    "roughness",
    "sa",
    "sq",
    "average",
    "peak",
    "valley",
    "median",
    "zmin",
];
/// Words for a unit.
const UNIT: [&str; 2] = ["unit", "units"];
/// Words for the x axis.
const X: [&str; 10] = ["x", "width", "columns", "cols", "ncols", "nx", "w", "samps", "col", "column"];
/// Words for the y axis.
const Y: [&str; 8] = ["y", "height", "rows", "nrows", "ny", "h", "lines", "row"];
/// Words for the distance between points.
const STEP: [&str; 13] = [
    "step",
    "spacing",
    "increment",
    "inc",
    "pitch",
    "pixelsize",
    "cellsize",
    "sampling",
    "interval",
    "delta",
    "dx",
    "dy",
    "stepsize",
];
/// Words for an extent or a number of points.
const SIZE: [&str; 26] = [
    "size",
    "length",
    "range",
    "extent",
    "dimension",
    "dimensions",
    "dim",
    "real",
    "scan",
    "area",
    "amplitude",
    "width",
    "height",
    "pixels",
    "pixel",
    "points",
    "resolution",
    "res",
    "columns",
    "cols",
    "ncols",
    "rows",
    "nrows",
    "lines",
    "samps",
    "fov",
];
/// Words for missing points.
const NO_DATA: [&str; 8] = ["nodata", "nodatavalue", "missing", "invalid", "void", "bad", "blank", "undefined"];
/// Words for the channel; `kanal` is German.
const CHANNEL: [&str; 5] = ["channel", "title", "signal", "name", "kanal"];

/// Words of a key in lower case. `X-Length` and `xlength` both give `x`, `length`.
fn words_of(key: &str) -> Vec<String> {
    let lower = key.to_lowercase();
    let spaced: String = lower.chars().map(|c| if "-_./:".contains(c) { ' ' } else { c }).collect();
    let mut words = Vec::new();
    for word in spaced.split_whitespace() {
        // The word that follows the letter of an axis without a blank, such as `length` in `xlength`.
        let glued = word
            .strip_prefix(['x', 'y', 'z'])
            .filter(|rest| SIZE.contains(rest) || STEP.contains(rest) || UNIT.contains(rest));
        match glued {
            Some(rest) => words.extend([word[..1].to_owned(), rest.to_owned()]),
            None => words.push(word.to_owned()),
        }
    }
    words
}

/// Role of a key, which has no comment sign. The first rule that applies decides.
pub(super) fn role(key: &str) -> Role {
    let words = words_of(key);
    let has = |accepted: &[&str]| words.iter().any(|word| accepted.contains(&word.as_str()));
    if words == ["bit2nm"] {
        return Role::NmPerValue;
    }
    if words == ["voidpixels"] {
        return Role::MaskedPoints;
    }
    if has(&["conversion"]) && has(&["factor"]) && has(&["height", "z"]) {
        return Role::HeightFactor;
    }
    if has(&NO_DATA) {
        return Role::NoData;
    }
    // `X Amplitude` is an extent in files of WSxM; an amplitude without an axis is not.
    if has(&IRRELEVANT) || words == ["amplitude"] {
        return Role::Irrelevant;
    }
    // `height` alone is a size along y.
    let is_vertical = has(&["z", "value", "values", "vertical"]) || (has(&["height"]) && has(&["range", "scale"]));
    if has(&UNIT) {
        let is_lateral = has(&["x", "y", "xy", "lateral", "horizontal", "pixel"]);
        return if is_lateral { Role::LateralUnit } else { Role::HeightUnit };
    }
    if is_vertical {
        return if has(&SIZE) || has(&["scale"]) { Role::HeightRange } else { Role::Unknown };
    }
    if has(&CHANNEL) {
        return Role::Channel;
    }
    let along = match (has(&X) || has(&["dx"]), has(&Y) || has(&["dy"])) {
        // `Samps/line`, a number of points along x, may also be `Samps/lines`, with words of both axes.
        (true, true) if has(&["samps"]) => Along::X,
        (true, false) => Along::X,
        (false, true) => Along::Y,
        _ => Along::Both,
    };
    let is_pixel_size = has(&["pixel", "cell"]) && has(&["size", "width", "height"]);
    if has(&STEP) || is_pixel_size {
        return Role::Step(along);
    }
    // A key of one word that names an axis, such as `h`, is a size.
    let is_size = has(&SIZE) || (along != Along::Both && words.len() == 1);
    if is_size { Role::Size(along) } else { Role::Unknown }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_many_programs_have_their_role() {
        use Along::{Both, X, Y};
        for (keys, expected) in [
            (
                &[
                    "Width",
                    "x-length",
                    "x-pixels",
                    "X Scan Size",
                    "ncols",
                    "w",
                    "Samps/line",
                    "xlength",
                    "Number of columns",
                ][..],
                Role::Size(X),
            ),
            (
                &["Height", "y-length", "Scan size Y", "nrows", "h", "Number of lines", "Data Height", "YPixels"],
                Role::Size(Y),
            ),
            (&["Scan Size", "Resolution", "scan area", "Pixels", "Image size"], Role::Size(Both)),
            (&["cellsize", "pixel size", "Pixel_size", "spacing"], Role::Step(Both)),
            (&["dx", "x step", "Pixel width"], Role::Step(X)),
            (&["Value units", "z-unit", "Units", "ZUnits", "Height unit", "Data unit"], Role::HeightUnit),
            (&["Lateral units", "x-unit", "XY units"], Role::LateralUnit),
            (&["Z Amplitude", "z range", "Z scale"], Role::HeightRange),
            (&["Channel", "Title", "Kanal"], Role::Channel),
            (&["NODATA_value", "Missing value"], Role::NoData),
            (&["x-offset", "xllcorner", "Scan rate", "Tip radius", "Original file", "scanspeed"], Role::Irrelevant),
            (&["Šířka", "Breite", "Foo"], Role::Unknown),
        ] {
            for key in keys {
                assert_eq!(role(key), expected, "{key}");
            }
        }
    }
}
