//! X3P of ISO 25178-72 (ISO 5436-2): a ZIP archive of an XML description, `main.xml`, and the heights as little-endian
//! numbers.
//!
//! Columns run along x and rows along y, from y = 0 on; all lengths are in metres. The axes are named CX, CY and CZ; CZ
//! is the axis of the heights. A file may hold several *layers*, maps of equal size. The archive's CRC is verified, the
//! MD5 checksums are not.

use super::bytes::{DEFLATE_RATIO_MAX, Number, data_length};
use super::channel::{self, Channel};
use super::raw::FirstRow;
use super::units::UM_PER_M;
use super::{Meaning, Parsed, Raw, encoding};
use crate::holes::known_or_nan;
use ndarray::Array2;
use roxmltree::{Document, Node};
use std::io::{Cursor, Read};
use zip::ZipArchive;

/// Name of the XML description in the archive.
const DESCRIPTION: &str = "main.xml";

/// The archive, and the folder in it that contains the description.
struct Archive<'a> {
    /// The ZIP archive.
    zip: ZipArchive<Cursor<&'a [u8]>>,
    /// Path of the folder with a slash at its end; empty for the top level.
    folder: String,
}

/// A name in an archive in normal form: with slashes, without a leading `./` or `/`.
fn normal_name(name: &str) -> String {
    name.replace('\\', "/").trim_start_matches("./").trim_start_matches('/').to_owned()
}

impl<'a> Archive<'a> {
    /// Opens the archive and finds `main.xml`, at the top level or in a folder.
    fn open(bytes: &'a [u8]) -> Result<Self, String> {
        let zip = ZipArchive::new(Cursor::new(bytes)).map_err(|error| error.to_string())?;
        let folders = zip.file_names().map(normal_name).filter_map(|name| {
            // Only ASCII letters are lowered, since others may change the length of the name.
            let folder_length = name.to_ascii_lowercase().strip_suffix(DESCRIPTION).map(str::len)?;
            let folder = &name[..folder_length];
            // macOS puts its own metadata into this folder, under the names of the archive's files.
            let is_hidden = name.starts_with("__MACOSX/");
            (!is_hidden && (folder.is_empty() || folder.ends_with('/'))).then(|| folder.to_owned())
        });
        // An archive may hold several descriptions. The one with the shortest path is read.
        let folder = folders.min_by_key(String::len).ok_or("its archive has no file \"main.xml\"")?;
        Ok(Self { zip, folder })
    }

    /// Index in the archive of a file by its path in the description's folder, in any case.
    fn index(&self, name: &str) -> Option<usize> {
        let wanted = format!("{}{}", self.folder, normal_name(name)).to_lowercase();
        let found = self.zip.file_names().find(|stored| normal_name(stored).to_lowercase() == wanted)?;
        self.zip.index_for_name(found)
    }
}

/// Unpacks a file of the archive. Its size must be `expected` bytes, if given.
fn unpack(archive: &mut Archive, name: &str, expected: Option<usize>) -> Result<Vec<u8>, String> {
    let at = archive.index(name).ok_or_else(|| format!("its archive has no file {name:?}"))?;
    let file = archive.zip.by_index(at).map_err(|error| format!("{name}: {error}"))?;
    let size = file.size();
    if expected.is_some_and(|expected| size != expected as u64) {
        return Err(format!("{name} is of {size} bytes, not the {} of its points", expected.unwrap_or_default()));
    }
    if size / DEFLATE_RATIO_MAX > file.compressed_size() {
        return Err(format!("{name} claims {size} bytes out of {} packed ones", file.compressed_size()));
    }
    let mut bytes = Vec::new();
    // One byte more than the size, since the CRC is verified only when a read meets the end.
    file.take(size.saturating_add(1)).read_to_end(&mut bytes).map_err(|error| format!("{name}: {error}"))?;
    if bytes.len() as u64 == size { Ok(bytes) } else { Err(format!("{name} does not have the {size} bytes it claims")) }
}

/// Descendant of `from` by a path of element names in any namespace; at each level the first child of the name.
fn find<'a, 'input>(from: Node<'a, 'input>, path: &[&str]) -> Option<Node<'a, 'input>> {
    path.iter().try_fold(from, |node, name| node.children().find(|child| child.tag_name().name() == *name))
}

/// Text of the element at a path; `None` where it is missing or empty.
fn text_at<'a>(from: Node<'a, '_>, path: &[&str]) -> Option<&'a str> {
    find(from, path).and_then(|node| node.text()).map(str::trim).filter(|text| !text.is_empty())
}

/// Number in the element at a path; `None` where it is missing or empty.
fn real(from: Node, path: &[&str]) -> Result<Option<f64>, String> {
    let Some(text) = text_at(from, path) else { return Ok(None) };
    text.parse().map(Some).map_err(|_| format!("{} is \"{text}\", not a number", path.join("/")))
}

/// Spacing in metres along the axis `CX` or `CY`.
fn increment(root: Node, axis: &str) -> Result<f64, String> {
    let base = ["Record1", "Axes", axis];
    let node = find(root, &base).ok_or_else(|| format!("it has no axis {axis}"))?;
    match text_at(node, &["AxisType"]) {
        // Incremental: equal steps. The other type, A (absolute), lists coordinates.
        Some("I") => {}
        found => {
            let found = found.unwrap_or("of no type");
            return Err(format!("axis {axis} is {found}: only regular grids, of axes of type I, are read"));
        }
    }
    real(node, &["Increment"])?.ok_or_else(|| format!("axis {axis} has no Increment"))
}

/// Number of points along one axis of the matrix: `SizeX`, `SizeY` or `SizeZ` (the number of layers).
fn count(root: Node, name: &str) -> Result<usize, String> {
    let found = text_at(root, &["Record3", "MatrixDimension", name]);
    found.and_then(|text| text.parse().ok()).filter(|count| *count > 0).ok_or_else(|| {
        format!("{name} is {}, not a positive count; lists of points are not read", found.unwrap_or("missing"))
    })
}

/// Points of all layers.
struct Points {
    /// Stored numbers, layer by layer.
    stored: Vec<f64>,
    /// One bit for each point, set at valid ones, from the lowest bit of each byte on; `None` if all are valid.
    valid: Option<Vec<u8>>,
}

impl Points {
    /// Reads the points from the archive's files, or from the XML itself. The file of heights must have `all_bytes`
    /// bytes.
    fn read(archive: &mut Archive, root: Node, number: Number, all_bytes: usize) -> Result<Self, String> {
        let record = find(root, &["Record3"]).ok_or("it has no Record3")?;
        if let Some(link) = find(record, &["DataLink"]) {
            let name = text_at(link, &["PointDataLink"]).ok_or("DataLink names no file of heights")?;
            let stored = number.decode(&unpack(archive, name, Some(all_bytes))?);
            let valid = text_at(link, &["ValidPointsLink"]).map(|name| unpack(archive, name, None)).transpose()?;
            return Ok(Self { stored, valid });
        }
        let list = find(record, &["DataList"]).ok_or("it has neither DataLink nor DataList")?;
        Ok(Self { stored: listed_heights(list)?, valid: None })
    }
}

/// Reads the layer that `channel_option` names (its number from 0), or the first one.
pub(super) fn parse(bytes: &[u8], channel_option: Option<&str>) -> Parsed {
    let mut archive = Archive::open(bytes)?;
    let xml = encoding::text(&unpack(&mut archive, DESCRIPTION, None)?)?;
    let document = Document::parse(&xml).map_err(|error| format!("main.xml: {error}"))?;
    let root = document.root_element();
    let (nx, ny, nz) = (count(root, "SizeX")?, count(root, "SizeY")?, count(root, "SizeZ")?);
    let dx_m = increment(root, "CX")?;
    // The description of a single profile may omit the y axis or its increment.
    let dy_m = if ny == 1 { increment(root, "CY").unwrap_or(dx_m) } else { increment(root, "CY")? };
    let axis = find(root, &["Record1", "Axes", "CZ"]).ok_or("it has no axis CZ")?;
    let number = match text_at(axis, &["DataType"]) {
        Some("I") => Number::I16,
        Some("L") => Number::I32,
        Some("F") => Number::F32,
        Some("D") => Number::F64,
        found => return Err(format!("its heights are of type {}; I, L, F and D are read", found.unwrap_or("unknown"))),
    };
    // Height in metres = offset + scale · stored number. Without both, the stored numbers are heights in metres.
    let scale_m = real(axis, &["Increment"])?.unwrap_or(1.0);
    let offset_m = real(axis, &["Offset"])?.unwrap_or(0.0);

    // Bytes and points of one layer, and bytes of all layers.
    let layer_bytes = data_length(nx, ny, number)?;
    let layer_points = layer_bytes / number.size();
    let all_bytes = layer_bytes.checked_mul(nz).ok_or("its size is too large")?;
    let Points { stored, valid } = Points::read(&mut archive, root, number, all_bytes)?;
    if stored.len() != layer_points * nz {
        return Err(format!("{nx} × {ny} × {nz} points are promised, but {} follow", stored.len()));
    }
    if let Some(valid) = valid.as_ref().filter(|valid| valid.len() < stored.len().div_ceil(8)) {
        return Err(format!("{} valid points need more than {} bytes", stored.len(), valid.len()));
    }

    let layers: Vec<Channel> = (0..nz).map(|layer| Channel::new(layer, String::new(), "m".to_owned())).collect();
    let layer = channel::choose(&layers, channel_option)?;
    // Indices of the layer's points among those of all layers.
    let indices = layer * layer_points..(layer + 1) * layer_points;
    let is_valid = |i: usize| valid.as_ref().is_none_or(|bits| bits[i / 8] >> (i % 8) & 1 == 1);
    // Infinite and huge numbers mark missing points, too.
    let height_m = |i: usize| if is_valid(i) { known_or_nan(stored[i]) * scale_m + offset_m } else { f64::NAN };
    let heights = indices.map(height_m);
    let values = Array2::from_shape_vec((ny, nx), heights.collect()).map_err(|error| error.to_string())?;
    let pixel_um = Some((dx_m * UM_PER_M, dy_m * UM_PER_M));
    let raw = Raw::new(values, Meaning::in_unit("m", UM_PER_M), FirstRow::Bottom).pixel(pixel_um);
    Ok(if nz > 1 { raw.channel(layer.to_string(), channel_option) } else { raw })
}

/// Heights written in the XML itself, as `z` or `x;y;z`. Empty elements are missing points.
fn listed_heights(list: Node) -> Result<Vec<f64>, String> {
    let datums = list.children().filter(|child| child.tag_name().name() == "Datum");
    datums
        .map(|datum| match datum.text().map(str::trim).filter(|text| !text.is_empty()) {
            None => Ok(f64::NAN),
            Some(text) => {
                let last = text.rsplit(';').next().unwrap_or_default().trim();
                last.parse().map_err(|_| format!("\"{text}\" among the heights is not a number"))
            }
        })
        .collect()
}
