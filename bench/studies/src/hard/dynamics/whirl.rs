//! H38: bodies and chains that are whirled, by up to three turns a step: none gains energy.
//!
//! Bodies without symmetry tumble free, or held at their centres, where no gap tells of their turning; rods and boxes, one
//! or a chain, are whirled about their upper end. E ≤ E₀, within a hundredth of the kinetic energy at the start; what cannot
//! be followed may lose energy, or end in an error.

use super::Gained;
use crate::hard::counted;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use taut_integrator::StepOptions;
use taut_model::{Body, Constraint, Frame, RowLaw, Scene, SceneError, Spherical};
use taut_output::check::{Check, ExperimentError, Outcome};

/// Largest gain over the kinetic energy at the start.
const BAR: f64 = 0.01;
/// Angular velocities \[rad/s].
const RATES: [f64; 9] = [20.0, 47.0, 94.0, 150.0, 200.0, 300.0, 376.99, 600.0, 1000.0];

#[derive(Debug, Clone, Copy, PartialEq)]
struct Whirled {
    /// Bodies of the chain along x, 1 m long.
    bodies: usize,
    /// The bodies are boxes with three different sides; otherwise rods.
    boxes: bool,
    /// The chain hangs on the world by its end. Otherwise a single body is free.
    held: bool,
}

impl Whirled {
    fn scene(self, rate: f64) -> Result<Scene, SceneError> {
        let mut scene = Scene::new("whirl");
        let l = 1.0 / self.bodies as f64;
        // Across its own axes where it is free.
        let direction = if self.held {
            Vector3::new(0.01, 0.02, 1.0)
        } else {
            Vector3::new(0.5, 0.7, 0.3)
        };
        for i in 0..self.bodies {
            let mut body = Body::cuboid(Vector3::new(l, 0.3 * l, 0.1 * l), l);
            if !self.boxes {
                // As a rod along x.
                body = Body::cuboid(Vector3::new(l, 0.03, 0.03), l);
            }
            let at = Vector3::x() * if self.held { l * (i as f64 + 0.5) } else { 0.0 };
            body.angular_velocity = direction * rate;
            body.velocity = body.angular_velocity.cross(&at);
            scene.add_body(format!("body-{}", i + 1), body.at(at));
        }
        let end = |i: usize, sign: f64| Frame::body(i, Vector3::x() * (sign * 0.5 * l));
        let above = |i: usize| match i {
            0 => Frame::world(Vector3::zeros()),
            _ => end(i - 1, 1.0),
        };
        for i in (0..self.bodies).take_while(|_| self.held) {
            let joint = Spherical {
                frames: [above(i), end(i, -1.0)],
                stretch: RowLaw::RIGID,
            };
            scene.add_constraint(format!("joint-{}", i + 1), Constraint::Spherical(joint), 0);
        }
        scene.validate()?;
        Ok(scene)
    }
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let whirled = Whirled {
        bodies: 2,
        boxes: true,
        held: true,
    };
    Ok(vec![whirled.scene(20.0)?])
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let cases = [
        (1, true, false),
        (1, false, true),
        (1, true, true),
        (2, false, true),
        (2, true, true),
    ];
    let mut cases = cases.to_vec();
    if !quick {
        cases.extend([(12, false, true), (12, true, true)]);
    }
    let mut checks = Vec::new();
    for (bodies, boxes, held) in counted(progress, cases) {
        let whirled = Whirled {
            bodies,
            boxes,
            held,
        };
        let (mut largest, mut notes) = (0.0_f64, Vec::new());
        for rate in RATES {
            let run = Gained::over(whirled.scene(rate)?, StepOptions::default(), 10.0)?;
            let gain = run.largest / run.start.kinetic;
            let redone = format!("{} of 600 steps redone", run.redone);
            let end = run.lost.map_or(redone, |e| e.to_string());
            largest = super::worse(largest, gain);
            notes.push(format!("{rate} rad/s: {gain:.0e}, {end}"));
        }
        let shape = if boxes { "boxes" } else { "rods" };
        let way = if held { "by their end" } else { "free" };
        checks.push(
            Check::off(
                format!("{bodies} {shape}, {way}: energy gained"),
                "none",
                largest,
                "",
                BAR,
            )
            .by("largest over the kinetic energy of the start, 10 s at 1/60 s, 20 … 1000 rad/s")
            .noting(notes.join("; ")),
        );
    }
    Ok(checks.into())
}
