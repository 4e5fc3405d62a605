//! Conservation by the schemes: the swing of a load over a minute, the energy over a million steps,
//! the angular momentum of a free cable.

use crate::study::question::*;
use nalgebra::{Matrix4, UnitQuaternion, Vector3, Vector4};
use std::f64::consts::TAU;
use taut_integrator::{GeometricStiffness, Scheme, StepError, StepOptions};
use taut_measure::trajectory::{load_position, steps_in};
use taut_model::{
    Bodies, Body, Constraint, Cosserat, Frame, HoistParams, RowLaw, Scene, Spherical, Stiffness,
    hanging_axes,
};

pub(crate) const STUDY: Study = Study {
    name: "energy",
    question: question!("energy", FUNCTIONS),
    run: |matches, reporter| study(Asked::read(matches).quick, reporter.cases),
    ..study::PLAIN
};

const FUNCTIONS: Functions = &[("change", Text(change))];

fn study(quick: bool, cases: &Cases) -> Result<Found, ExperimentError> {
    let config = Config::new(quick);
    let rows = run(&config, cases)?;
    let setting = |scheme: &Scheme| {
        let alpha = GeometricStiffness::inertia(scheme.default_alpha());
        format!("{scheme} K {alpha}")
    };
    Ok(Found {
        settings: set([
            ("segments of swings", config.segments.to_string()),
            ("their load/segment", numbers(&config.ratios)),
            ("schemes", list(&config.schemes, setting)),
            ("Δt", step(DT)),
            ("finer step", step(DT / config.finer as f64)),
            ("amplitudes at", format!("{} s", numbers(&MOMENTS))),
            ("steps of bands", number(config.steps as f64)),
            ("Δt of spins", list(&config.spin_dts, |dt| step(*dt))),
            ("simulated spins", seconds(config.spin_time)),
        ]),
        text: text_tables(&rows, &config),
        rows,
        ..Found::default()
    })
}

/// Δt where nothing else is said \[s].
const DT: f64 = 1.0 / 60.0;

/// The anchor of swings and bands moves so far \[m], within so long \[s].
const MOVE: f64 = 0.5;
const MOVE_TIME: f64 = 2.0;

/// Times at which the amplitudes are taken \[s].
const MOMENTS: [f64; 2] = [5.0, 60.0];

/// Steps of a window of energies: 20 s at 1/60 s, three swings of a cable of 10 m.
const WINDOW: usize = 1200;

/// Segments, mass ratio, scheme of a band; free ones are guarded and leave their plane.
type Band = (usize, f64, Scheme, bool);

#[derive(Debug, Clone)]
pub struct Config {
    /// Segments and mass ratios load/segment of the swings.
    segments: usize,
    ratios: Vec<f64>,
    /// Swings at Δt and, with the first scheme, at Δt/`finer`.
    finer: usize,
    /// Schemes of swings and spins, each with its own geometric stiffness.
    pub schemes: Vec<Scheme>,
    bands: Vec<Band>,
    pub steps: usize,
    /// Time steps of the free cable, descending, and its simulated time \[s].
    spin_dts: Vec<f64>,
    spin_time: f64,
}

impl Config {
    /// The whole sweep; quick one ratio, six segments, 20 000 steps.
    pub fn new(quick: bool) -> Self {
        let third = Scheme::default();
        let mut bands = vec![
            (24, 1e2, third, true),
            (24, 1e4, third, true),
            (24, 1e6, third, true),
            (6, 1e2, third, true),
            (6, 1e4, third, true),
            (6, 1e4, third, false),
            (6, 1e4, Scheme::Spook, false),
            (24, 1e4, Scheme::Spook, false),
            (6, 1e4, Scheme::Spook, true),
        ];
        bands.retain(|band| !quick || band.0 == 6);
        let rates: &[f64] = pick(quick, [&[60.0, 120.0, 240.0, 480.0], &[60.0, 120.0]]);
        Self {
            segments: pick(quick, [24, 6]),
            ratios: pick(quick, [vec![1e2, 1e4, 1e6], vec![1e4]]),
            finer: pick(quick, [8, 4]),
            schemes: vec![third, Scheme::Spook, Scheme::LinearlyImplicit],
            bands,
            steps: pick(quick, [1_000_000, 20_000]),
            spin_dts: rates.iter().map(|rate| 1.0 / rate).collect(),
            spin_time: pick(quick, [10.0, 2.0]),
        }
    }
}

/// One run, of a list of the results.
#[derive(Debug)]
enum Task {
    /// Mass ratio, scheme, Δt \[s].
    Swing(f64, Scheme, f64),
    Band(Band),
    Spin(Scheme, f64),
}

/// Runs the three experiments, in parallel, each run a case: lists of rows.
pub fn run(config: &Config, cases: &Cases) -> Result<Value, ExperimentError> {
    // The longest runs come first.
    let mut tasks: Vec<Task> = config.bands.iter().copied().map(Task::Band).collect();
    for &ratio in &config.ratios {
        let fine = DT / config.finer as f64;
        tasks.push(Task::Swing(ratio, config.schemes[0], fine));
        tasks.extend(config.schemes.iter().map(|&s| Task::Swing(ratio, s, DT)));
    }
    for &scheme in &config.schemes {
        tasks.extend(config.spin_dts.iter().map(|&dt| Task::Spin(scheme, dt)));
    }
    let rows = cases.parallel("runs", &tasks, |task| match *task {
        Task::Swing(ratio, scheme, dt) => swing(config.segments, ratio, scheme, dt),
        Task::Band(task) => band(task, config.steps),
        Task::Spin(scheme, dt) => spin(scheme, dt, config.spin_time),
    })?;
    let (mut swings, mut bands, mut spins) = (Vec::new(), Vec::new(), Vec::new());
    for (task, row) in tasks.iter().zip(rows.all()?) {
        match task {
            Task::Swing(..) => swings.push(row),
            Task::Band(..) => bands.push(row),
            Task::Spin(..) => spins.push(row),
        }
    }
    for group in swings.chunk_by_mut(|a, b| a["mass_ratio"] == b["mass_ratio"]) {
        let (fine, others) = group.split_at_mut(1);
        for row in others {
            let over = kept(row).zip(kept(&fine[0])).map(|(a, b)| a / b - 1.0);
            row["change_over_fine"] = json!(over);
        }
    }
    for i in 1..spins.len() {
        let [before, after] = [i - 1, i].map(|i| &spins[i]);
        let point = |row: &Value| Some([row["drift"].as_f64()?, row["dt"].as_f64()?]);
        let same = before["scheme"] == after["scheme"];
        let both = point(before).zip(point(after)).filter(|_| same);
        spins[i]["order"] = json!(both.map(|(a, b)| motions::order(a, b)));
    }
    Ok(json!({ "swings": swings, "bands": bands, "spins": spins }))
}

/// The late amplitude over the early one.
fn kept(row: &Value) -> Option<f64> {
    let [early, late] = ["early_m", "late_m"].map(|when| row["amplitudes"][when].as_f64());
    Some(late? / early?)
}

fn options(scheme: Scheme, dt: f64, guarded: bool) -> StepOptions {
    motions::step(scheme, scheme.default_alpha(), dt, guarded)
}

/// The scene of swings and bands: a hanging cable whose anchor moves; it leaves its plane where it is seeded.
fn moved(segments: usize, mass_ratio: f64, seeded: bool) -> HoistParams {
    HoistParams {
        segments,
        mass_ratio,
        seed: u64::from(seeded),
        move_x: MOVE,
        move_duration: MOVE_TIME,
        ..HoistParams::default()
    }
}

/// The amplitude of the load's swing, early and late; none where the run was lost.
fn swing(segments: usize, mass_ratio: f64, scheme: Scheme, dt: f64) -> Result<Value, StepError> {
    let params = moved(segments, mass_ratio, true);
    let options = options(scheme, dt, true);
    let length_over_gravity = (params.length + params.exact_elongation()) / params.gravity;
    let rate = length_over_gravity.sqrt().recip();
    let steps = ((MOMENTS[1] + 2.0 * TAU / rate) / dt).ceil() as usize + 1;
    let stiffness = options.stiffness.to_string();
    let (mut x, mut redone) = (Vec::with_capacity(steps), 0);
    let scene = params.hanging_equilibrium()?;
    let failure = motions::run(scene, options, steps, |stepper, report| {
        redone += usize::from(report.redone);
        x.push(load_position(stepper.scene()).x - MOVE);
        Ok(())
    })?;
    let at = |moment| Some(pendulum(&x, dt, moment, rate)?.amplitude);
    let [early, late] = MOMENTS.map(|moment| at(moment).filter(|_| failure.is_none()));
    let amplitudes = early.zip(late);
    Ok(json!({
        "mass_ratio": mass_ratio,
        "scheme": scheme.to_string(),
        "stiffness": stiffness,
        "dt": dt,
        "amplitudes": amplitudes.map(|(early, late)| json!({ "early_m": early, "late_m": late })),
        // late/early over that of the run with the smallest time step, minus 1: what the scheme does, apart from what
        // the motion does by itself.
        "change_over_fine": null,
        "redone": redone,
        "failure": failure,
    }))
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pendulum {
    /// Its amplitude \[m].
    pub amplitude: f64,
    /// Root mean square of what is of other frequencies \[m].
    pub rest: f64,
}

/// The pendulum's motion in a swing sampled every `dt` (s): that of the sinusoid which fits two periods
/// from time `from` (s) on best, frequency included, so that the cable's own modes do not count. `rate` (rad/s) is a first
/// guess of its frequency. `None` where there are not enough samples. Sample i belongs to the time (i + 1) `dt`.
pub fn pendulum(x: &[f64], dt: f64, from: f64, rate: f64) -> Option<Pendulum> {
    let first = ((from / dt).round() as usize).saturating_sub(1);
    let count = (2.0 * TAU / (rate * dt)).round() as usize;
    let x = x.get(first..first.checked_add(count)?)?;
    let middle = 0.5 * (count as f64 - 1.0);
    let mut rate = rate;
    let mut fit = Vector4::zeros();
    // Gauss-Newton on x ≈ c + a cos ωt + b sin ωt, t from the window's middle; the first passes find a and b.
    for _ in 0..FIT_PASSES {
        let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
        for (i, x) in x.iter().enumerate() {
            let t = (i as f64 - middle) * dt;
            let (sin, cos) = (rate * t).sin_cos();
            let slope = t * (fit[2] * cos - fit[1] * sin);
            let gradient = Vector4::new(1.0, cos, sin, slope);
            normal += gradient * gradient.transpose();
            right += gradient * *x;
        }
        // Without an amplitude there is nothing to say about the frequency.
        if normal.m44 == 0.0 {
            normal.m44 = 1.0;
        }
        fit = normal.lu().solve(&right)?;
        rate += fit[3];
    }
    let rest = x.iter().enumerate().map(|(i, x)| {
        let (sin, cos) = (rate * (i as f64 - middle) * dt).sin_cos();
        (x - fit[0] - fit[1] * cos - fit[2] * sin).powi(2)
    });
    Some(Pendulum {
        amplitude: fit[1].hypot(fit[2]),
        rest: (rest.sum::<f64>() / count as f64).sqrt(),
    })
}

const FIT_PASSES: usize = 12;

/// The energy of a swing over very many steps after the anchor has stopped, over the load's largest kinetic energy in the
/// first window.
fn band((segments, mass_ratio, scheme, free): Band, steps: usize) -> Result<Value, StepError> {
    let scene = moved(segments, mass_ratio, free).hanging_equilibrium()?;
    let options = options(scheme, DT, free);
    let stiffness = options.stiffness.to_string();
    let still = steps_in(MOVE_TIME, DT) + 1;
    let (mut step, mut redone, mut scale) = (0, 0, 0.0_f64);
    let mut energies = Vec::with_capacity(steps);
    let failure = motions::run(scene, options, still + steps, |stepper, report| {
        redone += usize::from(report.redone);
        step += 1;
        if step > still {
            let energy = stepper.energy();
            if energies.len() < WINDOW {
                scale = scale.max(energy.kinetic);
            }
            energies.push(energy.total());
        }
        Ok(())
    })?;
    let windows = || energies.chunks_exact(WINDOW);
    let width = |window: &[f64]| {
        let [least, most] = [f64::min, f64::max].map(|of| window.iter().copied().reduce(of));
        Some((most? - least?) / scale)
    };
    // Relative to the first energy of each window, which keeps its digits.
    let mean = |window: &[f64]| {
        let sum: f64 = window.iter().map(|e| e - window[0]).sum();
        window[0] + sum / WINDOW as f64
    };
    let first = windows().next().map_or(f64::NAN, mean);
    let means: Vec<f64> = windows().map(|w| (mean(w) - first) / scale).collect();
    let part = means.len().div_ceil(10);
    let mean = |means: &[f64]| means.iter().sum::<f64>() / means.len() as f64;
    let drift = || mean(&means[means.len() - part..]) - mean(&means[..part]);
    Ok(json!({
        "segments": segments,
        "mass_ratio": mass_ratio,
        "scheme": scheme.to_string(),
        "stiffness": stiffness,
        "guarded": free,
        "seeded": free,
        // Those while the anchor moved not counted.
        "steps": energies.len(),
        // Largest minus smallest energy of the first and the last window.
        "first_band": windows().next().and_then(width),
        "last_band": windows().last().and_then(width),
        // Mean of the last tenth of the windows minus that of the first tenth.
        "drift": (means.len() >= 2).then(drift),
        // Mean of each window minus that of the first.
        "means": means,
        "redone": redone,
        "failure": failure,
    }))
}

const RODS: usize = 12;
/// Length \[m] and mass \[kg] of a rod, and of a ball.
const LENGTH: f64 = 0.5;
const ROD: f64 = 1.0;
const BALL: f64 = 100.0;
/// Spin of the whole about y \[rad/s].
const SPIN: f64 = 1.0;
/// Angular velocities of the rods besides, at most \[rad/s].
const PERTURBATION: f64 = 1e-2;

/// Twelve rods of a steel cable (EA = 2·10⁷ N) between two balls of 100 kg, without gravity, spinning at 1 rad/s about y,
/// its joints open by what the spin's tension opens them; the rods turn by up to 10⁻² rad/s besides.
fn free_cable() -> Scene {
    let stiffness = Stiffness {
        ea: 2e7,
        ei: 159.0,
        gj: 122.0,
    };
    let depth = |i: usize| LENGTH * (i as f64 - 0.5 * (RODS as f64 - 1.0));
    let reach = 0.5 * LENGTH * RODS as f64;
    // Tension at the upper end of rod i: what holds all that is above it on its circle.
    let tension = |i: usize| {
        let rods: f64 = (0..i.min(RODS - i)).map(|k| ROD * depth(k).abs()).sum();
        SPIN * SPIN * (BALL * reach + rods)
    };
    let gap = |i: usize| {
        let length = if i == 0 || i == RODS {
            0.5 * LENGTH
        } else {
            LENGTH
        };
        tension(i) * length / stiffness.ea
    };
    let whole: f64 = (0..=RODS).map(gap).sum();
    let mut scene = Scene::new("free cable");
    let mut z = reach + 0.5 * whole;
    let add = |scene: &mut Scene, name: String, body: Body, z: f64, extra: Vector3<f64>| {
        let position = Vector3::new(0.0, 0.0, z);
        let spin = Vector3::new(0.0, SPIN, 0.0);
        let mut body = body.at(position).turned(UnitQuaternion::identity());
        body.velocity = spin.cross(&position);
        body.angular_velocity = spin + extra;
        scene.add_body(name, body);
    };
    let ball = Body::sphere(0.15, BALL);
    add(&mut scene, "upper".into(), ball, z, Vector3::zeros());
    for i in 0..RODS {
        z -= gap(i) + 0.5 * LENGTH;
        let phase = i as f64;
        let extra = Vector3::new((3.0 * phase).cos(), (5.0 * phase).sin(), phase.cos());
        let rod = Body::rod(LENGTH, 0.0056, ROD);
        add(
            &mut scene,
            format!("rod-{}", i + 1),
            rod,
            z,
            extra * PERTURBATION,
        );
        z -= 0.5 * LENGTH;
    }
    z -= gap(RODS);
    add(&mut scene, "lower".into(), ball, z, Vector3::zeros());
    join(&mut scene, &stiffness);
    scene
}

fn join(scene: &mut Scene, stiffness: &Stiffness) {
    let half = Vector3::new(0.0, 0.0, 0.5 * LENGTH);
    let end = RowLaw::new(0.5 * LENGTH / stiffness.ea, 0.0);
    let at = |body, point| Frame::body(body, point).with_axes(hanging_axes());
    let ball = |frames| {
        Constraint::Spherical(Spherical {
            frames,
            stretch: end,
        })
    };
    scene.add_constraint("upper", ball([at(0, Vector3::zeros()), at(1, half)]), 0);
    let law = stiffness.joint_law(LENGTH, 0.0);
    for i in 1..RODS {
        let joint = Cosserat::new([at(i, -half), at(i + 1, half)], law);
        scene.add_constraint(format!("joint-{i}"), Constraint::Cosserat(joint), 0);
    }
    let lower = ball([at(RODS, -half), at(RODS + 1, Vector3::zeros())]);
    scene.add_constraint("lower", lower, 0);
}

/// Angular momentum about the centre of mass.
fn momentum(scene: &Scene) -> Vector3<f64> {
    let bodies = &scene.bodies;
    let terms = bodies.position.iter().zip(&bodies.mass);
    let centre = terms.map(|(x, m)| x * *m).sum::<Vector3<f64>>() / scene.mass();
    scene.angular_momentum(&centre)
}

/// The velocities of `bodies` become the means of theirs and of those of `after`: half a step later, at the time of the
/// positions.
fn to_middle(bodies: &mut Bodies, after: &Bodies) {
    for i in 0..bodies.len() {
        bodies.velocity[i] = 0.5 * (bodies.velocity[i] + after.velocity[i]);
        bodies.angular_velocity[i] = 0.5 * (bodies.angular_velocity[i] + after.angular_velocity[i]);
    }
}

/// A free cable that spins for `time` seconds: nothing turns it, so its angular momentum is to stay.
///
/// Between two heavy balls the cable is taut by the spin. A scheme that treats the tension's lever arms in any way but
/// exactly loses angular momentum at some order in Δt, and this is that order.
fn spin(scheme: Scheme, dt: f64, time: f64) -> Result<Value, StepError> {
    let options = options(scheme, dt, false);
    let stiffness = options.stiffness.to_string();
    let (mut before, mut drift, mut is_first) = (free_cable(), 0.0_f64, true);
    let start = momentum(&before);
    let failure = motions::run(free_cable(), options, steps_in(time, dt), |stepper, _| {
        // The stepper puts the first velocities half a step back only within its first step.
        if scheme.is_staggered() && !std::mem::take(&mut is_first) {
            to_middle(&mut before.bodies, &stepper.scene().bodies);
        }
        drift = drift.max((momentum(&before) - start).norm() / start.norm());
        before.clone_from(stepper.scene());
        if drift.is_nan() || drift > 1.0 {
            return Err("more angular momentum than there was".to_owned());
        }
        Ok(())
    })?;
    Ok(json!({
        "scheme": scheme.to_string(),
        "stiffness": stiffness,
        "dt": dt,
        // Largest |L − L₀|/|L₀| about the centre of mass.
        "drift": failure.is_none().then_some(drift),
        "order": null,
        "failure": failure,
    }))
}

/// By how much the amplitude has changed, over the early one.
fn change(row: &Row) -> String {
    let [early, late] =
        ["early", "late"].map(|when| number_of(row, &format!("amplitudes_{when}_m")));
    let change = early.zip(late).map(|(early, late)| late / early - 1.0);
    change.map_or("-".to_owned(), |change| format!("{change:.1e}"))
}

/// The three tables, each below what it holds.
pub fn text_tables(data: &Value, config: &Config) -> String {
    let [early, late] = MOMENTS;
    let [swings, bands, spins] =
        ["swings", "bands", "spins"].map(|name| STUDY.sheet(name).text(data));
    format!(
        "Swing amplitude of the load, fitted to two periods from {early} s and from {late} s on; anchor moved by {MOVE} m\n\
         in {MOVE_TIME} s, guard on. `vs fine` is the change over that of the default scheme with 1/{} of the time step.\n\
         {swings}\n\
         Energy over {} steps at Δt = 1/{:.0} s, over the swing's energy: width of the band in its first and last {} s,\n\
         drift of its middle (last tenth against first tenth).\n\
         {bands}\n\
         Angular momentum of a free, taut, spinning cable about its centre of mass: largest |ΔL|/|L| over {} s, and its\n\
         order in Δt against the row above.\n\
         {spins}",
        config.finer,
        config.steps,
        1.0 / DT,
        WINDOW as f64 * DT,
        config.spin_time
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_integrator::Stepper;

    #[test]
    fn the_amplitude_of_a_pendulum_is_found_among_other_motions() {
        let dt = 1.0 / 60.0;
        let sample = |i: u32| {
            let t = dt * f64::from(i);
            0.3 * (0.97 * t + 0.4).cos() + 0.01 + 1e-3 * (7.3 * t).sin()
        };
        let x: Vec<f64> = (1..2400).map(sample).collect();
        for from in [0.0, 1.234, 5.0, 20.0] {
            let found = pendulum(&x, dt, from, 1.0).unwrap().amplitude;
            assert!((found / 0.3 - 1.0).abs() < 2e-4, "{found}");
        }
        assert_eq!(pendulum(&x, dt, 33.0, 1.0), None);
        assert_eq!(pendulum(&x, dt, 1e9, 1.0), None);
    }

    /// The spin opens the joints by what they are open by: without perturbation nothing but the spin moves.
    #[test]
    fn the_free_cable_spins_in_equilibrium() {
        let mut scene = free_cable();
        for i in 0..scene.bodies.len() {
            scene.bodies.angular_velocity[i] = Vector3::new(0.0, SPIN, 0.0);
        }
        let options = motions::step(Scheme::Spook, 0.0, 1e-3, false);
        let mut stepper = Stepper::new(scene, options).unwrap();
        let distance = |s: &Scene| (s.bodies.position[0] - s.bodies.position[RODS + 1]).norm();
        let start = distance(stepper.scene());
        let whole = start - LENGTH * RODS as f64;
        assert!(whole > 5e-5);
        for _ in 0..1000 {
            stepper.step().unwrap();
            assert!((distance(stepper.scene()) - start).abs() < 0.05 * whole);
        }
    }
}
