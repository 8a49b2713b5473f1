//! Reader of little-endian numbers from bytes. Reading beyond the end is an error.

/// Upper bound on the compression ratio of Deflate (1032), with a margin for headers. It bounds the memory for a
/// damaged file.
pub(super) const DEFLATE_RATIO_MAX: u64 = 1040;

/// Reader that holds the unread rest of a file's bytes. Every method that returns bytes or a number advances it.
///
/// # Errors
/// Methods with a `Result` return an error if too few bytes are left.
#[derive(Clone, Copy)]
pub(super) struct Bytes<'a> {
    rest: &'a [u8],
}

impl<'a> Bytes<'a> {
    /// A reader from the first byte on.
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    /// Whether all bytes have been read.
    pub(super) fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    /// The next `count` bytes.
    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self
            .rest
            .split_at_checked(count)
            .ok_or_else(|| format!("it ends early: {count} bytes are wanted, {} are left", self.rest.len()))?;
        self.rest = rest;
        Ok(taken)
    }

    /// All remaining bytes.
    pub(super) fn take_all(&mut self) -> &'a [u8] {
        std::mem::take(&mut self.rest)
    }

    /// The next N bytes.
    fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    /// The next byte.
    pub(super) fn u8(&mut self) -> Result<u8, String> {
        Ok(self.array::<1>()?[0])
    }

    /// The next two bytes as an unsigned integer.
    pub(super) fn u16(&mut self) -> Result<u16, String> {
        Ok(u16::from_le_bytes(self.array()?))
    }

    /// The next four bytes as an unsigned integer.
    pub(super) fn u32(&mut self) -> Result<u32, String> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    /// The next four bytes as a signed integer.
    pub(super) fn i32(&mut self) -> Result<i32, String> {
        Ok(i32::from_le_bytes(self.array()?))
    }

    /// The next eight bytes as a float.
    pub(super) fn f64(&mut self) -> Result<f64, String> {
        Ok(f64::from_le_bytes(self.array()?))
    }

    /// The bytes up to the next NUL, which is skipped.
    pub(super) fn string(&mut self) -> Result<&'a [u8], String> {
        let end = self.rest.iter().position(|b| *b == 0).ok_or("it ends within a string")?;
        let string = &self.rest[..end];
        self.rest = &self.rest[end + 1..];
        Ok(string)
    }
}

/// Type of stored heights: little-endian unsigned (`U`) or signed (`I`) integers or floats (`F`), with the number of
/// bits in the name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    U8,
    U16,
    U32,
    I8,
    I16,
    I32,
    F32,
    F64,
}

impl Number {
    /// Size of one number in bytes.
    pub(super) const fn size(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// All numbers in `bytes` as 64-bit floats. An incomplete number at the end is ignored.
    pub(super) fn decode(self, bytes: &[u8]) -> Vec<f64> {
        /// Converts every N bytes to a number.
        fn all<const N: usize>(bytes: &[u8], convert: impl Fn([u8; N]) -> f64) -> Vec<f64> {
            bytes.chunks_exact(N).filter_map(|chunk| chunk.try_into().ok()).map(convert).collect()
        }
        match self {
            Self::U8 => all(bytes, |b: [u8; 1]| f64::from(b[0])),
            Self::I8 => all(bytes, |b: [u8; 1]| f64::from(b[0] as i8)),
            Self::U16 => all(bytes, |b| f64::from(u16::from_le_bytes(b))),
            Self::I16 => all(bytes, |b| f64::from(i16::from_le_bytes(b))),
            Self::U32 => all(bytes, |b| f64::from(u32::from_le_bytes(b))),
            Self::I32 => all(bytes, |b| f64::from(i32::from_le_bytes(b))),
            Self::F32 => all(bytes, |b| f64::from(f32::from_le_bytes(b))),
            Self::F64 => all(bytes, f64::from_le_bytes),
        }
    }
}

/// Size of `nx × ny` numbers in bytes.
///
/// # Errors
/// A count of 0, or a size that does not fit into a `usize`.
pub(super) fn data_length(nx: usize, ny: usize, number: Number) -> Result<usize, String> {
    if nx == 0 || ny == 0 {
        return Err(format!("its size is {nx} × {ny}; at least one point is needed"));
    }
    let length = nx.checked_mul(ny).and_then(|points| points.checked_mul(number.size()));
    length.ok_or_else(|| format!("its size {nx} × {ny} is too large"))
}
