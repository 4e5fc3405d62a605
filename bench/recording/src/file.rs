//! The file: chunks, each whole or not there.

use crate::layout::Layout;
use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;
use serde::{Deserialize, Serialize};
use std::io::{self, Read, Write};

/// First bytes of a recording, before its version number.
pub(crate) const MAGIC: &[u8; 15] = b"taut-recording\n";

/// The version that is written, and the newest that is read.
pub const VERSION: u8 = 1;

/// Most bytes of a chunk, deflated or not.
const MOST: u64 = 1 << 28;

/// Facts of the whole run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// The program that wrote it.
    pub program: String,
    pub scene: String,
    /// Solver, with its options.
    pub solver: String,
    /// Gravity \[m/s²].
    pub gravity: [f64; 3],
    /// Time step \[s].
    pub dt: f64,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct End {
    /// When \[s].
    pub time: f64,
    /// Steps that were made.
    pub steps: u64,
    /// Why it ended early.
    pub reason: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Chunk {
    Header(Header),
    Layout(Layout),
    /// Frames of the layout before; bytes of the numbers and of the contacts follow.
    Frames {
        /// Times \[s].
        times: Vec<f64>,
        /// Contacts of each frame.
        contacts: Vec<u32>,
        /// Events since the frames before: time \[s] and name.
        events: Vec<(f64, String)>,
    },
    End(End),
}

/// Reason why a file cannot be read as a recording.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// It cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
    #[error("it is no recording: make one with `taut run SCENE --record FILE`")]
    Foreign,
    /// A later program wrote it.
    #[error(
        "it is of version {version} and this program reads up to {VERSION}: use the program that wrote it, or a newer one"
    )]
    Newer { version: u8 },
    /// Not even its first chunk is whole.
    #[error("it ends before anything was recorded: record the run again")]
    Nothing,
    /// A chunk, numbered from 0, is whole, but not as this version has it.
    #[error("its part {chunk} is damaged, {reason}: record the run again")]
    Malformed { chunk: usize, reason: String },
    #[error(
        "it holds more than a gigabyte of numbers, as no recording does that `taut run` writes: record the run again"
    )]
    TooLarge,
}

pub(crate) fn deflated(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let mut out = DeflateEncoder::new(Vec::new(), Compression::default());
    out.write_all(bytes)?;
    out.finish()
}

/// Writes what stands before all chunks.
pub(crate) fn begin(out: &mut dyn Write) -> io::Result<()> {
    out.write_all(MAGIC)?;
    out.write_all(&[VERSION])
}

/// Writes a chunk, with bytes behind it. How many bytes these are, inflated.
pub(crate) fn write(out: &mut dyn Write, chunk: &Chunk, rest: &[u8]) -> io::Result<usize> {
    let mut bytes = Vec::new();
    ciborium::into_writer(chunk, &mut bytes).map_err(io::Error::other)?;
    bytes.extend_from_slice(rest);
    put(out, &bytes)?;
    // Who reads along finds it whole.
    out.flush()?;
    Ok(bytes.len())
}

pub(crate) fn put(out: &mut dyn Write, bytes: &[u8]) -> io::Result<()> {
    let packed = deflated(bytes)?;
    let length = u32::try_from(packed.len()).map_err(io::Error::other)?;
    out.write_all(&length.to_le_bytes())?;
    out.write_all(&crc32fast::hash(&packed).to_le_bytes())?;
    out.write_all(&packed)
}

/// Reads what stands before all chunks.
pub(crate) fn check_begin(from: &mut dyn Read) -> Result<(), RecordingError> {
    let mut begin = Vec::new();
    let count = MAGIC.len() as u64 + 1;
    from.take(count).read_to_end(&mut begin)?;
    match begin.strip_prefix(MAGIC) {
        Some([version]) if *version <= VERSION => Ok(()),
        Some([version, ..]) => Err(RecordingError::Newer { version: *version }),
        Some([]) => Err(RecordingError::Nothing),
        None if MAGIC.starts_with(&begin) => Err(RecordingError::Nothing),
        None => Err(RecordingError::Foreign),
    }
}

/// The bytes of the next chunk; `None` without a whole one.
pub(crate) fn next(from: &mut dyn Read) -> Result<Option<Vec<u8>>, RecordingError> {
    let mut head = Vec::new();
    from.take(8).read_to_end(&mut head)?;
    let Ok([a, b, c, d, sum @ ..]) = <[u8; 8]>::try_from(&head[..]) else {
        return Ok(None);
    };
    let length = u32::from_le_bytes([a, b, c, d]);
    let mut packed = Vec::new();
    from.take(u64::from(length)).read_to_end(&mut packed)?;
    if packed.len() as u64 != u64::from(length)
        || crc32fast::hash(&packed) != u32::from_le_bytes(sum)
    {
        return Ok(None);
    }
    let mut bytes = Vec::new();
    match DeflateDecoder::new(&packed[..])
        .take(MOST + 1)
        .read_to_end(&mut bytes)
    {
        Ok(_) if bytes.len() as u64 > MOST => Err(RecordingError::TooLarge),
        Ok(_) => Ok(Some(bytes)),
        Err(_) => Ok(None),
    }
}

/// Why bytes are no chunk, in words.
fn fault<E>(error: &ciborium::de::Error<E>) -> String {
    use ciborium::de::Error;
    match error {
        Error::Io(_) => "it ends too early".to_owned(),
        Error::Syntax(at) => format!("its byte {at} is no CBOR"),
        Error::RecursionLimitExceeded => "it is nested too deeply".to_owned(),
        Error::Semantic(..) => {
            "it is no header, layout, frames or end as they are written".to_owned()
        }
    }
}

/// A chunk of its bytes, and those behind it.
pub(crate) fn parse(mut bytes: &[u8]) -> Result<(Chunk, &[u8]), String> {
    let chunk = ciborium::from_reader(&mut bytes).map_err(|e| fault(&e))?;
    Ok((chunk, bytes))
}
