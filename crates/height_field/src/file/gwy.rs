//! Gwyddion's own files (`.gwy`): a tree of serialised objects, of which data fields, their titles and masks are read.
//!
//! After the magic bytes `GWYP` the file holds one object, a container. An object is the name of its type, the length
//! of its body (u32), and the body. A body is a sequence of components: each a name, a letter for the type of the
//! value, and the value. Names end with NUL; numbers are little-endian. Bodies of objects that are not needed are
//! skipped as bytes, so that deep nesting costs no stack.

use super::bytes::{Bytes, Number, data_length};
use super::channel::{self, Channel};
use super::raw::FirstRow;
use super::units::micrometres;
use super::{Meaning, Parsed, Raw, encoding};
use ndarray::Array2;
use std::collections::BTreeMap;

/// First bytes of a file.
const MAGIC: &[u8] = b"GWYP";

/// A serialised object: its type and the bytes of its components.
#[derive(Clone, Copy)]
struct Object<'a> {
    /// Name of the type, without its NUL.
    type_name: &'a [u8],
    /// Bytes of all components.
    body: &'a [u8],
}

/// The value of a component; types that are not needed are [`Value::Other`].
#[derive(Clone, Copy)]
enum Value<'a> {
    Integer(i32),
    Double(f64),
    /// Text without its NUL.
    String(&'a [u8]),
    Object(Object<'a>),
    /// Bytes of an array of 64-bit floats.
    Doubles(&'a [u8]),
    /// A skipped value.
    Other,
}

impl<'a> Object<'a> {
    /// Reads type name, length and body.
    fn read(bytes: &mut Bytes<'a>) -> Result<Self, String> {
        let type_name = bytes.string()?;
        let length = bytes.u32()? as usize;
        Ok(Self { type_name, body: bytes.take(length)? })
    }

    /// Calls `visit` with the name and value of every component.
    fn components(&self, mut visit: impl FnMut(&'a [u8], Value<'a>) -> Result<(), String>) -> Result<(), String> {
        let mut bytes = Bytes::new(self.body);
        while !bytes.is_empty() {
            let name = bytes.string()?;
            let value = read_value(&mut bytes)?;
            visit(name, value)?;
        }
        Ok(())
    }
}

/// Reads the type letter and the value of a component.
///
/// Letters are `b` (boolean, one byte), `c` (character), `i` (i32), `q` (i64), `d` (f64), `s` (string) and `o`
/// (object). Capitals are arrays of these types, which begin with their length (u32).
fn read_value<'a>(bytes: &mut Bytes<'a>) -> Result<Value<'a>, String> {
    let letter = bytes.u8()?;
    let mut skip = |size: usize| bytes.take(size).map(|_| Value::Other);
    match letter {
        b'b' | b'c' => skip(1),
        b'q' => skip(8),
        b'i' => Ok(Value::Integer(bytes.i32()?)),
        b'd' => Ok(Value::Double(bytes.f64()?)),
        b's' => Ok(Value::String(bytes.string()?)),
        b'o' => Ok(Value::Object(Object::read(bytes)?)),
        b'C' | b'I' | b'Q' | b'D' | b'S' | b'O' => {
            let count = bytes.u32()? as usize;
            // The bytes of an array whose elements have `size` bytes each.
            let mut array = |size: usize| bytes.take(count.checked_mul(size).ok_or("an array is too long")?);
            match letter {
                b'C' => array(1).map(|_| Value::Other),
                b'I' => array(4).map(|_| Value::Other),
                b'Q' => array(8).map(|_| Value::Other),
                b'D' => array(8).map(Value::Doubles),
                // A count that is too large causes an error at the end of the bytes.
                b'S' => (0..count).try_for_each(|_| bytes.string().map(|_| ())).map(|()| Value::Other),
                // The letter is `O`.
                _ => (0..count).try_for_each(|_| Object::read(bytes).map(|_| ())).map(|()| Value::Other),
            }
        }
        _ => Err(format!("a component is of the unknown type {:?}", char::from(letter))),
    }
}

/// A `GwyDataField`: values on a regular grid.
#[derive(Default)]
struct DataField<'a> {
    /// Points along x and y.
    size: (usize, usize),
    /// Extent along x and y in `unit_xy`.
    extent: (f64, f64),
    /// Unit of x and y; empty without one.
    unit_xy: String,
    /// Unit of the values; empty without one.
    unit_z: String,
    /// 64-bit floats from the top row on.
    data: &'a [u8],
}

impl<'a> DataField<'a> {
    /// Reads the components of a `GwyDataField`.
    ///
    /// # Errors
    /// An object of another type, or values that do not fit the numbers of points.
    fn read(object: Object<'a>) -> Result<Self, String> {
        if object.type_name != b"GwyDataField" {
            let found = String::from_utf8_lossy(object.type_name);
            return Err(format!("a channel is a \"{found}\", not a \"GwyDataField\""));
        }
        let mut field = Self::default();
        object.components(|name, value| {
            match (name, value) {
                // A negative count becomes 0, which `data_length` refuses.
                (b"xres", Value::Integer(count)) => field.size.0 = usize::try_from(count).unwrap_or(0),
                (b"yres", Value::Integer(count)) => field.size.1 = usize::try_from(count).unwrap_or(0),
                (b"xreal", Value::Double(length)) => field.extent.0 = length,
                (b"yreal", Value::Double(length)) => field.extent.1 = length,
                (b"si_unit_xy", Value::Object(unit)) => field.unit_xy = unit_name(unit)?,
                (b"si_unit_z", Value::Object(unit)) => field.unit_z = unit_name(unit)?,
                (b"data", Value::Doubles(data)) => field.data = data,
                _ => {}
            }
            Ok(())
        })?;
        let (nx, ny) = field.size;
        let length = data_length(nx, ny, Number::F64)?;
        if field.data.len() != length {
            let found = field.data.len() / 8;
            return Err(format!("a channel of {nx} × {ny} points holds {found} values"));
        }
        Ok(field)
    }
}

/// The text of a `GwySIUnit`.
fn unit_name(unit: Object) -> Result<String, String> {
    let mut name = String::new();
    unit.components(|key, value| {
        if let (b"unitstr", Value::String(text)) = (key, value) {
            name = encoding::utf8_or_latin1(text).trim().to_owned();
        }
        Ok(())
    })?;
    Ok(name)
}

/// Components of the container that belong to channel N.
#[derive(Default)]
struct Entry<'a> {
    /// `/N/data/title`.
    title: String,
    /// `/N/data`, the heights or other values.
    data: Option<Object<'a>>,
    /// `/N/mask`, positive at masked points.
    mask: Option<Object<'a>>,
}

/// Entries of a container by channel number. An entry without data is not a channel.
fn entries(container: Object) -> Result<BTreeMap<usize, Entry>, String> {
    let mut entries = BTreeMap::<usize, Entry>::new();
    container.components(|name, value| {
        let Some((number, key)) = std::str::from_utf8(name)
            .ok()
            .and_then(|name| name.strip_prefix('/')?.split_once('/'))
            .and_then(|(number, key)| Some((number.parse().ok()?, key)))
        else {
            return Ok(());
        };
        match (key, value) {
            ("data", Value::Object(object)) => entries.entry(number).or_default().data = Some(object),
            ("mask", Value::Object(object)) => entries.entry(number).or_default().mask = Some(object),
            ("data/title", Value::String(title)) => {
                entries.entry(number).or_default().title = encoding::utf8_or_latin1(title).trim().to_owned();
            }
            _ => {}
        }
        Ok(())
    })?;
    Ok(entries)
}

/// Reads the channel that `channel_option` names (number or title), or the default one of [`channel::choose`].
pub(super) fn parse(bytes: &[u8], channel_option: Option<&str>) -> Parsed {
    let mut body = Bytes::new(bytes.strip_prefix(MAGIC).ok_or("it does not begin with \"GWYP\"")?);
    let container = Object::read(&mut body)?;
    if container.type_name != b"GwyContainer" {
        return Err("it holds no \"GwyContainer\"".to_owned());
    }
    // Data field and mask (if any) of each channel, in the order of `channels`. All are read, since the choice
    // depends on the unit of each channel.
    let mut fields = Vec::new();
    let mut channels = Vec::new();
    for (number, entry) in entries(container)? {
        let Some(object) = entry.data else { continue };
        let field = DataField::read(object)?;
        channels.push(Channel::new(number, entry.title, field.unit_z.clone()));
        fields.push((field, entry.mask));
    }
    let chosen = channel::choose(&channels, channel_option)?;
    let (field, mask) = &fields[chosen];
    let (nx, ny) = field.size;
    let meaning = if field.unit_z.is_empty() {
        Meaning::Unknown
    } else {
        Meaning::in_unit(&field.unit_z, micrometres(&field.unit_z)?)
    };
    let mut values = Number::F64.decode(field.data);
    if let Some(mask) = mask {
        let mask = DataField::read(*mask)?;
        if mask.size != field.size {
            return Err(format!("the mask has {} × {} points, the channel {nx} × {ny}", mask.size.0, mask.size.1));
        }
        // Masked points count as missing, although a mask may mark anything, such as grains.
        for (value, masked) in values.iter_mut().zip(Number::F64.decode(mask.data)) {
            if masked > 0.0 {
                *value = f64::NAN;
            }
        }
    }
    // A missing length leaves an extent of 0, which `Raw::check` refuses.
    let pixel_um = if field.unit_xy.is_empty() {
        None
    } else {
        let unit_um = micrometres(&field.unit_xy)?;
        Some((field.extent.0 * unit_um / nx as f64, field.extent.1 * unit_um / ny as f64))
    };
    let values = Array2::from_shape_vec((ny, nx), values).map_err(|error| error.to_string())?;
    Ok(Raw::new(values, meaning, FirstRow::Top).pixel(pixel_um).channel(channels[chosen].name(), channel_option))
}
