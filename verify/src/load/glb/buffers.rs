//! The buffers of a glTF file: in the file, within its text, or beside it.

use super::fault::malformed;
use crate::load::error::LoadError;
use base64::{
    Engine,
    alphabet::STANDARD,
    engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig},
};
use gltf::{Document, buffer::Source};
use std::{
    borrow::Cow,
    path::{Component, Path, PathBuf},
};

/// The bytes of all buffers by their numbers.
pub(super) struct Buffers<'a>(Vec<Cow<'a, [u8]>>);

/// Padding of base64 is often left out.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

impl<'a> Buffers<'a> {
    /// All buffers of a document; `bin` is that of a binary file, and files of their own lie in
    /// `folder`.
    pub(super) fn open(document: &Document, bin: Option<&'a [u8]>, folder: Option<&Path>) -> Result<Self, LoadError> {
        let open = |buffer: gltf::Buffer<'_>| match buffer.source() {
            Source::Bin if buffer.index() == 0 => Ok(bin.map(Cow::Borrowed).unwrap_or_default()),
            // That of an extension with a fallback elsewhere.
            Source::Bin => Ok(Cow::default()),
            Source::Uri(uri) => match uri.strip_prefix("data:") {
                Some(data) => {
                    let (_, text) = data.split_once(";base64,").ok_or_else(|| odd(uri, "is not base64"))?;
                    BASE64.decode(text).map(Cow::Owned).map_err(|error| odd(uri, &error.to_string()))
                }
                None => beside(uri, folder).map(Cow::Owned),
            },
        };
        document.buffers().map(open).collect::<Result<_, _>>().map(Self)
    }

    /// A buffer by its number.
    pub(super) fn get(&self, index: usize) -> Option<&[u8]> {
        self.0.get(index).map(|buffer| &**buffer)
    }

    /// Bytes of all of them.
    pub(super) fn length(&self) -> usize {
        self.0.iter().map(|buffer| buffer.len()).sum()
    }
}

fn odd(uri: &str, why: &str) -> LoadError {
    let uri: String = uri.chars().take(40).collect();
    malformed(format!("its buffer '{uri}' {why}"))
}

/// Reads a file in the folder of the one that names it, or below.
fn beside(uri: &str, folder: Option<&Path>) -> Result<Vec<u8>, LoadError> {
    let name = PathBuf::from(unescaped(uri));
    if !name.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir)) || uri.contains("://") {
        return Err(odd(uri, "is not in the folder of the file"));
    }
    let folder = folder.ok_or_else(|| odd(uri, "is a file of its own, and it is not known where"))?;
    let path = folder.join(name);
    std::fs::read(&path).map_err(|source| LoadError::Read { path, source })
}

/// The text of a URI, in which `%20` is a blank.
fn unescaped(uri: &str) -> String {
    let mut pieces = uri.split('%');
    let mut bytes = pieces.next().unwrap_or_default().as_bytes().to_vec();
    for piece in pieces {
        match piece.get(..2).and_then(|code| u8::from_str_radix(code, 16).ok()) {
            Some(byte) => {
                bytes.push(byte);
                bytes.extend(&piece.as_bytes()[2..]);
            }
            None => bytes.extend([b"%", piece.as_bytes()].concat()),
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
