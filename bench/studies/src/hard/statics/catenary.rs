//! H07, H07d, H08: a cable between two points of one height, without bending stiffness; references in [`exact`].

pub(super) mod exact;

use self::exact::{EA, Hanging, LENGTH, SPAN, WEIGHT, chain, continuum};
use crate::hard::{DT, counted, solvers, together};
use crate::paper::specimens::{largest, settle};
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use taut_ground::choice::Choice;
use taut_integrator::Stepper;
use taut_model::{Body, Constraint, Distance, Frame, RowLaw, Scene, SceneError, Spherical};
use taut_output::check::{Check, ExperimentError, Outcome};

/// A number of a hanging chain, with its name and unit.
type Measured = (&'static str, &'static str, fn(&Hanging) -> f64);

const MEASURES: [Measured; 3] = [
    ("H", "N", |h| h.horizontal),
    ("tension at the ends", "N", |h| h.end_tension),
    ("sag", "m", |h| h.sag),
];

const BAR: f64 = 1e-8;
/// Bar of the elastic cable of 64 rods against the continuum.
const CURVE_BAR: f64 = 1e-5;

/// A chain of `n` links.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Kind {
    name: &'static str,
    /// \[N].
    ea: f64,
    /// Links with masses at the joints, else rods.
    particles: bool,
    /// Bar against the exact discrete answer.
    bar: f64,
}

pub(super) const RODS: Kind = Kind {
    name: "rods",
    ea: f64::INFINITY,
    particles: false,
    bar: BAR,
};
pub(super) const PARTICLES: Kind = Kind {
    name: "particles",
    particles: true,
    bar: 1e-10,
    ..RODS
};
const ELASTIC: Kind = Kind {
    name: "elastic rods",
    ea: EA,
    ..RODS
};

/// A chain at rest in the shape of a V, as long as the cable, over its span (n even).
pub(super) fn scene(n: usize, kind: &Kind) -> Result<Scene, SceneError> {
    const GRAVITY: f64 = 10.0;
    let half = 0.5 * LENGTH;
    let depth = (half * half - 0.25 * SPAN * SPAN).sqrt();
    let node = |i: usize| {
        let s = i as f64 / n as f64;
        let down = 1.0 - (2.0 * s - 1.0).abs();
        Vector3::new(SPAN * s, 0.0, -depth * down)
    };
    let h = LENGTH / n as f64;
    let mass = WEIGHT * h / GRAVITY;
    let mut scene = Scene::new("catenary");
    scene.gravity = -Vector3::z() * GRAVITY;
    let right = Vector3::x() * SPAN;
    if kind.particles {
        for i in 1..n {
            scene.add_body(format!("particle-{i}"), Body::particle(mass).at(node(i)));
        }
        let at = |i: usize| match i {
            0 => Frame::world(Vector3::zeros()),
            i if i == n => Frame::world(right),
            i => Frame::body(i - 1, Vector3::zeros()),
        };
        for i in 0..n {
            let link = Distance {
                frames: [at(i), at(i + 1)],
                length: h,
                law: RowLaw::RIGID,
                transverse: true,
            };
            scene.add_constraint(format!("link-{i}"), Constraint::Distance(link), 0);
        }
    } else {
        for i in 0..n {
            let (a, b) = (node(i), node(i + 1));
            let turn = UnitQuaternion::rotation_between(&Vector3::z(), &(b - a));
            let rod = Body::rod(h, 0.02, mass).at(0.5 * (a + b));
            scene.add_body(
                format!("rod-{}", i + 1),
                rod.turned(turn.unwrap_or_default()),
            );
        }
        let half = Vector3::z() * (0.5 * h);
        for j in 0..=n {
            let a = match j {
                0 => Frame::world(Vector3::zeros()),
                _ => Frame::body(j - 1, half),
            };
            let b = if j == n {
                Frame::world(right)
            } else {
                Frame::body(j, -half)
            };
            let length = if j == 0 || j == n { 0.5 * h } else { h };
            let ball = Spherical {
                frames: [a, b],
                stretch: RowLaw::new(length / kind.ea, 0.0),
            };
            scene.add_constraint(format!("joint-{j}"), Constraint::Spherical(ball), 0);
        }
    }
    scene.load = Some((n - 1) / 2);
    scene.validate()?;
    Ok(scene)
}

/// A scene at rest: the distance of its bodies from the exact chain's over L, and its measures as one step of `choice`
/// finds the forces.
fn measured(
    rest: &Scene,
    choice: &Choice,
    particles: bool,
    nodes: &[Vector3<f64>],
) -> Result<(f64, Hanging), ExperimentError> {
    let mut stepper = Stepper::new(rest.clone(), choice.plain_options(DT))?;
    stepper.step()?;
    let bodies = &stepper.scene().bodies;
    let exact = |i: usize| {
        if particles {
            nodes[2 * i + 1]
        } else {
            0.5 * (nodes[2 * i] + nodes[2 * i + 1])
        }
    };
    let places = bodies.position.iter().enumerate();
    let off = largest(places.map(|(i, x)| (x - exact(i)).norm() / LENGTH));
    // Ends of the rods, places of the particles.
    let half = if particles {
        Vector3::zeros()
    } else {
        Vector3::z() * (LENGTH / nodes.len() as f64)
    };
    let turned = bodies.position.iter().zip(&bodies.orientation);
    let depth = turned.map(|(x, turn)| (turn * half).z.abs() - x.z);
    let rows = stepper.linearized().row_range(0);
    let mu: Vec<f64> = stepper.multipliers()[rows].iter().map(|m| m / DT).collect();
    let force = if particles {
        // Along the link, from the support to the first particle.
        let link = bodies.position[0].normalize();
        link * mu[0]
    } else {
        Vector3::new(mu[0], mu[1], mu[2])
    };
    let hanging = Hanging {
        horizontal: force.x.hypot(force.y),
        end_tension: force.norm(),
        sag: depth.fold(0.0, f64::max),
    };
    Ok((off, hanging))
}

/// One kind of chain with `n` links, its forces found by each of `choices`.
fn checks_of(kind: &Kind, n: usize, choices: &[Choice]) -> Result<Vec<Check>, ExperimentError> {
    let rest = settle(scene(n, kind)?)?;
    let (nodes, exact) = chain(n, kind.ea, kind.particles);
    let curve = continuum(kind.ea);
    let mut found = Vec::new();
    for choice in choices {
        let result = measured(&rest, choice, kind.particles, &nodes)?;
        found.push((choice.family(), result));
    }
    let mut checks = Vec::new();
    let shapes = found.iter().map(|(solver, (off, _))| {
        let check = Check::off("", "the exact chain", *off, "L", kind.bar);
        let check = check.by("largest distance of a body from its place, over L");
        (solver.clone(), check.algebraic())
    });
    checks.extend(together(
        &format!("{}, N = {n}: shape", kind.name),
        shapes.collect(),
    ));
    for (what, unit, measure) in MEASURES {
        let (discrete, limit) = (measure(&exact), measure(&curve));
        let own = found.iter().map(|(solver, (_, hanging))| {
            let check = Check::relative("", [discrete, measure(hanging)], unit, kind.bar)
                .by("relative to the exact chain")
                .noting(format!("curve {limit:.9} {unit}"))
                .algebraic()
                .space_part((discrete / limit - 1.0).abs());
            (solver.clone(), check)
        });
        let case = format!("{}, N = {n}: {what} [{unit}]", kind.name);
        checks.extend(together(&case, own.collect()));
    }
    Ok(checks)
}

/// H07, H07d.
pub(super) fn family(
    kind: &Kind,
    quick: bool,
    progress: &ProgressBar,
) -> Result<Outcome, ExperimentError> {
    let counts: &[usize] = if quick { &[4, 16] } else { &[4, 8, 16, 32, 64] };
    let mut checks = Vec::new();
    for (k, &n) in counted(progress, counts.iter().enumerate()) {
        // All solvers where there are few links.
        let choices = if k == 0 {
            solvers()
        } else {
            solvers()[..1].to_vec()
        };
        checks.extend(checks_of(kind, n, &choices)?);
    }
    let errors: Vec<(usize, f64)> = counts
        .iter()
        .map(|&n| {
            let exact = chain(n, kind.ea, kind.particles).1;
            (n, exact.sag / continuum(kind.ea).sag - 1.0)
        })
        .collect();
    checks.extend(super::order(&format!("{}: sag", kind.name), &errors));
    Ok(checks.into())
}

/// H08.
pub(super) fn elastic(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut outcome = family(&ELASTIC, quick, progress)?;
    let curve = continuum(EA);
    let direct = &solvers()[0];
    let mut found = Vec::new();
    for n in [32, 64] {
        let rest = settle(scene(n, &ELASTIC)?)?;
        let nodes = chain(n, EA, false).0;
        found.push(measured(&rest, direct, false, &nodes)?.1);
    }
    for (what, unit, measure) in MEASURES {
        let [coarse, fine] = [measure(&found[0]), measure(&found[1])];
        let limit = measure(&curve);
        let exact = measure(&chain(64, EA, false).1);
        let check = Check::relative(
            format!("N = 64 against the curve: {what}"),
            [limit, fine],
            unit,
            CURVE_BAR,
        )
        .by("relative to the elastic catenary")
        .algebraic_part((fine / exact - 1.0).abs())
        .space_part((exact / limit - 1.0).abs());
        let of_chain = (fine / exact - 1.0).abs() <= BAR;
        let needed = 64.0 * ((fine / limit - 1.0).abs() / CURVE_BAR).sqrt();
        outcome.checks.push(check.limited(
            of_chain,
            format!(
                "the exact chain of 64 straight rods is that far from the curve; at \
                 second order it takes {needed:.0}"
            ),
        ));
        let limit_of = (4.0 * fine - coarse) / 3.0;
        let check = Check::relative(
            format!("N = 32 and 64, extrapolated: {what}"),
            [limit, limit_of],
            unit,
            CURVE_BAR,
        );
        let check = check.by("relative; (4 x₆₄ − x₃₂)/3, exact for second order");
        outcome.checks.push(check);
    }
    Ok(outcome)
}

pub(super) fn scenes_of_elastic() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![scene(4, &ELASTIC)?])
}
