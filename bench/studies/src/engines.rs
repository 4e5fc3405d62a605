//! Whole engines on the hoist and on the ground: what one frame of 1/60 s costs, and how wrong the motion is.

mod leapfrog;
mod ours;
mod search;

use crate::study::question::*;
use nalgebra::Vector3;
use search::{Outcome, frames};
use std::fmt::Write;
use taut_integrator::StepError;
use taut_measure::engine::contact_scenes::{self, Kind, Known, Places};
use taut_measure::engine::motion::{self, Converged, FRAME, Motion};
use taut_measure::engine::{Engine, Frame, Setting};
use taut_measure::trajectory::steps_in;
use taut_model::HoistParams;

pub(crate) const STUDY: Study = Study {
    name: "engines",
    question: question!("engines", FUNCTIONS),
    run: |matches, reporter| study(&Asked::read(matches), reporter.cases),
    ..study::PLAIN
};

const FUNCTIONS: Functions = &[("within", Holds(|row| is(row, "within")))];

fn study(asked: &Asked, cases: &Cases) -> Result<Found, ExperimentError> {
    let mut config = Config::new(asked.quick);
    asked.segments(&mut config.segments);
    asked.ratios(&mut config.ratios)?;
    let needs = "it must be at least one frame of 1/60 s";
    asked.time(&mut config.time, FRAME, 1, needs)?;
    let rows = run(&config, cases)?;
    Ok(Found {
        settings: set([
            ("segments", counts(&config.segments)),
            ("load/segment", numbers(&config.ratios)),
            ("swing from", format!("{ANGLE} rad")),
            ("frame", step(FRAME)),
            ("simulated", seconds(config.time)),
            ("error within", format!("{} of the length", config.bar)),
            ("ratios on the ground", numbers(&config.ground)),
        ]),
        text: text(&rows, &config),
        rows,
        ..Found::default()
    })
}

/// Angle that the swing starts at \[rad].
const ANGLE: f64 = 0.3;

/// How long the cable rests, the second half of which counts \[s].
const REST: f64 = 2.0;

struct Config {
    segments: Vec<usize>,
    ratios: Vec<f64>,
    /// Simulated time of the swing \[s].
    time: f64,
    /// Errors that a baseline's setting has to keep, over the cable's length.
    bar: f64,
    /// Settings whose frame takes longer are not searched any further, on the hoist and on the ground \[ns].
    longest_ns: [f64; 2],
    /// Mass ratios of the stack and of the dragged load.
    ground: Vec<f64>,
}

impl Config {
    fn new(quick: bool) -> Self {
        Self {
            segments: pick(quick, [vec![24, 100], vec![24]]),
            ratios: vec![1e3, 1e5],
            time: pick(quick, [6.5, 2.0]),
            bar: 0.01,
            // Beyond a frame's own time an engine does not keep up.
            longest_ns: pick(quick, [[1e9 * FRAME, 4e6], [1e6, 5e5]]),
            ground: vec![1.0, 1e3, 1e5],
        }
    }
}

/// Runs the sweep: of each cable, a case, and of each scene on the ground, one engine after the other, then the
/// times of all rows in turns.
fn run(config: &Config, cases: &Cases) -> Result<Value, ExperimentError> {
    let over_ratios = |&n: &usize| config.ratios.iter().map(move |&ratio| (n, ratio));
    let cables: Vec<(usize, f64)> = config.segments.iter().flat_map(over_ratios).collect();
    let rows = cases.in_turn("engines", &cables, |&(segments, ratio)| {
        on_hoist(config, segments, ratio)
    })?;
    // One box is not heavier than another.
    let ratios = |kind: Kind| match kind {
        Kind::Slide => vec![1.0],
        _ => config.ground.clone(),
    };
    let over_ratios = |kind: Kind| ratios(kind).into_iter().map(move |ratio| (kind, ratio));
    let scenes: Vec<(Kind, f64)> = Kind::ALL.into_iter().flat_map(over_ratios).collect();
    let ground = cases.in_turn("ground", &scenes, |&(kind, ratio)| {
        on_ground(config, kind, ratio)
    })?;
    Ok(json!({ "records": rows.all()?.concat(), "ground": ground.all()?.concat() }))
}

/// All engines that are compiled in; ours come first, and the first of their settings is the default.
fn engines() -> Vec<Engine> {
    let engines = [ours::on_hoist(), leapfrog::engine()].into_iter();
    #[cfg(feature = "rapier")]
    let engines = engines.chain(taut_baselines::rapier::engines());
    engines.collect()
}

fn engines_on_ground() -> Vec<Engine<Known, Places>> {
    let engines = std::iter::once(ours::on_ground());
    #[cfg(feature = "rapier")]
    let engines = engines.chain([taut_baselines::rapier::on_ground()]);
    engines.collect()
}

/// Names of the errors on the hoist: the largest difference of the elongation at rest from the analytic one in the second
/// half, and the largest distance of the swinging load from the reference, both over the length.
const HUNG: [&str; 2] = ["elongation_error", "load_error"];

/// Names of those on the ground, in the second half of a motion: the largest distance of a body from its place over the
/// length of the scene, and the deepest penetration over the least dimension of a shape.
const STOOD: [&str; 2] = ["place_error", "depth_error"];

fn on_hoist(config: &Config, segments: usize, mass_ratio: f64) -> Result<Vec<Value>, StepError> {
    let cable = Hanging::new(config.time, segments, mass_ratio)?;
    let engines = engines();
    let run = |setting: &Setting, longest| cable.run(setting, longest);
    let longest = config.longest_ns[0];
    let rows = search::rows(&engines, &cable.swing, config.bar, longest, run)?;
    let ours = rows.first().map_or(f64::NAN, |r| r.outcome.frame_ns_min);
    let row = |row: &search::Row<'_, _, _>| {
        let least = row.outcome.frame_ns_min;
        let scene = json!({ "segments": segments, "mass_ratio": mass_ratio });
        let figures = json!({
            "ns_per_joint": least / (segments + 1) as f64,
            "over_ours": least / ours,
            // Distance of the reference from that with half as many sub-steps.
            "reference_error": cable.reference.halved / cable.length(),
        });
        joined([scene, row.columns(HUNG, config.bar), figures])
    };
    Ok(rows.iter().map(row).collect())
}

fn on_ground(config: &Config, kind: Kind, mass_ratio: f64) -> Result<Vec<Value>, StepError> {
    let known = Known::new(kind, mass_ratio)?;
    let engines = engines_on_ground();
    let run = |setting: &Setting<_, _>, longest| stand(&known, setting, longest);
    let rows = search::rows(&engines, &known, config.bar, config.longest_ns[1], run)?;
    let ours = rows.first().map_or(f64::NAN, |r| r.outcome.frame_ns);
    let row = |row: &search::Row<'_, _, _>| {
        let scene = json!({ "scene": kind.name(), "mass_ratio": mass_ratio });
        // Of medians: frames that find their contacts as they were are quicker.
        let figures = json!({ "over_ours": row.outcome.frame_ns / ours });
        joined([scene, row.columns(STOOD, config.bar), figures])
    };
    Ok(rows.iter().map(row).collect())
}

/// A cable of 10 m, segments of 1 kg, YA = 2·10⁷ N, with what runs on it are judged by.
struct Hanging {
    rest: Motion,
    swing: Motion,
    reference: Converged,
    /// Distance from the anchor at which a load is lost \[m].
    reach: f64,
}

impl Hanging {
    fn new(time: f64, segments: usize, mass_ratio: f64) -> Result<Self, StepError> {
        let at = |angle| Motion {
            params: HoistParams {
                segments,
                mass_ratio,
                ..HoistParams::default()
            },
            angle,
        };
        let swing = at(ANGLE);
        Ok(Self {
            reference: motion::converged(&swing, steps_in(time, FRAME))?,
            reach: motion::reach(&swing.params)?,
            rest: at(0.0),
            swing,
        })
    }

    fn length(&self) -> f64 {
        self.rest.params.length
    }

    /// Runs a setting through both motions, the swing first. Ends early where the load is lost or the first frames take
    /// longer than `longest_ns`.
    fn run(&self, setting: &Setting, longest_ns: f64) -> Result<Outcome, StepError> {
        let mut times = Vec::new();
        let mut through = |frame: Frame, count, each: &mut dyn FnMut(Vector3<f64>)| {
            frames(frame, count, longest_ns, &mut times, |load| {
                each(load);
                load.norm() <= self.reach
            })
        };
        let (mut elongation_error, mut load_error) = (0.0_f64, 0.0_f64);
        let mut exact = self.reference.load.iter();
        let swing = (setting.start)(&self.swing)?;
        let swung = through(swing, exact.len(), &mut |load| {
            if let Some(exact) = exact.next() {
                load_error = load_error.max((load - Vector3::from(*exact)).norm());
            }
        });
        let rested = swung.and_then(|()| {
            let (count, mut frame) = (steps_in(REST, FRAME), 0);
            let analytic = self.rest.params.exact_elongation();
            let rest = (setting.start)(&self.rest).map_err(|e| e.to_string())?;
            through(rest, count, &mut |load| {
                frame += 1;
                if 2 * frame > count {
                    let elongation = -load.z - self.length();
                    elongation_error = elongation_error.max((elongation - analytic).abs());
                }
            })
        });
        let errors = [elongation_error, load_error].map(|error| error / self.length());
        Ok(Outcome::new(errors, rested, times))
    }
}

/// Runs a setting on the ground. Ends early where a body is lost or the first frames take longer than `longest_ns`.
fn stand(
    known: &Known,
    setting: &Setting<Known, Places>,
    longest_ns: f64,
) -> Result<Outcome, StepError> {
    let (mut place, mut depth) = (0.0_f64, 0.0_f64);
    let (mut times, mut frame, count) = (Vec::new(), 0, contact_scenes::frames());
    let start = (setting.start)(known)?;
    let ran = frames(start, count, longest_ns, &mut times, |places| {
        frame += 1;
        let off = known.off(frame, &places);
        if 2 * frame <= count {
            return off.place.is_finite();
        }
        place = place.max(off.place);
        depth = depth.max(off.depth);
        off.place <= known.reach
    });
    let errors = [place / known.length, depth / known.thickness];
    Ok(Outcome::new(errors, ran, times))
}

/// The tables after what was run, and why baselines are beyond the bar.
fn text(data: &Value, config: &Config) -> String {
    let bar = percent(config.bar);
    let [longest, on_ground] = config.longest_ns.map(nanoseconds);
    let mut out = format!(
        "hoist: L = 10 m, segments of 1 kg, YA = 2·10⁷ N; one frame of 1/60 s on one thread. Swing: straight at {ANGLE} rad,\n\
         released from rest, {} s. elong.: of the resting cable, against the analytic one; load: largest distance of the\n\
         swinging load from our own step at 1/7680 s; both in % of L. Baselines: the cheapest setting within {bar} %, by\n\
         powers of two, none beyond {longest} a frame tried; their cables have no bending and no torsion. *: the least of the\n\
         rows within {bar} %.\n{}{}",
        config.time,
        STUDY.sheet("hoist").text(data),
        STUDY.sheet("ground").text(data),
    );
    let _ = writeln!(
        out,
        "  slide: a box of 2 m/s; stack: 10 boxes, the topmost the heaviest; floor: a load that 24 segments drag; 2 s,\n  \
         μ = 0.3. place: largest distance of a body from its known place, in % of the way, the height or the cable;\n  \
         depth: deepest penetration, in % of an edge or the cable's diameter; both in the second half. × ours: of the\n  \
         medians. Baselines: none beyond {on_ground} a frame tried."
    );
    let rows = ["records", "ground"].map(|list| rows_of(data, list));
    let beyond: Vec<String> = rows
        .iter()
        .flatten()
        .filter_map(|row| remark(row, &bar))
        .collect();
    if !beyond.is_empty() {
        let _ = writeln!(out, "\nBeyond the bar\n  {}", beyond.join("\n  "));
    }
    if cfg!(not(feature = "rapier")) {
        out.push_str("\nLeft out\n  rapier: not compiled in: build with `--features rapier`\n");
    }
    out
}

/// Note on a row beyond the bar (in %); `None` within it.
fn remark(row: &Row, bar: &str) -> Option<String> {
    let number = |key| number_of(row, key);
    let errors = HUNG.iter().chain(&STOOD).filter_map(|key| number(key));
    let best = percent(errors.fold(0.0, f64::max));
    let (setting, tried) = (text_of(row, "setting"), number("tried").unwrap_or(0.0));
    let failure = row.get("failure").and_then(Value::as_str);
    let reason = match (failure, is(row, "searched")) {
        _ if is(row, "within") => return None,
        (None, true) => format!("{bar} % not reached; best of {tried}: {best} %"),
        (None, false) => format!("`{setting}` is beyond {bar} %"),
        (Some(reason), true) => {
            format!("{bar} % not reached, no run of {tried} to its end; the first: {reason}")
        }
        (Some(reason), false) => format!("`{setting}`: {reason}"),
    };
    let scene = match number("segments") {
        Some(segments) => format!("{segments} segments"),
        None => text_of(row, "scene").to_owned(),
    };
    let (engine, ratio) = (text_of(row, "engine"), ratio(number("mass_ratio")?));
    Some(format!("{engine}, {scene}, ratio {ratio}: {reason}"))
}

/// Per cent, two digits.
fn percent(error: f64) -> String {
    match 100.0 * error {
        e if e < 1e-3 => format!("{e:.0e}"),
        e if e < 0.1 => format!("{e:.3}"),
        e if e < 1.0 => format!("{e:.2}"),
        e => format!("{}", (100.0 * e).round() / 100.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;
    use taut_integrator::{Scheme, StepOptions};

    fn shown(data: &Value, config: &Config) -> String {
        taut_output::table::plain(&text(data, config))
    }

    /// Six segments through a swing, one ratio after the other.
    fn quick() -> (Config, Value) {
        let config = Config {
            segments: vec![6],
            ground: vec![1.0],
            ..Config::new(true)
        };
        let data = run(&config, &Cases::default()).expect("sound");
        println!("{}", shown(&data, &config));
        (config, data)
    }

    fn number(row: &Row, key: &str) -> f64 {
        number_of(row, key).unwrap_or_else(|| panic!("{key} of {row:?}"))
    }

    /// A pendulum of frequency ω, taken at x + a δ²x, runs fast by (1/24 − a/2)(ωΔt)²: with amplitude θ it is behind by
    /// θ ω t times that after t, in lengths of the cable. Half of that and twice it are the bars, for the swing is not
    /// quite harmonic. With sub-steps the error falls with their square.
    #[test]
    fn our_error_is_that_of_the_pendulums_period() {
        let (config, data) = quick();
        let records = rows_of(&data, "records");
        let Scheme::ThirdDifference { a, .. } = StepOptions::default().scheme else {
            panic!("the default scheme is another: so is its error");
        };
        for &mass_ratio in &config.ratios {
            let ours = |setting: &str| {
                let is_its = |row: &&Row| {
                    text_of(row, "setting") == setting && number(row, "mass_ratio") == mass_ratio
                };
                let row = records.iter().find(is_its).expect("a row");
                assert!(is(row, "within") && number(row, "frame_ns_min") > 0.0);
                HUNG.map(|key| number(row, key))
            };
            let params = Hanging::new(0.1, 6, mass_ratio).expect("sound").rest.params;
            let length = params.length + params.exact_elongation();
            let omega = (params.gravity / length).sqrt();
            // The phase error shows where the load is fastest, a quarter of a period after the start at the earliest.
            let phase = omega * config.time;
            assert!(phase > FRAC_PI_2);
            let late = (1.0 / 24.0 - 0.5 * a).abs() * (omega * FRAME).powi(2) * phase;
            let expected = late * ANGLE * length / params.length;
            let [elongation, load] = ours("default, 1 step");
            println!("ratio {mass_ratio}: expected {expected:e}, load {load:e}");
            assert!((0.5 * expected..2.0 * expected).contains(&load));
            assert!(elongation < 1e-12);
            let [_, halved] = ours("2 sub-steps");
            assert!((3.5..4.5).contains(&(load / halved)), "{}", load / halved);
        }
    }

    #[test]
    fn every_row_has_its_figures_and_the_table_is_narrow() {
        let (config, data) = quick();
        let records = rows_of(&data, "records");
        let rows = config.ratios.len() * (6 + engines().len() - 1);
        assert_eq!(records.len(), rows);
        for r in &records {
            // The short time given to Rapier's multibody leaves its error open.
            let bar = if text_of(r, "engine").contains("multibody") {
                1.0
            } else {
                config.bar
            };
            assert!(HUNG.iter().all(|key| number(r, key) < bar), "{r:?}");
            assert!(number(r, "reference_error") < 1e-6, "{r:?}");
            let times = ["frame_ns", "frame_ns_min", "ns_per_joint"];
            assert!(times.iter().all(|key| number(r, key) > 0.0), "{r:?}");
        }
        assert_eq!(number(&records[0], "over_ours"), 1.0);
        // Slide, stack and floor.
        let on_ground = if cfg!(feature = "rapier") { 6 } else { 3 };
        let ground = rows_of(&data, "ground");
        assert_eq!(ground.len(), on_ground);
        for r in &ground {
            assert!(is(r, "within") && number(r, "frame_ns") > 0.0, "{r:?}");
        }
        let text = shown(&data, &config);
        assert!(text.lines().all(|line| line.chars().count() <= 120));
    }

    /// A baseline that no setting brings within the bar is said to be that, with the best it reached.
    #[test]
    fn what_is_not_reached_is_said() {
        let config = Config {
            bar: 1e-9,
            segments: vec![3],
            ratios: vec![1e3],
            ground: Vec::new(),
            time: 0.5,
            ..Config::new(true)
        };
        let data = run(&config, &Cases::default()).expect("sound");
        assert!(
            !rows_of(&data, "records")
                .iter()
                .any(|row| is(row, "within"))
        );
        let text = shown(&data, &config);
        let says = text.contains("leapfrog, 3 segments, ratio 1000: 1e-7 % not reached; best of");
        assert!(says, "{text}");
    }

    /// Ours, one step a frame: the box stops where it should to 1 %, boxes stay and a load follows its tug to far less,
    /// whatever the mass ratio.
    #[test]
    fn our_motions_end_where_they_are_known_to() {
        let ours = ours::on_ground();
        let scenes = [(Kind::Slide, 1.0)].into_iter();
        let ratios = Config::new(false).ground;
        let over = |kind| ratios.iter().map(move |&ratio| (kind, ratio));
        for (kind, mass_ratio) in
            scenes.chain([Kind::Stack, Kind::Floor].into_iter().flat_map(over))
        {
            let known = Known::new(kind, mass_ratio).expect("sound");
            let outcome = stand(&known, &ours.ladders[0][0], f64::INFINITY).expect("sound");
            println!("{} {mass_ratio}: {:?}", kind.name(), outcome.errors);
            assert!(outcome.error() < 0.01, "{outcome:?}");
            let place = outcome.errors[0].expect("it ends");
            assert!(kind == Kind::Slide || place < 2e-4, "{outcome:?}");
        }
    }

    /// The way of the box that slides, and that of a load with its tug.
    #[test]
    fn what_stays_at_its_start_is_off() {
        for (kind, way) in [
            (Kind::Slide, 0.6795786612),
            (Kind::Stack, 0.0),
            (Kind::Floor, 1.0),
        ] {
            let known = Known::new(kind, 10.0).expect("sound");
            let off = known.off(contact_scenes::frames(), &known.scene.bodies.position);
            let holds = (off.place - way).abs() < 1e-9 && off.depth == 0.0;
            assert!(holds, "{off:?}");
        }
    }
}
