//! The columns of `taut run --columns`: any quantity of a body, joint, cable or control, by name.
//!
//! `NAME.QUANTITY`, split at the last dot, is of what has that name; where a body and a joint share it the quantity
//! decides. Of a cable of segments `NAME.tension` is its largest, `NAME.3.tension` that of segment 3, from 0. A control and
//! the quantities of the run itself are named alone. All values are those at the end of a step: forces as
//! [`Stepper::force`] and [`Stepper::loads`] say, a joint's on its side b.

use crate::errors::worse;
use crate::quantities::{OF_RUN, OfRun};
use crate::trajectory::{self, Sample};
use serde::{Serialize, Serializer};
use std::io;
use taut_integrator::{BodyId, ConstraintId, Stepper};
use taut_model::nalgebra::Vector3;
use taut_model::{Constraint, Loads, MasslessCable, Scene, SceneError, Wrench};

/// A quantity: name, unit, and how it is read.
type Quantity<Read> = (&'static str, &'static str, Read);

type OfBody = fn(&Stepper, usize) -> f64;
type OfConstraint = fn(&Stepper, usize) -> Option<f64>;

const OF_BODY: [Quantity<OfBody>; 14] = [
    ("x", "m", |s, i| s.scene().bodies.position[i].x),
    ("y", "m", |s, i| s.scene().bodies.position[i].y),
    ("z", "m", |s, i| s.scene().bodies.position[i].z),
    ("vx", "m/s", |s, i| s.scene().bodies.velocity[i].x),
    ("vy", "m/s", |s, i| s.scene().bodies.velocity[i].y),
    ("vz", "m/s", |s, i| s.scene().bodies.velocity[i].z),
    ("speed", "m/s", |s, i| s.scene().bodies.velocity[i].norm()),
    ("wx", "rad/s", |s, i| s.scene().bodies.angular_velocity[i].x),
    ("wy", "rad/s", |s, i| s.scene().bodies.angular_velocity[i].y),
    ("wz", "rad/s", |s, i| s.scene().bodies.angular_velocity[i].z),
    ("contact", "N", |s, i| contact(s, i).norm()),
    ("contact_x", "N", |s, i| contact(s, i).x),
    ("contact_y", "N", |s, i| contact(s, i).y),
    ("contact_z", "N", |s, i| contact(s, i).z),
];

/// Sum of the contacts' forces on a body, world \[N].
fn contact(stepper: &Stepper, body: usize) -> Vector3<f64> {
    stepper.contacts().map(|contact| contact.on(body)).sum()
}

/// Quantities of a joint, link or cable; `None` where it has no such quantity.
const OF_CONSTRAINT: [Quantity<OfConstraint>; 16] = [
    (TENSION, "N", |s, c| loads(s, c).tension),
    ("fx", "N", |s, c| Some(force(s, c)?.force.x)),
    ("fy", "N", |s, c| Some(force(s, c)?.force.y)),
    ("fz", "N", |s, c| Some(force(s, c)?.force.z)),
    ("force", "N", |s, c| Some(force(s, c)?.force.norm())),
    ("bending", "N m", |s, c| loads(s, c).bending),
    ("twist", "N m", |s, c| loads(s, c).twist),
    (DRIVE, "N", |s, c| loads(s, c).drive),
    ("gap", "m", |s, c| {
        force(s, c).and_then(|_| trajectory::gap(s, c))
    }),
    ("length", "m", length),
    ("path", "m", path),
    ("slip", "m/s", slip),
    ("moment", "N m", |s, c| Some(moment(s, c)?.norm())),
    ("mx", "N m", |s, c| Some(moment(s, c)?.x)),
    ("my", "N m", |s, c| Some(moment(s, c)?.y)),
    ("mz", "N m", |s, c| Some(moment(s, c)?.z)),
];

/// The quantity that cables of segments have, too.
const TENSION: &str = "tension";

/// The quantity whose unit is N m where a motor turns.
const DRIVE: &str = "drive";

fn loads(stepper: &Stepper, c: usize) -> Loads {
    stepper.loads(c).unwrap_or_default()
}

fn cable(stepper: &Stepper, c: usize) -> Option<&MasslessCable> {
    stepper.scene().constraints.get(c)?.massless_cable()
}

/// Length of a cable \[m], with what lies on its sheaves, or that of segments is off its drum.
pub fn length(stepper: &Stepper, c: usize) -> Option<f64> {
    let constraint = stepper.scene().constraints.get(c)?;
    constraint.length_at(stepper.time())
}

/// Length of the path of a cable without mass, with what lies on its sheaves.
fn path(stepper: &Stepper, c: usize) -> Option<f64> {
    Some(cable(stepper, c)?.path(&stepper.scene().bodies, stepper.time()))
}

/// Rate at which a part of a cable slips over the sheave that it begins at.
fn slip(stepper: &Stepper, c: usize) -> Option<f64> {
    let capstans = stepper.scene().capstans.iter().zip(stepper.slip_rates());
    let mut begins = capstans.filter(|(capstan, _)| capstan.parts[1] == c);
    begins.next().map(|(_, rate)| rate)
}

/// On side b; a massless cable may have more than two sides, so none is b.
fn force(stepper: &Stepper, c: usize) -> Option<Wrench> {
    match cable(stepper, c) {
        Some(_) => None,
        None => stepper.force(c),
    }
}

/// The torque on side b about the attachment point, world frame, of what holds an angle.
fn moment(stepper: &Stepper, c: usize) -> Option<Vector3<f64>> {
    let mut parts = stepper.scene().constraints.get(c)?.parts();
    parts.find(|(kind, rows, _)| kind.is_angular() && *rows > 0)?;
    Some(force(stepper, c)?.torque)
}

/// A column that cannot be made.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ColumnError {
    /// A name without a dot belongs neither to a quantity of the run nor to a control; `known` are all columns without a dot.
    #[error(
        "no column is called `{name}`: choose one of {}, or NAME.QUANTITY of a body, joint or cable",
        known.join(", ")
    )]
    UnknownColumn { name: String, known: Vec<String> },
    /// Nothing has the name before the dot; the first few that there are.
    #[error(
        "column `{column}`: no body, joint or cable is called `{name}`: choose one of the bodies {}, or of the joints and \
         cables {}",
        bodies.join(", "),
        constraints.join(", ")
    )]
    UnknownName {
        column: String,
        name: String,
        bodies: Vec<String>,
        constraints: Vec<String>,
    },
    /// The named thing lacks the quantity; `known` are those that it has.
    #[error(
        "column `{name}.{quantity}`: `{name}` has no `{quantity}`: choose one of {}",
        known.join(", ")
    )]
    UnknownQuantity {
        name: String,
        quantity: String,
        known: Vec<&'static str>,
    },
    /// A cable has fewer segments.
    #[error("column `{column}`: cable `{cable}` has {segments} segments, numbered from 0")]
    NoSegment {
        column: String,
        cable: String,
        segments: usize,
    },
    #[error("column `{name}` is there twice: drop one")]
    Twice { name: String },
}

/// Where the values of a column come from, whatever comes and goes while the scene runs.
#[derive(Debug, Clone)]
enum Source {
    Run(OfRun),
    Body(BodyId, OfBody),
    Constraint(ConstraintId, OfConstraint),
    Control(String),
    /// Of a constraint that an event makes, empty until then.
    Made(String, OfConstraint),
    /// The largest tension of a cable of segments.
    Cable(String),
    /// Tension in one segment, from 0.
    Segment(String, usize),
}

impl Source {
    /// The value after a step; `None` for what is not there.
    fn value(&self, stepper: &Stepper, sample: Option<&Sample>) -> Option<f64> {
        let scene = stepper.scene();
        match self {
            Self::Run(of) => of(sample?),
            Self::Body(body, of) => Some(of(stepper, stepper.body_index(*body).ok()?)),
            Self::Constraint(c, of) => of(stepper, stepper.constraint_index(*c).ok()?),
            Self::Made(name, of) => {
                let mut names = scene.constraint_names.iter();
                of(stepper, names.position(|known| known == name)?)
            }
            Self::Control(name) => {
                let control = scene.controls.iter().position(|c| c.name == *name);
                scene.control_value(control?)
            }
            Self::Cable(name) => {
                let cable = scene.cables.iter().find(|cable| cable.name == *name)?;
                let tensions = cable.joints.iter().filter_map(|c| stepper.tension(*c));
                tensions.reduce(worse)
            }
            Self::Segment(name, segment) => stepper.tension_in(name, *segment).ok(),
        }
    }
}

/// The columns of a table, in their order.
#[derive(Debug, Clone, Default)]
pub struct Columns {
    headings: Vec<String>,
    sources: Vec<Source>,
}

impl Columns {
    /// Finds the columns with `names` in the scene of `stepper`.
    pub fn find(names: &[String], stepper: &Stepper) -> Result<Self, ColumnError> {
        let mut columns = Self::default();
        for (i, name) in names.iter().enumerate() {
            if names[..i].contains(name) {
                return Err(ColumnError::Twice { name: name.clone() });
            }
            let (unit, source) = find(name, stepper)?;
            columns.headings.push(match unit {
                "" => name.clone(),
                unit => format!("{name} [{unit}]"),
            });
            columns.sources.push(source);
        }
        Ok(columns)
    }

    /// The headings, `NAME.QUANTITY [UNIT]`; controls and counts are without unit.
    pub fn headings(&self) -> &[String] {
        &self.headings
    }

    /// The values after a step, in the units of the headings; `None` for what has been removed.
    pub fn values(&self, stepper: &Stepper, sample: &Sample) -> impl Iterator<Item = Option<f64>> {
        let sources = self.sources.iter();
        sources.map(|source| source.value(stepper, Some(sample)))
    }

    /// The values before the first step; `None` for those of the run.
    pub fn at_start(&self, stepper: &Stepper) -> impl Iterator<Item = Option<f64>> {
        let sources = self.sources.iter();
        sources.map(|source| source.value(stepper, None))
    }

    /// Writes the headings as a line of CSV.
    pub fn heading(&self, out: &mut dyn io::Write) -> io::Result<()> {
        for (k, heading) in self.headings.iter().enumerate() {
            let comma = if k == 0 { "" } else { "," };
            if heading.contains(['"', '\n', '\r']) {
                write!(out, "{comma}\"{}\"", heading.replace('"', "\"\""))?;
            } else {
                write!(out, "{comma}{heading}")?;
            }
        }
        writeln!(out)
    }

    /// Writes the values after a step as a line of CSV; a cell is empty for what is not there.
    pub fn line(
        &self,
        out: &mut dyn io::Write,
        stepper: &Stepper,
        sample: &Sample,
    ) -> io::Result<()> {
        for (k, value) in self.values(stepper, sample).enumerate() {
            let comma = if k == 0 { "" } else { "," };
            match value {
                // The shortest text that is the number, with an exponent where that is shorter.
                Some(value) => write!(out, "{comma}{value:?}")?,
                None => write!(out, "{comma}")?,
            }
        }
        writeln!(out)
    }
}

/// Unit and source of the column called `name`.
fn find(name: &str, stepper: &Stepper) -> Result<(&'static str, Source), ColumnError> {
    let scene = stepper.scene();
    if let Some((_, unit, of)) = OF_RUN.iter().find(|(known, ..)| *known == name) {
        return Ok((unit, Source::Run(*of)));
    }
    if scene.control(name).is_ok() {
        return Ok(("", Source::Control(name.to_owned())));
    }
    let Some((owner, quantity)) = name.rsplit_once('.') else {
        let of_run = OF_RUN.iter().map(|(known, ..)| (*known).to_owned());
        let controls = scene.controls.iter().map(|c| c.name.clone());
        return Err(ColumnError::UnknownColumn {
            name: name.to_owned(),
            known: of_run.chain(controls).collect(),
        });
    };
    if quantity == TENSION && scene.cable(owner).is_ok() && scene.constraint(owner).is_err() {
        return Ok(("N", Source::Cable(owner.to_owned())));
    }
    if let Some(segment) = segment(name, scene) {
        return segment.map(|source| ("N", source));
    }
    let (body, constraint) = match (scene.body(owner), scene.constraint(owner)) {
        (Err(_), Err(_))
            if scene
                .events
                .iter()
                .any(|e| e.attached().any(|n| n == owner)) =>
        {
            return made(owner, quantity);
        }
        (Err(bodies), Err(constraints)) => {
            return Err(ColumnError::UnknownName {
                column: name.to_owned(),
                name: owner.to_owned(),
                bodies: known(bodies),
                constraints: known(constraints),
            });
        }
        (body, constraint) => (body.ok(), constraint.ok()),
    };
    let body = body.and_then(|_| stepper.body(owner).ok());
    let of_body = body
        .into_iter()
        .flat_map(|id| OF_BODY.map(|(known, unit, of)| (known, unit, Source::Body(id, of))));
    let id = stepper.constraint(owner).ok();
    let of_constraint = constraint.into_iter().zip(id).flat_map(|(c, id)| {
        let has = move |(_, _, of): &Quantity<OfConstraint>| of(stepper, c).is_some();
        let turns = matches!(scene.constraints[c], Constraint::Hinge(_));
        let found = OF_CONSTRAINT.into_iter().filter(has);
        found.map(move |(known, unit, of)| {
            let unit = if turns && known == DRIVE { "N m" } else { unit };
            (known, unit, Source::Constraint(id, of))
        })
    });
    let all: Vec<Quantity<Source>> = of_body.chain(of_constraint).collect();
    let found = all.iter().find(|(known, ..)| *known == quantity);
    let found = found.map(|(_, unit, source)| (*unit, source.clone()));
    found.ok_or_else(|| ColumnError::UnknownQuantity {
        name: owner.to_owned(),
        quantity: quantity.to_owned(),
        known: all.iter().map(|(known, ..)| *known).collect(),
    })
}

/// Unit and source of a quantity of what an event makes; it is not known yet which quantities that has.
fn made(owner: &str, quantity: &str) -> Result<(&'static str, Source), ColumnError> {
    let found = OF_CONSTRAINT.iter().find(|(known, ..)| *known == quantity);
    let (_, unit, of) = found.ok_or_else(|| ColumnError::UnknownQuantity {
        name: owner.to_owned(),
        quantity: quantity.to_owned(),
        known: OF_CONSTRAINT.iter().map(|(known, ..)| *known).collect(),
    })?;
    Ok((unit, Source::Made(owner.to_owned(), *of)))
}

/// The source of the column `CABLE.SEGMENT.tension`; `None` for any other `name`.
fn segment(name: &str, scene: &Scene) -> Option<Result<Source, ColumnError>> {
    let (cable, number) = name.strip_suffix(".tension")?.rsplit_once('.')?;
    let number: usize = number.parse().ok()?;
    let segments = scene.cable(cable).ok()?.bodies.len();
    Some(if number < segments {
        Ok(Source::Segment(cable.to_owned(), number))
    } else {
        Err(ColumnError::NoSegment {
            column: name.to_owned(),
            cable: cable.to_owned(),
            segments,
        })
    })
}

/// The names that there are, of an error that asks for one of them.
fn known(error: SceneError) -> Vec<String> {
    match error {
        SceneError::UnknownBody { known, .. } | SceneError::UnknownJoint { known, .. } => known,
        _ => Vec::new(),
    }
}

/// The values of columns over a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    columns: Vec<(String, Vec<Option<f64>>)>,
}

impl Series {
    /// Without values.
    pub fn new(columns: &Columns) -> Self {
        let headings = columns.headings().iter();
        Self {
            columns: headings.map(|h| (h.clone(), Vec::new())).collect(),
        }
    }

    /// Appends the values after a step, one a column.
    pub fn add(&mut self, values: impl Iterator<Item = Option<f64>>) {
        for ((_, series), value) in self.columns.iter_mut().zip(values) {
            series.push(value);
        }
    }
}

/// An object of a list a heading, in the order of the columns.
impl Serialize for Series {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(
            self.columns
                .iter()
                .map(|(heading, series)| (heading, series)),
        )
    }
}
