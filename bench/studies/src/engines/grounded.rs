//! Whole engines on the ground: a box that slides, a stack, a load that a cable drags, each with a known end.

use super::search::{self, Entry, Errors, Outcome, Row};
use super::{Config, ours};
use serde::{Deserialize, Serialize};
use taut_ground::engine::grounded::{self, Kind, Known, Places};
use taut_ground::engine::{Engine, Setting};
use taut_integrator::StepError;

/// Errors on the ground, in the second half of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stood {
    /// Largest distance of a body from its place, over the length of the scene.
    pub place_error: Option<f64>,
    /// Deepest penetration over the least dimension of a shape.
    pub depth_error: Option<f64>,
}

impl Errors for Stood {
    fn all(&self) -> [Option<f64>; 2] {
        [self.place_error, self.depth_error]
    }
}

/// One row: an engine in a setting on a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    pub scene: String,
    /// The heaviest mass over the lightest.
    pub mass_ratio: f64,
    /// The row.
    #[serde(flatten)]
    pub entry: Entry<Stood>,
    /// Median of a frame over ours: frames that find their contacts as they were are quicker.
    pub over_ours: f64,
}

/// The scenes and their mass ratios.
pub(super) fn scenes(config: &Config) -> Vec<(Kind, f64)> {
    let of = |kind: Kind| {
        // One box is not heavier than another.
        let ratios = if kind == Kind::Slide {
            &[1.0]
        } else {
            &config.ground[..]
        };
        ratios.iter().map(move |ratio| (kind, *ratio))
    };
    Kind::ALL.into_iter().flat_map(of).collect()
}

/// The rows of one of them, ours first.
pub(super) fn rows(config: &Config, kind: Kind, mass_ratio: f64) -> Result<Vec<Record>, StepError> {
    let known = Known::new(kind, mass_ratio)?;
    let engines = engines();
    let mut rows = Vec::new();
    for engine in &engines {
        let run = |setting, longest| run(&known, setting, longest);
        rows.extend(search::rows(
            engine,
            config.bar,
            config.longest_on_ground_ns,
            run,
        )?);
    }
    search::in_turns(&mut rows, &known)?;
    let ours = rows.first().map_or(f64::NAN, |r| r.outcome.frame_ns);
    // An engine has one row.
    let record = |(engine, row): (&Engine<Known, Places>, Row<'_, Stood, Known, Places>)| Record {
        scene: kind.name().to_owned(),
        mass_ratio,
        over_ours: row.outcome.frame_ns / ours,
        entry: row.entry(engine, config.bar),
    };
    Ok(engines.iter().zip(rows).map(record).collect())
}

fn engines() -> Vec<Engine<Known, Places>> {
    let engines = std::iter::once(ours::on_ground());
    #[cfg(feature = "rapier")]
    let engines = engines.chain([taut_rivals::rapier::on_ground()]);
    engines.collect()
}

/// Runs a setting. Ends early where a body is lost or the first frames take longer than `longest_ns`.
fn run(
    known: &Known,
    setting: &Setting<Known, Places>,
    longest_ns: f64,
) -> Result<Outcome<Stood>, StepError> {
    let (mut place, mut depth) = (0.0_f64, 0.0_f64);
    let (mut times, mut frame, count) = (Vec::new(), 0, grounded::frames());
    let start = (setting.start)(known)?;
    let ran = search::frames(start, count, longest_ns, &mut times, |places| {
        frame += 1;
        let off = known.off(frame, &places);
        if 2 * frame <= count {
            return off.place.is_finite();
        }
        place = place.max(off.place);
        depth = depth.max(off.depth);
        off.place <= known.reach
    });
    let over = |error: f64, length: f64| ran.is_ok().then_some(error / length);
    let errors = Stood {
        place_error: over(place, known.length),
        depth_error: over(depth, known.thickness),
    };
    Ok(Outcome::new(setting, errors, ran, times))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ours, one step a frame: the box stops where it should to 1 %, boxes stay and a load follows its tug to far less,
    /// whatever the mass ratio.
    #[test]
    fn our_motions_end_where_they_are_known_to() {
        let ours = ours::on_ground();
        for (kind, mass_ratio) in scenes(&Config::default()) {
            let known = Known::new(kind, mass_ratio).expect("sound");
            let outcome = run(&known, &ours.ladders[0][0], f64::INFINITY).expect("sound");
            println!("{} {mass_ratio}: {:?}", kind.name(), outcome.errors);
            assert!(outcome.error() < 0.01, "{outcome:?}");
            let place = outcome.errors.place_error.expect("it ends");
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
            let off = known.off(grounded::frames(), &known.scene.bodies.position);
            assert!(
                (off.place - way).abs() < 1e-9 && off.depth == 0.0,
                "{off:?}"
            );
        }
    }
}
