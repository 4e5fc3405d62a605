//! The stability map: up to which mass ratio a swing survives, for schemes, geometric stiffness, joints, segments and
//! materials.

use crate::study::question::*;
use std::f64::consts::PI;
use taut_integrator::{GeometricStiffness, Scheme, StepError, StepOptions, Stepper};
use taut_measure::trajectory::{Failure, simulate};
use taut_model::{CrossSection, Hoist, HoistParams, JointKind, Material, Stiffness};

pub(crate) const STUDY: Study = Study {
    name: "stability",
    question: question!("stability", FUNCTIONS),
    run: |matches, reporter| study(&Asked::read(matches), reporter.cases),
    ..study::PLAIN
};

const FUNCTIONS: Functions = &[
    ("stiffness", Text(stiffness)),
    ("largest", Text(largest)),
    (
        "map_takes",
        Holds(|row| !is(row, "guarded") && !is(row, "planar") && !readable(row)),
    ),
    ("guarded", Holds(|row| is(row, "guarded"))),
    ("motion", Text(motion)),
    (
        "theory_takes",
        Holds(|row| number_of(row, "predicted").is_some()),
    ),
];

fn study(asked: &Asked, cases: &Cases) -> Result<Found, ExperimentError> {
    let mut config = Config::new(asked.quick);
    let needs = "it must be at least one step";
    asked.time(&mut config.time, DT, 1, needs)?;
    let rows = run(&config, cases)?;
    let segments = distinct(config.cases.iter().map(|c| c.segments));
    Ok(Found {
        settings: set([
            ("cells", config.cases.len().to_string()),
            ("segments", counts(&segments)),
            ("load/segment", numbers(&config.ratios)),
            ("Δt", step(DT)),
            ("simulated", seconds(config.time)),
        ]),
        text: text_tables(&rows, &config),
        rows,
        ..Found::default()
    })
}

/// A solid square cable of 1 m, with the mass of its material.
#[derive(Debug, Clone, Copy)]
struct Square {
    name: &'static str,
    material: Material,
    /// Area of the cross-section \[m²].
    area: f64,
}

/// Areas of the paper's cables \[m²]: that of its experiments, and that of the entry of its Table II which can be read,
/// ζ = 12/A = 10³/m².
const AREA: f64 = 1e-4;
const READABLE_AREA: f64 = 0.012;

const fn square(name: &'static str, material: Material, area: f64) -> Square {
    Square {
        name,
        material,
        area,
    }
}

const STEEL: Square = square("steel", Material::STEEL, AREA);
const NYLON: Square = square("nylon", Material::NYLON, AREA);
const RUBBER: Square = square("rubber", Material::RUBBER, AREA);
const READABLE: Square = square("steel", Material::STEEL, READABLE_AREA);

/// One cell of the map.
#[derive(Debug, Clone, Copy)]
struct Case {
    /// `None`: the cable of [`HoistParams::default`], 10 m, EA = 2·10⁷ N, segments of 1 kg.
    cable: Option<Square>,
    segments: usize,
    joint: JointKind,
    scheme: Scheme,
    /// Weight of the geometric stiffness.
    alpha: f64,
    guarded: bool,
    /// Nothing disturbs the motion out of its plane.
    planar: bool,
}

impl Case {
    fn cable(&self) -> String {
        self.cable.map_or_else(
            || "hoist: 10 m, EA 2·10⁷ N, 1 kg a segment".to_owned(),
            |cable| {
                let area = number(cable.area);
                format!("{}: 1 m, square of {area} m²", cable.name)
            },
        )
    }

    /// The hanging cable with its load, nothing driven.
    fn params(&self, mass_ratio: f64) -> HoistParams {
        let segments = self.segments;
        let hoist = self.cable.map_or_else(HoistParams::default, |cable| {
            square_cable(&cable.material, cable.area, 1.0, segments)
        });
        HoistParams {
            segments,
            mass_ratio,
            joint: self.joint,
            ..hoist
        }
    }
}

/// A hoist with a solid square cable of that area (m²) and length (m).
pub(crate) fn square_cable(
    material: &Material,
    area: f64,
    length: f64,
    segments: usize,
) -> HoistParams {
    let side = area.sqrt();
    let Stiffness { ea, ei, gj } = Stiffness::new(material, &CrossSection::Square { side });
    HoistParams {
        segments,
        length,
        segment_mass: Some(material.density * area * length / segments as f64),
        // The disc with the square's moments of inertia.
        radius: Some(side / 3.0_f64.sqrt()),
        ea: Some(ea),
        ei: Some(ei),
        gj: Some(gj),
        ..HoistParams::default()
    }
}

const DT: f64 = 1.0 / 60.0;

#[derive(Debug, Clone)]
pub struct Config {
    cases: Vec<Case>,
    /// Mass ratios load/segment, ascending.
    ratios: Vec<f64>,
    /// Simulated time \[s].
    time: f64,
}

const JOINTS: [JointKind; 3] = [JointKind::Spherical, JointKind::Cosserat, JointKind::Paper];

const ALPHAS: [f64; 6] = [0.0, 0.25, 0.3, 0.4, 0.5, 1.0];

/// Ratios 10^(k/`per_decade`) up to 10⁶.
fn grid(per_decade: i32) -> Vec<f64> {
    let ratio = |k| 10.0_f64.powf(f64::from(k) / f64::from(per_decade));
    (0..=6 * per_decade).map(ratio).collect()
}

impl Config {
    /// 30 s for each ratio 10^(k/4) of each cell; quick 5 s, whole decades, six segments.
    pub fn new(quick: bool) -> Self {
        Self {
            cases: if quick { few() } else { all() },
            ratios: grid(pick(quick, [4, 1])),
            time: pick(quick, [30.0, 5.0]),
        }
    }
}

fn few() -> Vec<Case> {
    let cables = [None, Some(STEEL)];
    let joints = [JointKind::Spherical, JointKind::Cosserat];
    let mut cases = product(&cables, &[6], &joints, &[0.0, 0.5]);
    cases.push(guarded(6, JointKind::Cosserat));
    cases.extend(cables.map(|cable| planar(cable, 6)));
    cases
}

fn all() -> Vec<Case> {
    let cables = [None, Some(STEEL), Some(NYLON), Some(RUBBER)];
    let mut cases = product(&cables, &[6, 24], &JOINTS, &ALPHAS);
    cases.extend(product(&[None], &[100], &[JointKind::Cosserat], &ALPHAS));
    for segments in [6, 24] {
        cases.extend(JOINTS.map(|joint| guarded(segments, joint)));
        cases.extend(cables.map(|cable| planar(cable, segments)));
    }
    let readable = planar(Some(READABLE), 6);
    cases.push(Case {
        joint: JointKind::Cosserat,
        planar: false,
        ..readable
    });
    cases.push(readable);
    cases
}

fn product(
    cables: &[Option<Square>],
    segments: &[usize],
    joints: &[JointKind],
    alphas: &[f64],
) -> Vec<Case> {
    let mut cases = Vec::new();
    for &cable in cables {
        for &segments in segments {
            for &joint in joints {
                for scheme in Scheme::KINDS {
                    cases.extend(alphas.iter().map(|&alpha| Case {
                        joint,
                        scheme,
                        alpha,
                        planar: false,
                        ..planar(cable, segments)
                    }));
                }
            }
        }
    }
    cases
}

/// The default options, guard and all, on the hoist.
fn guarded(segments: usize, joint: JointKind) -> Case {
    let default = StepOptions::default();
    Case {
        joint,
        scheme: default.scheme,
        alpha: default.stiffness.alpha(),
        guarded: true,
        planar: false,
        ..planar(None, segments)
    }
}

/// The paper's own step and joint, which hold in exactly planar motion only.
fn planar(cable: Option<Square>, segments: usize) -> Case {
    Case {
        cable,
        segments,
        joint: JointKind::Paper,
        scheme: Scheme::LinearlyImplicit,
        alpha: 0.0,
        guarded: false,
        planar: true,
    }
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

/// Runs every ratio of every cell, in parallel, each a case: a row a cell.
pub fn run(config: &Config, cases: &Cases) -> Result<Value, ExperimentError> {
    let ratios = &config.ratios;
    let each = |case| ratios.iter().map(move |&ratio| (case, ratio));
    let runs: Vec<(&Case, f64)> = config.cases.iter().flat_map(each).collect();
    let fails = |(case, ratio): &(&Case, f64)| fails(config.time, case, *ratio);
    let failures = cases.parallel("runs", &runs, fails)?.all()?;
    let cells = config.cases.iter().zip(failures.chunks(ratios.len()));
    let rows = cells.map(|(case, failures)| record(ratios, case, failures));
    Ok(rows.collect::<Result<_, _>>()?)
}

/// How and when a run becomes unstable.
fn fails(time: f64, case: &Case, ratio: f64) -> Result<Option<Failure>, StepError> {
    let params = HoistParams {
        seed: u64::from(!case.planar),
        seed_rate: 1e-3,
        move_x: 0.5,
        move_duration: 2.0,
        ..case.params(ratio)
    };
    let hoist = params.resolve()?;
    let widest = hoist.gaps(params.gravity).fold(0.0, f64::max);
    let options = motions::step(case.scheme, case.alpha, DT, case.guarded);
    let mut stepper = Stepper::new(params.hanging_equilibrium()?, options)?;
    let limit = hoist.segment_length + widest;
    Ok(simulate(&mut stepper, time, limit, |_| ()).failure)
}

fn record(ratios: &[f64], case: &Case, failures: &[Option<Failure>]) -> Result<Value, StepError> {
    let explicit = case.scheme == Scheme::LinearlyImplicit && case.alpha == 0.0 && !case.guarded;
    let params = case.params(1.0);
    let hoist = params.resolve()?;
    let bending = case.joint != JointKind::Spherical;
    let predicted = || predicted_limit(&hoist, params.gravity, DT, bending);
    let stable: Vec<bool> = failures.iter().map(Option::is_none).collect();
    let unbroken = stable.iter().take_while(|&&s| s).count();
    let highest = stable.iter().rposition(|&s| s);
    Ok(json!({
        "cable": case.cable(),
        "segments": case.segments,
        "joint": case.joint,
        "scheme": case.scheme.to_string(),
        "stiffness": GeometricStiffness::inertia(case.alpha).to_string(),
        "guarded": case.guarded,
        "planar": case.planar,
        "ratios": ratios,
        "stable": stable,
        // The largest ratio up to which every one is stable, and the largest stable one of all.
        "stable_to": unbroken.checked_sub(1).map(|i| ratios[i]),
        "highest": highest.map(|i| ratios[i]),
        "first_failure": failures.iter().flatten().next(),
        "predicted": explicit.then(predicted),
    }))
}

/// True for the cable of the paper's readable entry.
fn readable(row: &Row) -> bool {
    text_of(row, "cable") == planar(Some(READABLE), 6).cable()
}

fn stiffness(row: &Row) -> String {
    match text_of(row, "stiffness") {
        "off" => "no K".to_owned(),
        weight => weight.to_owned(),
    }
}

fn motion(row: &Row) -> String {
    if is(row, "planar") {
        "planar".to_owned()
    } else {
        "seeded".to_owned()
    }
}

/// log₁₀ of the largest ratio up to which all are stable; in brackets the largest stable one where it is another.
fn largest(row: &Row) -> String {
    let ratios = row.get("ratios").and_then(Value::as_array);
    let cap = ratios.and_then(|all| all.last()?.as_f64());
    let exponent = |r: f64| {
        let end = if Some(r) == cap { "≥" } else { "" };
        format!("{end}{:.2}", r.log10())
    };
    match (number_of(row, "stable_to"), number_of(row, "highest")) {
        (None, None) => "<0".to_owned(),
        (None, Some(high)) => format!("<0({})", exponent(high)),
        (Some(low), Some(high)) if high > low => format!("{}({})", exponent(low), exponent(high)),
        (Some(low), _) => exponent(low),
    }
}

/// The map, a table for each cable and number of segments, then the guard's, then the theory's.
pub fn text_tables(data: &Value, config: &Config) -> String {
    format!(
        "Stability map: log₁₀ of the largest load/segment mass ratio up to which every ratio of the grid is stable for\n\
         {} s at Δt = 1/60 s; in brackets the largest stable one where some below it are not. Guard off. The paper's\n\
         Table II is that of `taut paper table2`.\n\
         {}{}{}",
        config.time,
        STUDY.sheet("map").text(data),
        STUDY.sheet("guarded").text(data),
        STUDY.sheet("theory").text(data),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(cable: Option<Square>, segments: usize) -> Case {
        Case {
            joint: JointKind::Cosserat,
            ..planar(cable, segments)
        }
    }

    fn limit(cable: Square, segments: usize) -> f64 {
        let params = cell(Some(cable), segments).params(1.0);
        predicted_limit(&params.resolve().unwrap(), 9.81, DT, true)
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
            let found = limit(STEEL, n);
            let least = (1..=n).map(|k| {
                let half = PI * k as f64 / (2 * n) as f64;
                steel(n as f64, half.sin().powi(2))
            });
            let least = least.fold(f64::INFINITY, f64::min);
            // The least over real k is a little below that over whole half waves.
            let holds = found <= least && found > 0.95 * least;
            assert!(holds, "{n}: {found} {least}");
        }
        assert!((limit(NYLON, 6) - 643.6).abs() < 0.5);
        let params = cell(None, 24).params(1.0);
        let hoist = params.resolve().unwrap();
        // 4 I/(m l Δt² g) = l/(3 Δt² g) for a thin rod.
        let thin = hoist.segment_length * 3600.0 / (3.0 * 9.81);
        let spherical = predicted_limit(&hoist, 9.81, DT, false);
        assert!((spherical / thin - 1.0).abs() < 1e-3);
    }

    #[test]
    fn cells_tell_holes_from_limits() {
        let largest = |stable: [bool; 4]| {
            let failure = Failure {
                time: 0.0,
                reason: String::new(),
            };
            let failures = stable.map(|s| (!s).then(|| failure.clone()));
            let row = record(&[1.0, 10.0, 100.0, 1000.0], &cell(None, 6), &failures).unwrap();
            largest(row.as_object().unwrap())
        };
        assert_eq!(largest([true; 4]), "≥3.00");
        assert_eq!(largest([false; 4]), "<0");
        assert_eq!(largest([true, true, false, false]), "1.00");
        assert_eq!(largest([true, false, true, false]), "0.00(2.00)");
        assert_eq!(largest([false, false, false, true]), "<0(≥3.00)");
    }

    #[test]
    fn the_square_has_its_own_inertia_and_mass() {
        let cable = square("nylon", Material::NYLON, 4e-4);
        let params = cell(Some(cable), 10).params(2.0);
        let scene = params.build().unwrap();
        let m = 1150.0 * 4e-4 * 0.1;
        let inertia = scene.bodies.inertia[0];
        assert!((scene.bodies.mass[0] - m).abs() < 1e-15);
        assert!((inertia.m33 - m * 4e-4 / 6.0).abs() < 1e-15);
        assert!((inertia.m11 - m * (4e-4 + 0.01) / 12.0).abs() < 1e-15);
    }
}
