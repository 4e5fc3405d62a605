//! Writes a recording while its run goes on.

use crate::file::{self, Chunk, End, Header};
use crate::observe::{Observer, observe_contacts};
use crate::planes;
use std::io::{self, Write};
use taut_integrator::Stepper;
use taut_measure::trajectory::Sample;

/// Most frames of a simulated second.
pub const MOST_A_SECOND: f64 = 60.0;

/// Bytes of all frames before they are deflated.
pub const BUDGET: usize = 1 << 28;

/// Frames of a chunk.
const FRAMES: usize = 64;

/// Bytes of a chunk, before it is compressed, at which it ends.
const BYTES: usize = 1 << 22;

/// Integers of a contact: [`observe_contacts`].
pub(crate) const OF_CONTACT: usize = 10;

/// Writer of a recording.
#[derive(Debug, Default)]
pub struct Recorder {
    observer: Option<Observer>,
    /// Steps from one frame to the next.
    stride: u64,
    steps: u64,
    /// Bytes that are left, and those of them that frames of this stride may take.
    left: usize,
    dense: usize,
    // The frames of the chunk.
    times: Vec<f64>,
    values: Vec<i32>,
    /// Numbers of the last frame, whose turns the next ones go on from.
    last: Vec<i32>,
    counts: Vec<u32>,
    contacts: Vec<i32>,
    events: Vec<(f64, String)>,
}

impl Recorder {
    /// Begins a recording of a run of so many steps, with a stepper as it is before the first.
    pub fn begin(out: &mut dyn Write, stepper: &Stepper, steps: usize) -> io::Result<Self> {
        Self::within(BUDGET, out, stepper, steps)
    }

    /// [`begin`](Self::begin) with a budget in bytes.
    pub(crate) fn within(
        budget: usize,
        out: &mut dyn Write,
        stepper: &Stepper,
        steps: usize,
    ) -> io::Result<Self> {
        let options = stepper.options();
        file::begin(out)?;
        let header = Header {
            program: format!("taut {}", env!("CARGO_PKG_VERSION")),
            scene: stepper.scene().name.clone(),
            solver: stepper.backend().to_string(),
            gravity: stepper.scene().gravity.into(),
            dt: options.dt,
        };
        file::write(out, &Chunk::Header(header), &[])?;
        let mut new = Self {
            left: budget,
            ..Self::default()
        };
        new.observe(out, stepper)?;
        new.dense = new.left / 2;
        // 1/60 s in steps, with room for rounding; or what keeps a run without contacts within half of the budget.
        let a_second = (1.0 / (MOST_A_SECOND * options.dt) - 1e-6).ceil().max(1.0) as u64;
        let width = new.observer.as_ref().map_or(0, |o| o.layout.channels.len());
        let bytes = (steps as u64).saturating_mul(4 * width as u64 + 12);
        new.stride = a_second.max(bytes.div_ceil(new.dense.max(1) as u64));
        Ok(new)
    }

    /// Takes a layout of the scene as it is.
    fn observe(&mut self, out: &mut dyn Write, stepper: &Stepper) -> io::Result<()> {
        let observer = Observer::new(stepper);
        let bytes = file::write(out, &Chunk::Layout(observer.layout.clone()), &[])?;
        self.spend(bytes);
        self.observer = Some(observer);
        self.last.clear();
        Ok(())
    }

    /// Something of the scene has changed that its names do not tell, such as a mass: the next frame has another layout.
    pub fn renew(&mut self) {
        self.observer = None;
    }

    /// Sees a step; writes where a chunk is full.
    pub fn step(
        &mut self,
        out: &mut dyn Write,
        stepper: &Stepper,
        sample: &Sample,
    ) -> io::Result<()> {
        self.steps += 1;
        let fired = stepper.fired().iter();
        self.events
            .extend(fired.map(|name| (sample.time, name.clone())));
        if !self.steps.is_multiple_of(self.stride) {
            return Ok(());
        }
        if !self
            .observer
            .as_ref()
            .is_some_and(|o| o.fits(stepper.scene()))
        {
            self.flush(out)?;
            self.observe(out, stepper)?;
        }
        let before = self.bytes();
        let Some(observer) = &self.observer else {
            return Ok(());
        };
        self.times.push(sample.time);
        let begun = self.values.len();
        observer.observe(stepper, sample, &self.last, &mut self.values);
        self.last.clear();
        self.last.extend_from_slice(&self.values[begun..]);
        let held = self.contacts.len();
        observe_contacts(stepper, &mut self.contacts);
        let count = (self.contacts.len() - held) / OF_CONTACT;
        self.counts.push(count as u32);
        self.spend(self.bytes() - before);
        if self.times.len() >= FRAMES || self.bytes() >= BYTES {
            self.flush(out)?;
        }
        Ok(())
    }

    fn bytes(&self) -> usize {
        4 * (self.values.len() + self.contacts.len() + self.counts.len()) + 8 * self.times.len()
    }

    /// Takes the bytes of a frame from those that are left; frames are half as dense where half of these are used up.
    fn spend(&mut self, bytes: usize) {
        self.left = self.left.saturating_sub(bytes);
        if self.left == 0 {
            self.stride = u64::MAX;
        }
        while self.left < self.dense {
            self.dense = self.left / 2;
            self.stride = self.stride.saturating_mul(2);
        }
    }

    /// Writes the frames and events that are waiting.
    fn flush(&mut self, out: &mut dyn Write) -> io::Result<()> {
        if self.times.is_empty() && self.events.is_empty() {
            return Ok(());
        }
        let width = self.values.len() / self.times.len().max(1);
        let mut bytes = planes::encode(&self.values, width);
        bytes.extend(planes::encode(&self.contacts, OF_CONTACT));
        self.values.clear();
        self.contacts.clear();
        let chunk = Chunk::Frames {
            times: std::mem::take(&mut self.times),
            contacts: std::mem::take(&mut self.counts),
            events: std::mem::take(&mut self.events),
        };
        file::write(out, &chunk, &bytes)?;
        Ok(())
    }

    /// Ends the recording, with the reason where the run ended early.
    pub fn end(mut self, out: &mut dyn Write, time: f64, reason: Option<String>) -> io::Result<()> {
        self.flush(out)?;
        let steps = self.steps;
        file::write(
            out,
            &Chunk::End(End {
                time,
                steps,
                reason,
            }),
            &[],
        )?;
        Ok(())
    }
}
