//! The quantities of a run: names, units, and where a sample holds them, for tables and recordings alike.

use crate::trajectory::Sample;

/// Reads a quantity; `None` where the run has none.
pub type OfRun = fn(&Sample) -> Option<f64>;

/// Name, unit and reading of each.
pub const OF_RUN: [(&str, &str, OfRun); 18] = [
    ("time", "s", |s| Some(s.time)),
    ("load_x", "m", |s| Some(s.load.x)),
    ("load_y", "m", |s| Some(s.load.y)),
    ("load_z", "m", |s| Some(s.load.z)),
    ("kinetic", "J", |s| Some(s.energy.kinetic)),
    ("gravity", "J", |s| Some(s.energy.gravity)),
    ("elastic", "J", |s| Some(s.energy.elastic)),
    ("max_gap", "m", |s| Some(s.violation)),
    ("iterations", "", |s| Some(s.iterations as f64)),
    ("step", "ns", |s| Some(s.phases.total().as_nanos() as f64)),
    ("load_tension", "N", |s| s.load_tension),
    ("events", "", |s| Some(s.events as f64)),
    ("contacts", "", |s| Some(s.contacts.touching as f64)),
    ("sliding", "", |s| Some(s.contacts.sliding as f64)),
    ("groups", "", |s| Some(s.contacts.groups as f64)),
    ("error", "mm", |s| s.error.map(|e| 1e3 * e.total())),
    ("segments", "", |s| Some(s.resolved.segments as f64)),
    ("asleep", "", |s| Some(f64::from(u8::from(s.asleep)))),
];
