//! H48 anywhere in a cable: segments that merge and split by rule.
//!
//! - A *catenary* at rest is that of fixed segments of the least length, at each of its joints.
//! - A load of 10⁵ segments that a *winch* hoists moves as on fixed segments.
//! - A rope is let down into a *pile* on the ground and pulled taut from both ends, to the tension EA (d − L)/L.
//! - A *bouncing* load swells and ebbs the tension about the one at which segments split: hysteresis leaves them alone.
//! - In all of these each change of kinetic energy is that of its blow, −½ uᵀ K⁻¹ u, and of the pair's coming into line. All
//!   segments of the pile, split and merged in its midst, keep their mass, length and momenta.

use super::winding;
use crate::hard::{DT, GRAVITY, at, farthest, under_gravity, worse};
use crate::options::pick;
use indicatif::ProgressBar;
use nalgebra::{Vector2, Vector3};
use taut_integrator::{Resolved, Stepper};
use taut_measure::pace;
use taut_measure::trajectory::load_position;
use taut_model::scene::resolution::Resolution;
use taut_model::{
    Body, Cable, CableEnd, Collider, CrossSection, Damping, Frame, Material, Mobility, Scene,
    Segments, Shape, Stiffness, Surface,
};
use taut_output::check::{Check, ExperimentError, Outcome};

/// Bars: a catenary's shape over its length, the hoisted load \[m], the tension of the taut rope, the energy of changes over
/// that of the cable, and what a split or merge keeps.
const BARS: [f64; 5] = [1e-4, 1e-3, 1e-3, 1e-10, 1e-12];

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut unforeseen = 0.0;
    let mut checks = vec![catenary(quick, &mut unforeseen)?];
    checks.push(hoisted(pick(quick, [100.0, 20.0]), &mut unforeseen)?);
    let (taut, midst) = piled(&mut unforeseen)?;
    checks.push(taut);
    checks.extend(bouncing()?);
    checks.push(
        Check::within(
            "kinetic energy of all changes above",
            "−½ uᵀ K⁻¹ u and the coming into line",
            format!("{unforeseen:.1e} apart"),
            unforeseen,
            BARS[3],
        )
        .by("largest difference, over the kinetic energy of the scene"),
    );
    checks.push(kept(&midst));
    Ok(checks.into())
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let rule = Some(Resolution::default());
    Ok(vec![
        hanging(32, rule.clone())?,
        winding::hoist(20.0, 1.0, CableEnd::Pinned, rule.clone())?,
        pile(rule)?,
    ])
}

/// Steps, and tells by how much the kinetic energy of changes is not the one foreseen.
fn step(stepper: &mut Stepper, unforeseen: &mut f64) -> Result<Resolved, ExperimentError> {
    let resolved = pace::step(stepper)?.resolved;
    let jump = resolved.jump;
    let apart = (jump.kinetic - jump.blow - jump.moved).abs();
    if apart > 0.0 {
        *unforeseen = worse(*unforeseen, apart / stepper.scene().kinetic_energy());
    }
    Ok(resolved)
}

fn cable(name: &str, ends: [CableEnd; 2], segments: usize, rule: Option<Resolution>) -> Cable {
    Cable {
        segments: Segments::Equal(segments),
        resolution: rule,
        damping: Damping::Time(0.02),
        ..Cable::round(name, &Material::NYLON, 0.01, ends)
    }
}

const SPAN: f64 = 10.0;
const LENGTH: f64 = 12.0;

/// A rope between two points of the same height, in its equilibrium.
fn hanging(segments: usize, rule: Option<Resolution>) -> Result<Scene, ExperimentError> {
    let mut scene = under_gravity("catenary");
    let ends = [0.0, SPAN].map(|x| CableEnd::Pinned(Frame::world(Vector3::x() * x)));
    let depth = 0.5 * (LENGTH * LENGTH - SPAN * SPAN).sqrt();
    scene.add_cable(&Cable {
        points: vec![Vector3::new(0.5 * SPAN, 0.0, -depth)],
        ..cable("rope", ends, segments, rule)
    })?;
    scene.start_in_equilibrium = true;
    Ok(scene)
}

/// The lower ends of all segments of the catenary: length from its start (m), and place.
fn joints(scene: &Scene) -> Vec<(f64, Vector3<f64>)> {
    let (mut along, density) = (0.0, scene.mass() / LENGTH);
    let ends = scene.cables[0].bodies.iter().map(|&body| {
        let length = scene.bodies.mass[body] / density;
        along += length;
        let half = scene.bodies.orientation[body] * Vector3::z() * (-0.5 * length);
        (along, scene.bodies.position[body] + half)
    });
    ends.collect()
}

fn catenary(quick: bool, unforeseen: &mut f64) -> Result<Check, ExperimentError> {
    let segments = 256;
    let rule = Resolution {
        bend: 0.05,
        ..Resolution::default()
    };
    let fixed = Stepper::new(hanging(segments, None)?, at(DT))?;
    let fixed = joints(fixed.scene());
    let mut stepper = Stepper::new(hanging(segments, Some(rule))?, at(DT))?;
    let mut changes = Resolved::default();
    for _ in 0..pick(quick, [2400, 600]) {
        changes += step(&mut stepper, unforeseen)?;
    }
    let least = LENGTH / segments as f64;
    let found = joints(stepper.scene());
    let apart = found.iter().fold(0.0, |worst, (along, place)| {
        let number = (along / least).round() as usize;
        worse(worst, (place - fixed[number - 1].1).norm() / LENGTH)
    });
    Ok(Check::within(
        format!("catenary of {LENGTH} m over {SPAN} m, {segments} segments by rule"),
        "that of fixed segments",
        format!("{apart:.1e}, in {} segments", found.len()),
        apart,
        BARS[0],
    )
    .by("largest distance of a joint over the length")
    .with_note(format!(
        "{} merges, {} splits; bends of 0.05 rad at most",
        changes.merges, changes.splits
    )))
}

fn hoisted(length: f64, unforeseen: &mut f64) -> Result<Check, ExperimentError> {
    let mut run = |rule| -> Result<_, ExperimentError> {
        let (mut places, mut fewest) = (Vec::new(), usize::MAX);
        let scene = winding::hoist(length, 1.0, CableEnd::Pinned, rule)?;
        winding::hoisted(scene, length, |_, stepper| {
            step(stepper, unforeseen)?;
            places.push(load_position(stepper.scene()));
            fewest = fewest.min(stepper.scene().cables[0].bodies.len());
            Ok(())
        })?;
        Ok((places, fewest))
    };
    let (fixed, _) = run(None)?;
    let (ruled, fewest) = run(Some(Resolution::default()))?;
    let apart = farthest(&fixed, &ruled);
    Ok(Check::within(
        format!("{length} → 5 m by a winch, load of 10⁵ segments, segments by rule"),
        "the motion on fixed segments of 1 m",
        format!("{apart:.1e} m apart, {fewest} segments at least"),
        apart,
        BARS[1],
    )
    .by("largest distance of the loads, m"))
}

/// A rope of 6 m whose one end is held 5 cm above the ground, 4.5 m from the other's hook.
fn pile(rule: Option<Resolution>) -> Result<Scene, ExperimentError> {
    let mut scene = under_gravity("pile");
    let surface = Surface {
        friction: 0.4,
        ..Surface::default()
    };
    scene.add_collider(Collider {
        surface,
        ..Collider::new("ground", None, Shape::HalfSpace)
    });
    let hook = Body {
        mobility: Mobility::Driven,
        ..Body::sphere(0.1, 1.0)
    };
    let [low, high] = [Vector3::z() * 0.05, Vector3::new(4.0, 0.0, 4.0)];
    let hook = scene.add_body("hook", hook.at(high));
    scene.load = Some(hook);
    let ends = [
        CableEnd::Pinned(Frame::body(hook, Vector3::zeros())),
        CableEnd::Pinned(Frame::world(low)),
    ];
    scene.add_cable(&Cable {
        collide: Some(surface),
        points: vec![Vector3::new(1.5, 0.3, 1.0)],
        ..cable("rope", ends, 48, rule)
    })?;
    Ok(scene)
}

/// Length of all rods \[m].
fn rods(scene: &Scene) -> f64 {
    let rods = scene.colliders.iter().map(|collider| match collider.shape {
        Shape::Capsule { length, .. } => length,
        _ => 0.0,
    });
    rods.sum()
}

/// The rope let down and pulled taut, and the scene in the midst.
fn piled(unforeseen: &mut f64) -> Result<(Check, Scene), ExperimentError> {
    let rule = Resolution {
        bend: 0.2,
        ..Resolution::default()
    };
    let scene = pile(Some(rule))?;
    let length: f64 = (0..48).filter_map(|k| scene.segment_length(0, k)).sum();
    let rods = rods(&scene);
    let mut stepper = Stepper::new(scene, at(DT))?;
    let mut midst = stepper.scene().clone();
    let (mut most, mut changes) = (0, Resolved::default());
    // Down in 2 s, and up and away until 1 % longer than the rope, where it stays. Laid in a bend, its rods are shorter than
    // it is.
    let low = Vector3::z() * 0.05;
    let up = Vector3::new(3.0, 0.0, 4.0).normalize();
    let down = Vector3::new(4.0, 0.0, 0.5);
    let stretched = low + up * (1.01 * rods);
    for k in 0..900 {
        let velocity = match k {
            0..120 => (down - Vector3::new(4.0, 0.0, 4.0)) / 2.0,
            180..480 => (stretched - down) / 5.0,
            _ => Vector3::zeros(),
        };
        stepper.set_velocity(0, velocity, Vector3::zeros())?;
        changes += step(&mut stepper, unforeseen)?;
        most = most.max(stepper.scene().cables[0].bodies.len());
        if k == 150 {
            midst = stepper.scene().clone();
        }
    }
    let scene = stepper.scene();
    let section = CrossSection::Circle { radius: 0.01 };
    let ea = Stiffness::new(&Material::NYLON, &section).ea;
    let chord = (scene.bodies.position[0] - low).norm();
    let exact = ea * (chord - rods) / length;
    let joints = &scene.cables[0].joints;
    let pulls: Vec<f64> = joints.iter().filter_map(|c| stepper.tension(*c)).collect();
    let mean = pulls.iter().sum::<f64>() / pulls.len() as f64;
    let left = scene.cables[0].bodies.len();
    let check = Check::within(
        "a rope let down in a pile and pulled taut",
        format!("{exact:.1} N"),
        format!("{mean:.1} N, {most} segments, {left} when taut"),
        (mean / exact - 1.0).abs(),
        BARS[2],
    )
    .by("mean tension over EA (d − L)/L, less 1")
    .with_note(format!(
        "{} merges, {} splits",
        changes.merges, changes.splits
    ));
    Ok((check, midst))
}

/// Changes in the last of six seconds of a bounce, by whose tension segments would split and merge.
fn changes_of_bounce(hysteresis: f64, pause: f64) -> Result<usize, ExperimentError> {
    let mut scene = under_gravity("bounce");
    let load = Body::sphere(0.2, 200.0).at(-Vector3::z() * 8.0);
    let load = scene.add_body("load", load);
    let ends = [
        Frame::world(Vector3::zeros()),
        Frame::body(load, Vector3::zeros()),
    ];
    let ends = ends.map(CableEnd::Pinned);
    // c Δt/φ = 0.5 m at the weight of the load.
    let density = cable("", ends, 1, None).density;
    let phase = (200.0 * GRAVITY / density).sqrt() * DT / 0.5;
    let rule = Resolution {
        phase,
        shortest: 0.25,
        hysteresis,
        pause,
        ..Resolution::default()
    };
    scene.add_cable(&Cable {
        damping: Damping::Time(0.0),
        ..cable("rope", ends, 16, Some(rule))
    })?;
    scene.start_in_equilibrium = true;
    let mut stepper = Stepper::new(scene, at(DT))?;
    let mut bodies = stepper.scene().bodies.clone();
    bodies.velocity[0] = Vector3::z() * 0.5;
    stepper.set_state(&bodies, 0.0)?;
    let mut changes = 0;
    for k in 0..360 {
        let resolved = pace::step(&mut stepper)?.resolved;
        if k >= 300 {
            changes += resolved.splits + resolved.merges;
        }
    }
    Ok(changes)
}

fn bouncing() -> Result<Vec<Check>, ExperimentError> {
    let mut checks = Vec::new();
    // In each pause of 0.5 s 16 pairs merge and split at most.
    for (what, hysteresis, pause, most) in [
        ("hysteresis of 2", 2.0, 1e-3, 0.0),
        ("a pause of 0.5 s", 1.0, 0.5, 64.0),
    ] {
        let changes = changes_of_bounce(hysteresis, pause)?;
        let case = format!("{BOUNCE}: {what}");
        let reference = format!("at most {most} changes a second");
        let check = Check::within(case, reference, changes.to_string(), changes as f64, most);
        checks.push(check.by("changes in a second"));
    }
    let restless = changes_of_bounce(1.0, 1e-3)?;
    let check = Check::within(
        format!("{BOUNCE}: no hysteresis, hardly a pause"),
        "more than 64 changes a second",
        restless.to_string(),
        64.0 / restless as f64,
        1.0,
    );
    checks.push(check.by("64 over the changes in a second"));
    Ok(checks)
}

const BOUNCE: &str = "a tension that swells and ebbs about the rule's";

/// Mass, length, momentum and angular momentum of all pairs and halves of a cable, kept.
fn kept(midst: &Scene) -> Check {
    let sums = |scene: &Scene| {
        let segments = winding::segments(scene);
        let angular = segments.angular_momentum(&Vector3::zeros());
        (segments.mass(), rods(scene), segments.momentum(), angular)
    };
    // The rope all but rests: its momenta cancel.
    let bodies = midst.cables[0].bodies.iter().map(|&i| {
        let momentum = midst.bodies.velocity[i] * midst.bodies.mass[i];
        let angular = midst.bodies.position[i].cross(&momentum);
        Vector2::new(momentum.norm(), angular.norm())
    });
    let scale: Vector2<f64> = bodies.sum();
    let (before, mut worst, mut spun) = (sums(midst), 0.0, 0.0);
    for k in 0..midst.cables[0].bodies.len() {
        for splits in [true, false] {
            let mut scene = midst.clone();
            let half = 0.5 * scene.segment_length(0, k).unwrap_or(0.0);
            let done = if splits {
                scene.split_segment((0, k), half, 0.0).is_some()
            } else {
                let merged = scene.merge_segments((0, k), 0.0);
                merged.is_some_and(|of| scene.remove(&[of.body], &[of.joint]).is_ok())
            };
            // The last one has none to merge with.
            if !done && (splits || k + 1 < midst.cables[0].bodies.len()) {
                worst = f64::NAN;
            }
            let after = sums(&scene);
            // Parts share the line of their centres.
            let own = &scene.cables[0].bodies;
            let next = own.get(k + 1).filter(|_| splits);
            let axis = match next {
                Some(next) => scene.bodies.position[*next] - scene.bodies.position[own[k]],
                None => scene.bodies.orientation[own[k]] * Vector3::z(),
            };
            let axis = axis.normalize();
            let turned = (after.3 - before.3) / scale.y;
            let across = turned - axis * axis.dot(&turned);
            spun = worse(spun, turned.norm());
            for change in [
                (after.0 / before.0 - 1.0).abs(),
                (after.1 / before.1 - 1.0).abs(),
                (after.2 - before.2).norm() / scale.x,
                across.norm(),
            ] {
                worst = worse(worst, change);
            }
        }
    }
    Check::within(
        "each segment of the pile split, each pair merged: mass, length, momentum, angular momentum",
        "kept",
        format!("{worst:.1e}"),
        worst,
        BARS[4],
    )
    .by("largest change, over the sum of the segments' own; angular momentum across the axis")
    .with_note(format!(
        "{spun:.1e} of the angular momentum about the axis of bent pairs is not: a thin rod would have to spin"
    ))
}
