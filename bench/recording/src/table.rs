//! Tables of what was recorded, under the names of the columns of `taut run`.

use crate::layout::Layout;
use crate::read::{Part, Recording};
use std::collections::HashSet;
use std::io::{self, Write};

/// Columns that are made of others: of the load, and of the contacts of a body.
const OF_LOAD: [&str; 3] = ["load_x", "load_y", "load_z"];
const OF_CONTACTS: [&str; 4] = ["contact_x", "contact_y", "contact_z", "contact"];

/// Names that an error lists at most.
const LISTED: usize = 12;

/// Where the values of a column come from, in one part.
#[derive(Debug, Clone, PartialEq)]
enum Source {
    Time,
    Channel(usize),
    /// Largest of these channels.
    Largest(Vec<usize>),
    /// Component of the contacts' force on a body, or its norm.
    Contact(usize, usize),
}

impl Source {
    fn find(name: &str, layout: &Layout) -> Option<(Self, &'static str)> {
        if name == "time" {
            return Some((Self::Time, "s"));
        }
        if let Some(axis) = OF_LOAD.iter().position(|known| *known == name) {
            let load = &layout.bodies[layout.load?];
            return Some((Self::Channel(load.pose + axis), "m"));
        }
        let (owner, quantity) = name.rsplit_once('.')?;
        let component = OF_CONTACTS.iter().position(|known| *known == quantity);
        let body = layout.bodies.iter().position(|b| b.name == owner);
        if let (Some(component), Some(body)) = (component, body) {
            return Some((Self::Contact(body, component), "N"));
        }
        let cable = layout
            .cables
            .iter()
            .find(|c| c.name == owner && quantity == "tension");
        cable.map(|cable| (Self::Largest(cable.tensions.clone()), "N"))
    }

    fn value(&self, part: &Part, frame: usize) -> f64 {
        match self {
            Self::Time => part.times[frame],
            Self::Channel(channel) => part.value(frame, *channel),
            Self::Largest(channels) => {
                let all = channels.iter().map(|channel| part.value(frame, *channel));
                all.fold(f64::NAN, f64::max)
            }
            Self::Contact(body, component) => {
                let mut sum = [0.0; 3];
                for contact in part.contacts(frame) {
                    let force = contact.on(*body);
                    sum.iter_mut().zip(force).for_each(|(sum, f)| *sum += f);
                }
                let norm = || sum.iter().fold(0.0, |norm: f64, f| norm.hypot(*f));
                sum.get(*component).copied().unwrap_or_else(norm)
            }
        }
    }
}

/// A channel's own name comes before those that are made up.
fn find(name: &str, layout: &Layout) -> Option<(Source, String)> {
    if let Some(channel) = layout.channel(name) {
        let unit = layout.channels[channel].unit.clone();
        return Some((Source::Channel(channel), unit));
    }
    Source::find(name, layout).map(|(source, unit)| (source, unit.to_owned()))
}

/// Writes columns as CSV, a line a frame; a cell is empty for what is not there. The headings are `NAME [UNIT]`. Of a recording
/// without frames they are the names alone.
pub fn table<'a>(
    recording: &'a Recording,
    names: &'a [String],
) -> Result<impl Fn(&mut dyn Write) -> io::Result<()> + 'a, String> {
    let mut headings = Vec::new();
    for (i, name) in names.iter().enumerate() {
        if names[..i].contains(name) {
            return Err(format!("column `{name}` is there twice: drop one"));
        }
        let found = recording
            .parts
            .iter()
            .find_map(|part| find(name, &part.layout));
        headings.push(match found {
            Some((_, unit)) if !unit.is_empty() => format!("{name} [{unit}]"),
            None if !recording.parts.is_empty() => return Err(unknown(name, recording)),
            _ => name.clone(),
        });
    }
    Ok(move |out: &mut dyn Write| {
        let quoted = headings.iter().map(|heading| {
            if heading.contains(['"', ',', '\n', '\r']) {
                format!("\"{}\"", heading.replace('"', "\"\""))
            } else {
                heading.clone()
            }
        });
        writeln!(out, "{}", quoted.collect::<Vec<_>>().join(","))?;
        recording
            .parts
            .iter()
            .try_for_each(|part| lines(out, part, names))
    })
}

fn lines(out: &mut dyn Write, part: &Part, names: &[String]) -> io::Result<()> {
    let sources: Vec<_> = names.iter().map(|name| find(name, &part.layout)).collect();
    for frame in 0..part.times.len() {
        for (k, source) in sources.iter().enumerate() {
            let comma = if k == 0 { "" } else { "," };
            let value = source.as_ref().map(|(source, _)| source.value(part, frame));
            match (value, source) {
                (Some(value), Some((Source::Time, _))) => write!(out, "{comma}{value:?}")?,
                // As many digits as single precision has.
                (Some(value), _) if !value.is_nan() => write!(out, "{comma}{:?}", value as f32)?,
                _ => write!(out, "{comma}")?,
            }
        }
        writeln!(out)?;
    }
    Ok(())
}

/// The error of a name, with those that it may have meant.
fn unknown(name: &str, recording: &Recording) -> String {
    let layouts = || recording.parts.iter().map(|part| &part.layout);
    let owner = name.rsplit_once('.').map(|(owner, _)| format!("{owner}."));
    let contacts = layouts()
        .flat_map(|l| &l.bodies)
        .flat_map(|body| OF_CONTACTS.map(|quantity| format!("{}.{quantity}", body.name)));
    let cables = layouts()
        .flat_map(|l| &l.cables)
        .map(|c| format!("{}.tension", c.name));
    let made = ["time", "load_x", "load_y", "load_z"]
        .map(str::to_owned)
        .into_iter();
    let channels = layouts().flat_map(|l| &l.channels).map(|c| c.name.clone());
    let mut seen = HashSet::new();
    let all = made.chain(channels).chain(contacts).chain(cables);
    let all: Vec<String> = all.filter(|name| seen.insert(name.clone())).collect();
    let of_owner: Vec<_> = all
        .iter()
        .filter(|n| owner.as_ref().is_some_and(|o| n.starts_with(o)))
        .collect();
    let known: Vec<String> = if of_owner.is_empty() {
        let mut known: Vec<_> = all.iter().take(LISTED).cloned().collect();
        let more = recording
            .parts
            .iter()
            .flat_map(|p| &p.layout.bodies)
            .take(4);
        known.extend(more.map(|body| format!("{}.x", body.name)));
        known.push("…".to_owned());
        known
    } else {
        of_owner.into_iter().cloned().collect()
    };
    format!(
        "the recording has no column `{name}`: choose one of {}; `taut run --columns` has all quantities",
        known.join(", ")
    )
}
