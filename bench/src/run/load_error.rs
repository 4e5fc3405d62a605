//! The estimate of the load's error, for people: how large it is, of what it is made, and what lessens it where it is large.
//!
//! Errors of the time step and of the linear algebra are those of a motion, and large beside it. A load at rest has none: there
//! the scene's size is what they are compared with. The shape of the segments is wrong in motion and at rest alike, so that
//! its error is always compared with the scene's size.

use super::Summary;
use nalgebra::Vector3;
use taut_integrator::{ErrorEstimate, ErrorPart};
use taut_model::{Frame, Scene};

/// Part of the extent of a motion beyond which its error is reported as not small.
const OF_MOTION: f64 = 0.1;

/// Part of the scene's size beyond which the shape of the segments is reported as wrong, and any
/// error of a load at rest.
const OF_SIZE: f64 = 1e-3;

/// Part of the scene's size below which nothing moves and nothing is wrong: no length of a scene is given more exactly.
const NOTHING: f64 = 1e-6;

/// The diagonal of the box around the bodies, the points that hold them and their shapes, at time `t` (s) \[m].
pub(super) fn size(scene: &Scene, t: f64) -> f64 {
    let bodies = &scene.bodies;
    let point = |frame: &Frame| frame.resolve(bodies, t).point();
    let held = scene
        .constraints
        .iter()
        .flat_map(taut_model::Constraint::frames);
    let mut corners: Option<[Vector3<f64>; 2]> = None;
    let mut take = |x: Vector3<f64>, around: f64| {
        let around = Vector3::repeat(around);
        let [low, high] = corners.unwrap_or([x; 2]);
        corners = Some([low.inf(&(x - around)), high.sup(&(x + around))]);
    };
    bodies.position.iter().for_each(|x| take(*x, 0.0));
    held.for_each(|frame| take(point(frame), 0.0));
    for collider in &scene.colliders {
        let reach = collider.shape.reach();
        if let Some(body) = collider.body.filter(|_| reach.is_finite()) {
            let at = bodies.orientation[body] * collider.position;
            take(bodies.position[body] + at, reach);
        }
    }
    corners.map_or(0.0, |[low, high]| (high - low).norm())
}

/// The largest part of an error that is large, and beside what.
fn beyond(error: &ErrorEstimate, s: &Summary) -> Option<(ErrorPart, String)> {
    let nothing = NOTHING * s.size;
    let motion = error.time + error.algebra;
    // A load that stays where it is has no motion to be wrong.
    let (most, beside) = if s.extent > nothing {
        let most = (OF_MOTION * s.extent).max(nothing);
        (most, format!("a tenth of its motion of {}", mm(s.extent)))
    } else {
        let beside = "a thousandth of the scene's size, of a load at rest";
        (OF_SIZE * s.size, beside.to_owned())
    };
    let moved = if error.time >= error.algebra {
        ErrorPart::Time
    } else {
        ErrorPart::Algebra
    };
    let of_motion = (motion > most).then_some((moved, beside));
    if error.segments <= OF_SIZE * s.size || (of_motion.is_some() && error.segments < motion) {
        return of_motion;
    }
    let beside = "a thousandth of the scene's size".to_owned();
    Some((ErrorPart::Segments, beside))
}

/// Advice against a part of the error.
fn cure(part: ErrorPart, s: &Summary) -> &'static str {
    let backend: Result<taut_solver::Backend, _> = s.backend.parse();
    match part {
        ErrorPart::Segments => "more segments lessen it, smaller steps do not",
        ErrorPart::Algebra if backend.is_ok_and(|b| b.is_iterative()) => {
            "a direct solver or more `iterations=` lessen it"
        }
        ErrorPart::Algebra => "`--refine` or another solver lessen it",
        _ => "smaller steps lessen it: `--substeps` or `--dt`",
    }
}

fn mm(x: f64) -> String {
    format!("{:.1e} mm", 1e3 * x)
}

/// The row of the summary, where an estimate is asked for.
pub(super) fn summary(s: &Summary) -> Option<(&'static str, String)> {
    let error = s.error?;
    let text = if error.lost {
        "unknown: the coarse run of longer steps was lost".to_owned()
    } else if error.compared == 0 {
        format!(
            "unknown: {} step{} made, and none was compared with a longer one",
            s.steps,
            if s.steps == 1 { " was" } else { "s were" }
        )
    } else {
        let parts = format!(
            "at most about {}: time step {}, linear algebra {}, segments' shape {}",
            mm(error.total()),
            mm(error.time),
            mm(error.algebra),
            mm(error.segments)
        );
        match beyond(&error, s) {
            Some((part, beside)) => format!("{parts}; over {beside}: {}", cure(part, s)),
            None => parts,
        }
    };
    Some(("load error", text))
}
