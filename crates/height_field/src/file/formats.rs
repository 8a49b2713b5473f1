//! Descriptions of all readable formats: how each stores unit, size, orientation, channels and missing points.

use super::{Parsed, exr, gsf, gwy, nanoscope, npy, png, sdf, text, tiff, x3p};

/// Extensions of [`FORMATS`], for messages. A test checks that none is missing.
pub const READABLE: &str =
    ".exr, .png, .gsf, .npy, .txt, .asc, .csv, .dat, .grd, .xyz, .tif, .tiff, .gwy, .sdf, .x3p, .spm, .000 to .999";

/// Description of a format of height fields.
///
/// Texts are cells of the table in docs/height-fields.md, and therefore short: "without, …" means "if the file has
/// none". Options of the reader and names in files are in backticks. An empty text is printed as a dash.
///
/// ```
/// use sunbeam_height_field::FORMATS;
///
/// let gwyddion = FORMATS.iter().find(|format| format.extensions.contains(&"gwy")).unwrap();
/// assert_eq!((gwyddion.name, gwyddion.first_row), ("Gwyddion", "top"));
/// ```
pub struct Format {
    /// Name in messages.
    pub name: &'static str,
    /// Extensions in lower case, without the dot; `000` stands for every number of three digits.
    pub extensions: &'static [&'static str],
    /// Readable contents.
    pub contents: &'static str,
    /// Place of the heights' unit in the file. "Up to" gives the height of the largest sample that the type can hold.
    pub unit: &'static str,
    /// Place of the pixel size in the file.
    pub size: &'static str,
    /// First row of the file: the top (largest y), the bottom, or "by y" for points, which have coordinates.
    pub first_row: &'static str,
    /// Choice of a channel: its numbering, or "one" for a single channel.
    pub channels: &'static str,
    /// Marks of missing points, in addition to NaN, magnitudes from 1e30 on and isolated numbers (`src/isolated.rs`).
    pub holes: &'static str,
    /// Refused variants, and ignored contents.
    pub not_read: &'static str,
    /// Parser of a file's bytes. Its second argument is the option `channel`.
    pub(super) parse: fn(&[u8], Option<&str>) -> Parsed,
}

/// Every format that [`HeightField::read`](crate::HeightField::read) reads.
pub const FORMATS: &[Format] = &[
    Format {
        name: "Gwyddion",
        extensions: &["gwy"],
        contents: "Gwyddion's own files",
        unit: "the channel's; without, `max_height`",
        size: "the channel's extent; without a unit, `pixel_size`",
        first_row: "top",
        channels: "Gwyddion's number, or title",
        holes: "the channel's mask",
        not_read: "volumes, graphs",
        parse: gwy::parse,
    },
    Format {
        name: "Gwyddion simple field",
        extensions: &["gsf"],
        contents: "Gwyddion simple fields",
        unit: "`ZUnits`; without, `max_height`",
        size: "`XReal`, `YReal` in `XYUnits`; without, `pixel_size`",
        first_row: "top",
        channels: "one",
        holes: "",
        not_read: "",
        parse: gsf::parse,
    },
    Format {
        name: "Nanoscope",
        extensions: &["spm", "000"],
        contents: "Bruker (Veeco, DI) NanoScope from version 4.3 on, images of 16 and 32 bits",
        unit: "`Z scale` and the sensitivity that it names",
        size: "`Scan Size`, with `Aspect Ratio`; `pixel_size` if these are ambiguous",
        first_row: "bottom",
        channels: "place from 1, or title",
        holes: "",
        not_read: "earlier versions, force curves",
        parse: nanoscope::parse,
    },
    Format {
        name: "surface data file",
        extensions: &["sdf"],
        contents: "ISO 25178-71 versions 1.0 and 2.0, BCR-1.0; text and binary, all eight types of data",
        unit: "`Zscale`",
        size: "`Xscale`, `Yscale`",
        first_row: "bottom; BCR: top",
        channels: "one",
        holes: "`BAD`, the reserved number of the type",
        not_read: "compressed or checksummed files",
        parse: sdf::parse,
    },
    Format {
        name: "X3P",
        extensions: &["x3p"],
        contents: "ISO 25178-72 (ISO 5436-2): regular grids, binary or in the XML, at the archive's top or in a folder",
        unit: "increment and offset of `CZ`, metres",
        size: "increments of `CX`, `CY`",
        first_row: "bottom",
        channels: "layer from 0",
        holes: "points that are not valid",
        not_read: "lists of points, axes of type A; MD5 sums and the rotation are ignored",
        parse: x3p::parse,
    },
    Format {
        name: "TIFF",
        extensions: &["tif", "tiff"],
        contents: "grey of 8, 16 and 32 bits, floats of 32 and 64 bits",
        unit: "floats in µm, integers up to `max_height`; ImageJ's calibration",
        size: "ImageJ's unit; the resolution tags; without, `pixel_size`",
        first_row: "top, or the tag `Orientation`",
        channels: "page from 0",
        holes: "the number of the tag `GDAL_NODATA`",
        not_read: "colours, palettes, Park Systems' private tags",
        parse: tiff::parse,
    },
    Format {
        name: "PNG",
        extensions: &["png"],
        contents: "grey of 8 and 16 bits",
        unit: "up to the text chunk `max_height_um`, or `max_height`",
        size: "text chunks `pixel_size_x_um`, `pixel_size_y_um`; `pHYs`; without, `pixel_size`",
        first_row: "top",
        channels: "one",
        holes: "",
        not_read: "colours, palettes",
        parse: png::parse,
    },
    Format {
        name: "OpenEXR",
        extensions: &["exr"],
        contents: "one channel of floats",
        unit: "µm",
        size: "attributes `pixelSizeX_um`, `pixelSizeY_um`; without, `pixel_size`",
        first_row: "top",
        channels: "one",
        holes: "",
        not_read: "several channels, integers",
        parse: exr::parse,
    },
    Format {
        name: "NumPy",
        extensions: &["npy"],
        contents: "a matrix of floats, or of unsigned integers of 8 or 16 bits",
        unit: "floats in µm, integers up to `max_height`",
        size: "`pixel_size`",
        first_row: "bottom",
        channels: "one",
        holes: "",
        not_read: "other types and numbers of dimensions",
        parse: npy::parse,
    },
    Format {
        name: "text",
        extensions: &["txt", "csv", "asc", "dat", "grd"],
        contents: "a matrix, one row a line, or points x, y, z: see [texts](#texts)",
        unit: "the header's; without, µm",
        size: "the header's or the points' spacing; without, `pixel_size`",
        first_row: "the program's; points: by y; otherwise bottom",
        channels: "columns of NanoScope's text, by place from 1 or title",
        holes: "empty cells, `nan`, `bad`, the header's number",
        not_read: "profiles, lists, binary grids",
        parse: text::parse,
    },
    Format {
        name: "XYZ text",
        extensions: &["xyz"],
        contents: "points x, y, z on a regular grid, in any order",
        unit: "the header's; without, µm",
        size: "the points' spacing",
        first_row: "by y",
        channels: "one",
        holes: "places of the grid without a point",
        not_read: "scattered points, more columns",
        parse: text::parse_points,
    },
];
