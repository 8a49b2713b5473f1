//! Realtime methods as bytes, by which the worker that builds a method passes it to the worker that draws.

use crate::error::WebError;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use sunbeam::methods::{AnswerKind, Method, MethodShader};

/// A method for the GPU (its [`MethodShader`]), read from bytes. A *method* computes the reflectance of a relief; its
/// shader has WGSL sources and the contents of a uniform buffer and of storage buffers.
///
/// The bytes are the length of the header (`u32`, little-endian), the header (JSON), the uniform buffer, and the
/// storage buffers, without gaps.
pub struct MethodData {
    /// All bytes, with the header.
    bytes: Vec<u8>,
    header: Header,
    /// Position of the uniform buffer, the first byte after the header.
    uniform_start: usize,
}

/// Header of the bytes: the fields of a [`MethodShader`] with the lengths of its buffers instead of their contents, and
/// the kind of its answers.
#[derive(Serialize, Deserialize)]
struct Header {
    name: String,
    wgsl: Vec<String>,
    answers: AnswerKind,
    /// Length of the uniform buffer in bytes.
    uniform: usize,
    /// Lengths of the storage buffers in bytes.
    storage: Vec<usize>,
}

impl MethodData {
    /// Serialises a method.
    ///
    /// # Errors
    /// [`WebError::Internal`] if the header cannot be written as JSON or is 4 GiB or longer.
    pub fn to_bytes(method: &dyn Method) -> Result<Vec<u8>, WebError> {
        let shader = method.shader();
        let header = Header {
            name: shader.name.to_owned(),
            wgsl: shader.wgsl.iter().map(|&source| source.to_owned()).collect(),
            answers: method.answers(),
            uniform: shader.uniform.len(),
            storage: shader.storage.iter().map(|contents| contents.len()).collect(),
        };
        let header = serde_json::to_vec(&header).map_err(|error| WebError::Internal(error.to_string()))?;
        let length = u32::try_from(header.len()).map_err(|error| WebError::Internal(error.to_string()))?;
        let storage = shader.storage.iter().flat_map(|contents| contents.iter().copied());
        Ok(length.to_le_bytes().into_iter().chain(header).chain(shader.uniform).chain(storage).collect())
    }

    /// Reads the bytes of [`MethodData::to_bytes`].
    ///
    /// # Errors
    /// [`WebError::Internal`] for bytes with a malformed header or of another length than the header says.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, WebError> {
        let refused = || WebError::Internal("these bytes are not those of a method".to_owned());
        let length: [u8; 4] = bytes.get(..4).and_then(|word| word.try_into().ok()).ok_or_else(refused)?;
        // Saturates instead of wrapping where a `usize` has 32 bits.
        let uniform_start = (u32::from_le_bytes(length) as usize).saturating_add(4);
        let header = bytes.get(4..uniform_start).ok_or_else(refused)?;
        let header: Header = serde_json::from_slice(header).map_err(|_| refused())?;
        let buffers = header.storage.iter().try_fold(header.uniform, |sum, length| sum.checked_add(*length));
        if buffers.and_then(|buffers| buffers.checked_add(uniform_start)) != Some(bytes.len()) {
            return Err(refused());
        }
        Ok(Self { bytes, header, uniform_start })
    }

    /// The shader, for [`sunbeam_realtime::Shader::of_async`].
    pub fn shader(&self) -> MethodShader<'_> {
        let (uniform, mut rest) = self.bytes[self.uniform_start..].split_at(self.header.uniform);
        let storage = self.header.storage.iter().map(|length| {
            let (contents, after) = rest.split_at(*length);
            rest = after;
            Cow::Borrowed(contents)
        });
        MethodShader {
            name: &self.header.name,
            wgsl: self.header.wgsl.iter().map(String::as_str).collect(),
            uniform: uniform.to_vec(),
            storage: storage.collect(),
        }
    }

    /// Meaning of the shader's results, such as the relief's factor of the reflectance ([`Method::answers`]).
    pub fn answers(&self) -> AnswerKind {
        self.header.answers
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Relief, Settings};
    use sunbeam::methods::MethodKind;
    use sunbeam::table::Progress;

    #[test]
    fn every_method_survives_a_round_trip_and_cut_bytes_are_refused() {
        let settings = |more: &str| {
            let json = format!(r#"{{"surface": {{"preset": "sinusoidal", "coherence_length": 20{more}}}}}"#);
            Settings::from_json(&json).unwrap()
        };
        let relief = Relief::new(&settings(""), None).unwrap();
        let film = settings(r#", "eta": 1.5, "transmission": "film""#);
        let opaque = MethodKind::ALL.map(|method| Settings { method, ..settings("") });
        for settings in opaque.into_iter().chain([film]) {
            let method = relief.method(&settings, &Progress::none()).unwrap();
            let (ours, bytes) = (method.shader(), MethodData::to_bytes(&*method).unwrap());
            let data = MethodData::from_bytes(bytes.clone()).unwrap();
            let back = data.shader();
            assert_eq!((back.name, back.wgsl, data.answers()), (ours.name, ours.wgsl, method.answers()));
            assert_eq!((back.uniform, back.storage), (ours.uniform, ours.storage));
            // Cut within the header's length, within the header, and within the last buffer.
            for wrong in [&bytes[..3], &bytes[..40], &bytes[..bytes.len() - 1]] {
                assert!(MethodData::from_bytes(wrong.to_vec()).is_err());
            }
        }
    }
}
