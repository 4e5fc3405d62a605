//! The stability map: up to which mass ratio a swing survives, for schemes, geometric stiffness, joints, segments and
//! materials.
//!
//! Every ratio of a grid is run by itself, none is inferred from its neighbours: instability is not monotone in the
//! ratio. A run starts from the hanging equilibrium with angular velocities out of the plane, its anchor is moved
//! aside, and it is *stable* if for its whole time all steps are finite, no joint opens by more than a segment's length
//! beyond the widest gap of the hanging cable, and no body turns by more than π/4 in a step
//! ([`taut_ground::trajectory::simulate`]).

mod study;
mod tables;

pub(crate) use study::STUDY;
pub use tables::text_tables;

use crate::cases::Cases;
use serde::Serialize;
use std::f64::consts::PI;
use taut_ground::trajectory::{Failure, simulate};
use taut_integrator::{GeometricStiffness, Guard, Scheme, StepError, StepOptions, Stepper};
use taut_model::{CrossSection, Hoist, HoistParams, JointKind, Material, SceneError, Stiffness};
use taut_output::check::ExperimentError;
use taut_output::notation::number;

/// Material and size of a cable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cable {
    /// Cable of [`HoistParams::default`]: 10 m, EA = 2·10⁷ N, segments of 1 kg.
    Hoist,
    /// A solid square one of 1 m, with the mass of its material.
    Square {
        /// One of [`Material::NAMES`].
        material: &'static str,
        /// Area of the cross-section \[m²].
        area: f64,
    },
}

impl Cable {
    /// Name in tables.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Hoist => "hoist: 10 m, EA 2·10⁷ N, 1 kg a segment".to_owned(),
            Self::Square { material, area } => {
                format!("{material}: 1 m, square of {} m²", number(*area))
            }
        }
    }

    /// The hanging cable with its load, nothing driven.
    ///
    /// # Errors
    /// A material that is not known.
    pub fn params(
        &self,
        segments: usize,
        mass_ratio: f64,
        joint: JointKind,
    ) -> Result<HoistParams, SceneError> {
        let hoist = HoistParams {
            segments,
            mass_ratio,
            joint,
            ..HoistParams::default()
        };
        let Self::Square { material, area } = *self else {
            return Ok(hoist);
        };
        let law = Material::named(material).ok_or_else(|| SceneError::UnknownName {
            what: "material",
            name: material.to_owned(),
            known: Material::NAMES.map(str::to_owned).to_vec(),
        })?;
        let side = area.sqrt();
        let Stiffness { ea, ei, gj } = Stiffness::new(&law, &CrossSection::Square { side });
        let length = 1.0;
        Ok(HoistParams {
            length,
            segment_mass: Some(law.density * area * length / segments as f64),
            // The disc with the square's moments of inertia.
            radius: Some(side / 3.0_f64.sqrt()),
            ea: Some(ea),
            ei: Some(ei),
            gj: Some(gj),
            ..hoist
        })
    }
}

/// One cell of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    pub cable: Cable,
    pub segments: usize,
    pub joint: JointKind,
    pub scheme: Scheme,
    pub stiffness: GeometricStiffness,
    pub guarded: bool,
    /// Nothing disturbs the motion out of its plane.
    pub planar: bool,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// The cells.
    pub cases: Vec<Case>,
    /// Mass ratios load/segment, ascending.
    pub ratios: Vec<f64>,
    /// Simulated time \[s].
    pub time: f64,
    /// Δt \[s].
    pub dt: f64,
}

/// Areas of the paper's cables \[m²]: that of its experiments, and that of the entry of its Table II which can be read,
/// ζ = 12/A = 10³/m².
const AREA: f64 = 1e-4;
const READABLE_AREA: f64 = 0.012;

const MATERIALS: [&str; 3] = ["steel", "nylon", "rubber"];

const JOINTS: [JointKind; 3] = [JointKind::Spherical, JointKind::Cosserat, JointKind::Paper];

const ALPHAS: [f64; 6] = [0.0, 0.25, 0.3, 0.4, 0.5, 1.0];

/// Ratios 10^(k/`per_decade`) up to 10⁶.
fn grid(per_decade: i32) -> Vec<f64> {
    let ratio = |k| 10.0_f64.powf(f64::from(k) / f64::from(per_decade));
    (0..=6 * per_decade).map(ratio).collect()
}

fn square(material: &'static str, area: f64) -> Cable {
    Cable::Square { material, area }
}

impl Default for Config {
    /// 30 s for each ratio 10^(k/4) of each cell.
    fn default() -> Self {
        let cables = MATERIALS.map(|m| square(m, AREA));
        let cables: Vec<Cable> = [Cable::Hoist].into_iter().chain(cables).collect();
        let stiffness: Vec<_> = ALPHAS.map(GeometricStiffness::inertia).to_vec();
        let mut cases = product(&cables, &[6, 24], &JOINTS, &stiffness);
        let cosserat = [JointKind::Cosserat];
        cases.extend(product(&[Cable::Hoist], &[100], &cosserat, &stiffness));
        for segments in [6, 24] {
            cases.extend(JOINTS.map(|joint| guarded(segments, joint)));
            cases.extend(cables.iter().map(|&cable| planar(cable, segments)));
        }
        cases.push(Case {
            joint: JointKind::Cosserat,
            planar: false,
            ..planar(square("steel", READABLE_AREA), 6)
        });
        cases.push(planar(square("steel", READABLE_AREA), 6));
        Self {
            cases,
            ratios: grid(4),
            time: 30.0,
            dt: 1.0 / 60.0,
        }
    }
}

impl Config {
    /// 5 s, whole decades, six segments.
    #[must_use]
    pub fn quick() -> Self {
        let cables = [Cable::Hoist, square("steel", AREA)];
        let stiffness = [0.0, 0.5].map(GeometricStiffness::inertia);
        let joints = [JointKind::Spherical, JointKind::Cosserat];
        let mut cases = product(&cables, &[6], &joints, &stiffness);
        cases.push(guarded(6, JointKind::Cosserat));
        cases.extend(cables.map(|cable| planar(cable, 6)));
        Self {
            cases,
            ratios: grid(1),
            time: 5.0,
            dt: 1.0 / 60.0,
        }
    }
}

fn product(
    cables: &[Cable],
    segments: &[usize],
    joints: &[JointKind],
    stiffness: &[GeometricStiffness],
) -> Vec<Case> {
    let mut cases = Vec::new();
    for &cable in cables {
        for &segments in segments {
            for &joint in joints {
                for scheme in Scheme::KINDS {
                    cases.extend(stiffness.iter().map(|&stiffness| Case {
                        cable,
                        segments,
                        joint,
                        scheme,
                        stiffness,
                        guarded: false,
                        planar: false,
                    }));
                }
            }
        }
    }
    cases
}

/// The default options, guard and all, on the hoist.
fn guarded(segments: usize, joint: JointKind) -> Case {
    let StepOptions {
        scheme, stiffness, ..
    } = StepOptions::default();
    Case {
        cable: Cable::Hoist,
        segments,
        joint,
        scheme,
        stiffness,
        guarded: true,
        planar: false,
    }
}

/// The paper's own step and joint, which hold in exactly planar motion only.
fn planar(cable: Cable, segments: usize) -> Case {
    Case {
        cable,
        segments,
        joint: JointKind::Paper,
        scheme: Scheme::LinearlyImplicit,
        stiffness: GeometricStiffness::Off,
        guarded: false,
        planar: true,
    }
}

/// Result for a cell.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    pub cable: String,
    pub segments: usize,
    /// `spherical`, `cosserat`, `paper`.
    pub joint: String,
    pub scheme: String,
    /// The geometric stiffness: `off`, α.
    pub stiffness: String,
    /// The guard was on.
    pub guarded: bool,
    /// Nothing disturbed the motion out of its plane.
    pub planar: bool,
    /// Ratios tried.
    pub ratios: Vec<f64>,
    /// Which of them are stable.
    pub stable: Vec<bool>,
    /// The largest ratio up to which every one is stable; `None` where the first is not.
    pub stable_to: Option<f64>,
    /// The largest stable ratio of all.
    pub highest: Option<f64>,
    /// When the first unstable ratio failed \[s], and how.
    pub first_failure: Option<Failure>,
    /// [`predicted_limit`] for the linearly implicit step without geometric stiffness.
    pub predicted: Option<f64>,
}

/// The ratio load/segment at which linear theory has the linearly implicit step without geometric stiffness lose a
/// straight cable under the tension T = M g: the least over the wave numbers k ≥ π/N that fit into N segments,
/// x = sin²(k/2), of
///
/// ```text
/// T ≤ m l/Δt² (1 − x)/x + 4 I/(l Δt²) + 4 c_b x/l,    c_b = YI/l
/// ```
///
/// Without bend rows (`bending` false) the last term is missing and x = 1 decides.
#[must_use]
pub fn predicted_limit(hoist: &Hoist, gravity: f64, dt: f64, bending: bool) -> f64 {
    let (m, l, r) = (hoist.segment_mass, hoist.segment_length, hoist.radius);
    let inertia = m * (3.0 * r * r + l * l) / 12.0;
    let translation = m * l / (dt * dt);
    let rotation = 4.0 * inertia / (l * dt * dt);
    let bend = if bending {
        4.0 * hoist.stiffness.ei / (l * l)
    } else {
        0.0
    };
    let longest = (0.5 * PI / hoist.segments as f64).sin().powi(2);
    let x = (translation / bend).sqrt().clamp(longest, 1.0);
    let tension = translation * (1.0 - x) / x + rotation + bend * x;
    tension / (gravity * m)
}

/// Runs every ratio of every cell, in parallel, each a case.
///
/// # Errors
/// Unsound scenes or options. An unstable run is not an error.
pub fn run(config: &Config, cases: &Cases) -> Result<Vec<Record>, ExperimentError> {
    let ratios = &config.ratios;
    let each = |case| ratios.iter().map(move |&ratio| (case, ratio));
    let runs: Vec<(&Case, f64)> = config.cases.iter().flat_map(each).collect();
    let fails = |(case, ratio): &(&Case, f64)| fails(config, case, *ratio);
    let failures = cases.parallel("runs", &runs, fails)?.all()?;
    let cells = config.cases.iter().zip(failures.chunks(ratios.len()));
    let records = cells.map(|(case, failures)| record(config, case, failures));
    Ok(records.collect::<Result<_, _>>()?)
}

/// How and when a run becomes unstable.
fn fails(config: &Config, case: &Case, ratio: f64) -> Result<Option<Failure>, StepError> {
    let params = HoistParams {
        seed: u64::from(!case.planar),
        seed_rate: 1e-3,
        move_x: 0.5,
        move_duration: 2.0,
        ..case.cable.params(case.segments, ratio, case.joint)?
    };
    let hoist = params.resolve()?;
    let widest = hoist.gaps(params.gravity).fold(0.0, f64::max);
    let options = StepOptions {
        dt: config.dt,
        scheme: case.scheme,
        stiffness: case.stiffness,
        guard: case.guarded.then(Guard::default),
        ..StepOptions::default()
    };
    let mut stepper = Stepper::new(params.hanging_equilibrium()?, options)?;
    let limit = hoist.segment_length + widest;
    Ok(simulate(&mut stepper, config.time, limit, |_| ()).failure)
}

fn record(config: &Config, case: &Case, failures: &[Option<Failure>]) -> Result<Record, StepError> {
    let params = case.cable.params(case.segments, 1.0, case.joint)?;
    let explicit = case.scheme == Scheme::LinearlyImplicit
        && case.stiffness == GeometricStiffness::Off
        && !case.guarded;
    let predicted = if explicit {
        let bending = case.joint != JointKind::Spherical;
        let hoist = params.resolve()?;
        Some(predicted_limit(&hoist, params.gravity, config.dt, bending))
    } else {
        None
    };
    let ratios = &config.ratios;
    let stable: Vec<bool> = failures.iter().map(Option::is_none).collect();
    let unbroken = stable.iter().take_while(|&&s| s).count();
    let highest = stable.iter().rposition(|&s| s);
    Ok(Record {
        cable: case.cable.name(),
        segments: case.segments,
        joint: joint_name(case.joint).to_owned(),
        scheme: case.scheme.to_string(),
        stiffness: case.stiffness.to_string(),
        guarded: case.guarded,
        planar: case.planar,
        ratios: ratios.clone(),
        stable,
        stable_to: unbroken.checked_sub(1).map(|i| ratios[i]),
        highest: highest.map(|i| ratios[i]),
        first_failure: failures.iter().flatten().next().cloned(),
        predicted,
    })
}

fn joint_name(joint: JointKind) -> &'static str {
    match joint {
        JointKind::Spherical => "spherical",
        JointKind::Cosserat => "cosserat",
        JointKind::Paper => "paper",
        _ => "other",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limit(cable: Cable, segments: usize) -> f64 {
        let params = cable.params(segments, 1.0, JointKind::Cosserat).unwrap();
        predicted_limit(&params.resolve().unwrap(), 9.81, 1.0 / 60.0, true)
    }

    #[test]
    fn the_limit_is_that_of_linear_theory() {
        // The least is at k below π/N for steel: at x = sin²(π/2N).
        let steel = |n: f64, x: f64| {
            let (m, l) = (7850.0 * 1e-4 / n, 1.0 / n);
            let bend = 2e11 * 1e-8 / 12.0 / l;
            let inertia = m * (l * l + 1e-4) / 12.0;
            let tension =
                m * l * 3600.0 * (1.0 - x) / x + 4.0 * inertia / l * 3600.0 + 4.0 * bend * x / l;
            tension / (9.81 * m)
        };
        for n in [6, 24, 100] {
            let found = limit(square("steel", AREA), n);
            let least = (1..=n).map(|k| {
                let half = PI * k as f64 / (2 * n) as f64;
                steel(n as f64, half.sin().powi(2))
            });
            let least = least.fold(f64::INFINITY, f64::min);
            // The least over real k is a little below that over whole half waves.
            assert!(
                found <= least && found > 0.95 * least,
                "{n}: {found} {least}"
            );
        }
        assert!((limit(square("nylon", AREA), 6) - 643.6).abs() < 0.5);
        let params = Cable::Hoist.params(24, 1.0, JointKind::Spherical).unwrap();
        let hoist = params.resolve().unwrap();
        // 4 I/(m l Δt² g) = l/(3 Δt² g) for a thin rod.
        let thin = hoist.segment_length * 3600.0 / (3.0 * 9.81);
        let spherical = predicted_limit(&hoist, 9.81, 1.0 / 60.0, false);
        assert!((spherical / thin - 1.0).abs() < 1e-3);
    }

    #[test]
    fn cells_tell_holes_from_limits() {
        let cell = |stable: [bool; 4]| {
            let config = Config {
                ratios: vec![1.0, 10.0, 100.0, 1000.0],
                ..Config::quick()
            };
            let failure = Failure {
                time: 0.0,
                reason: String::new(),
            };
            let failures = stable.map(|s| (!s).then(|| failure.clone()));
            let record = record(&config, &config.cases[0], &failures).unwrap();
            let data = crate::study::data(&[record]).unwrap();
            tables::largest(&taut_output::row::rows_of(&data, "")[0])
        };
        assert_eq!(cell([true; 4]), "≥3.00");
        assert_eq!(cell([false; 4]), "<0");
        assert_eq!(cell([true, true, false, false]), "1.00");
        assert_eq!(cell([true, false, true, false]), "0.00(2.00)");
        assert_eq!(cell([false, false, false, true]), "<0(≥3.00)");
    }

    #[test]
    fn the_square_has_its_own_inertia_and_mass() {
        let params = square("nylon", 4e-4)
            .params(10, 2.0, JointKind::Cosserat)
            .unwrap();
        let scene = params.build().unwrap();
        let m = 1150.0 * 4e-4 * 0.1;
        let inertia = scene.bodies.inertia[0];
        assert!((scene.bodies.mass[0] - m).abs() < 1e-15);
        assert!((inertia.m33 - m * 4e-4 / 6.0).abs() < 1e-15);
        assert!((inertia.m11 - m * (4e-4 + 0.01) / 12.0).abs() < 1e-15);
    }
}
