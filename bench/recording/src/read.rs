//! Reads a recording, as far as it is whole.

use crate::file::{self, Chunk, End, Header, RecordingError};
use crate::layout::Layout;
use crate::planes;
use crate::record::OF_CONTACT;
use std::io::{BufReader, Read};
use std::path::Path;

/// Most bytes of all chunks, inflated.
const MOST: usize = 1 << 30;

/// A contact that carries a force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Its bodies; `None` for the world.
    pub bodies: [Option<usize>; 2],
    /// Bodies that share the force half and half with those.
    pub partners: [Option<usize>; 2],
    /// Where it is, world \[m].
    pub point: [f32; 3],
    /// Force on the first side, world \[N].
    pub force: [f32; 3],
}

impl Contact {
    fn of(raw: &[i32]) -> Self {
        let number = |k: usize| usize::try_from(raw[k]).ok();
        let three = |k: usize| [k, k + 1, k + 2].map(|k| f32::from_bits(raw[k] as u32));
        Self {
            bodies: [number(0), number(1)],
            partners: [number(2), number(3)],
            point: three(4),
            force: three(7),
        }
    }

    /// The part of the force that a body has, world \[N].
    pub fn on(&self, body: usize) -> [f64; 3] {
        let of_side = |side: usize| {
            let both = [self.bodies[side], self.partners[side]];
            let part = if both[1].is_some() { 0.5 } else { 1.0 };
            if both.contains(&Some(body)) {
                part
            } else {
                0.0
            }
        };
        self.force.map(|f| f64::from(f) * (of_side(0) - of_side(1)))
    }
}

/// Frames of one layout.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Part {
    pub layout: Layout,
    /// Times of the frames \[s].
    pub times: Vec<f64>,
    /// Integers of the channels, frame by frame.
    pub(crate) raw: Vec<i32>,
    /// Contacts of each frame, and their integers one after the other.
    pub(crate) counts: Vec<u32>,
    pub(crate) contacts: Vec<i32>,
}

impl Part {
    /// The number of a channel in a frame, both from 0; NaN where it is not there.
    pub fn value(&self, frame: usize, channel: usize) -> f64 {
        let width = self.layout.channels.len();
        match (
            self.layout.channels.get(channel),
            self.raw.get(frame * width + channel),
        ) {
            (Some(about), Some(raw)) => match about.step {
                Some(step) => f64::from(*raw) * f64::from(step),
                None => f64::from(f32::from_bits(*raw as u32)),
            },
            _ => f64::NAN,
        }
    }

    /// Position of a body in a frame \[m].
    pub fn position(&self, frame: usize, body: usize) -> [f64; 3] {
        let pose = self.layout.bodies[body].pose;
        [0, 1, 2].map(|k| self.value(frame, pose + k))
    }

    pub fn contacts(&self, frame: usize) -> impl Iterator<Item = Contact> + '_ {
        let before: u32 = self.counts[..frame].iter().sum();
        let (first, count) = (before as usize, self.counts[frame] as usize);
        let raw = self.contacts.chunks_exact(OF_CONTACT);
        raw.skip(first).take(count).map(Contact::of)
    }

    /// True if the time and all positions of a frame are finite.
    fn is_finite(&self, frame: usize) -> bool {
        let bodies = 0..self.layout.bodies.len();
        self.times[frame].is_finite()
            && bodies
                .flat_map(|i| self.position(frame, i))
                .all(f64::is_finite)
    }

    fn truncate(&mut self, frames: usize) {
        let contacts: u32 = self.counts[..frames].iter().sum();
        self.contacts.truncate(contacts as usize * OF_CONTACT);
        self.counts.truncate(frames);
        self.times.truncate(frames);
        self.raw.truncate(frames * self.layout.channels.len());
    }
}

/// How a recording ends.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Ending {
    /// With its run.
    Whole(End),
    /// Before it: the file was cut, or the rest of it is damaged.
    Cut,
    /// With a state that is not finite, at that time \[s].
    NotFinite(f64),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    pub header: Header,
    /// Frames, from one change of the scene to the next; those of each layout that has some.
    pub parts: Vec<Part>,
    /// Events: time \[s] and name.
    pub events: Vec<(f64, String)>,
    /// How it ends.
    pub ending: Ending,
}

impl Recording {
    /// Reads a file.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let file = std::fs::File::open(path)?;
        Self::read(&mut BufReader::new(file))
    }

    /// Reads a recording up to its end, or to where it is cut or damaged.
    pub fn read(from: &mut dyn Read) -> Result<Self, RecordingError> {
        file::check_begin(from)?;
        let mut recording: Option<Self> = None;
        let mut part = Part::default();
        let (mut chunk, mut read) = (0, 0);
        let ending = loop {
            let Some(bytes) = file::next(from)? else {
                break Ending::Cut;
            };
            read += bytes.len();
            if read > MOST {
                return Err(RecordingError::TooLarge);
            }
            let malformed = |reason: String| RecordingError::Malformed { chunk, reason };
            let (content, rest) = file::parse(&bytes).map_err(malformed)?;
            match (&mut recording, content) {
                (None, Chunk::Header(header)) => {
                    recording = Some(Self {
                        header,
                        parts: Vec::new(),
                        events: Vec::new(),
                        ending: Ending::Cut,
                    });
                }
                (Some(recording), Chunk::Layout(layout)) => {
                    if !layout.is_sound() {
                        return Err(malformed(
                            "its layout names what it does not have".to_owned(),
                        ));
                    }
                    let new = Part {
                        layout,
                        ..Part::default()
                    };
                    recording.take(std::mem::replace(&mut part, new));
                }
                (
                    Some(recording),
                    Chunk::Frames {
                        times,
                        contacts,
                        events,
                    },
                ) => {
                    let added = part.add(times, contacts, rest);
                    let wrong = "its frames are not as many as it says";
                    added.ok_or_else(|| malformed(wrong.to_owned()))?;
                    recording.events.extend(events);
                }
                (Some(_), Chunk::End(end)) => break Ending::Whole(end),
                _ => return Err(malformed("it stands in the wrong place".to_owned())),
            }
            chunk += 1;
        };
        let mut recording = recording.ok_or(RecordingError::Nothing)?;
        recording.take(part);
        recording.ending = ending;
        recording.cut_where_not_finite();
        Ok(recording)
    }

    /// Takes a part that has frames; the only one has none where no step was made.
    fn take(&mut self, part: Part) {
        if !part.times.is_empty() {
            self.parts.push(part);
        }
    }

    /// The first frame that is not finite is the end.
    fn cut_where_not_finite(&mut self) {
        let frames = |p: &Part| (0..p.times.len()).find(|k| !p.is_finite(*k));
        let found = self
            .parts
            .iter()
            .enumerate()
            .find_map(|(i, p)| Some((i, frames(p)?)));
        let Some((part, frame)) = found else {
            return;
        };
        self.ending = Ending::NotFinite(self.parts[part].times[frame]);
        self.parts[part].truncate(frame);
        self.parts.truncate(part + usize::from(frame > 0));
    }

    pub fn frames(&self) -> usize {
        self.parts.iter().map(|p| p.times.len()).sum()
    }

    /// Times of the first and of the last frame \[s]; `None` without frames.
    pub fn span(&self) -> Option<[f64; 2]> {
        let first = self.parts.first()?.times.first()?;
        let last = self.parts.last()?.times.last()?;
        Some([*first, *last])
    }

    /// How it ends, in words; nothing where the run reached its end.
    pub fn early(&self) -> Option<String> {
        match &self.ending {
            Ending::Whole(end) => {
                let reason = end.reason.as_ref()?;
                Some(format!("the run ended at t = {:.4} s: {reason}", end.time))
            }
            Ending::Cut => Some(match self.span() {
                Some([_, last]) => format!("the recording is cut or damaged after t = {last:.4} s"),
                None => "the recording is cut before its first frame".to_owned(),
            }),
            Ending::NotFinite(time) => Some(format!("the state is not finite at t = {time:.4} s")),
        }
    }
}

impl Part {
    /// Adds frames; `None` where they do not fit.
    fn add(&mut self, times: Vec<f64>, counts: Vec<u32>, bytes: &[u8]) -> Option<()> {
        if counts.len() != times.len() {
            return None;
        }
        let width = self.layout.channels.len();
        let (raw, used) = planes::decode(bytes, width, times.len())?;
        let touching = counts
            .iter()
            .try_fold(0_u32, |sum, count| sum.checked_add(*count))?;
        let (contacts, rest) = planes::decode(&bytes[used..], OF_CONTACT, touching as usize)?;
        if used + rest != bytes.len() {
            return None;
        }
        let bodies = self.layout.bodies.len();
        let is_body = |i: &i32| usize::try_from(*i).map_or(*i == -1, |i| i < bodies);
        let named = contacts.chunks_exact(OF_CONTACT).flat_map(|c| &c[..4]);
        let sound = named.into_iter().all(is_body);
        self.times.extend(times);
        self.counts.extend(counts);
        self.raw.extend(raw);
        self.contacts.extend(contacts);
        sound.then_some(())
    }
}
