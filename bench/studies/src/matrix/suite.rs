//! A graded set of systems: from thirty rows that anything solves to six thousand.
//!
//! Each is the system of one step of 1/60 s with the default options from a state that is made, not simulated: a chain
//! (the hoist), a ring, or a net of point masses. What is graded is the size N (segments, nodes of the net), the mass
//! ratio load/segment, the state and the compliance ε of the joints: that of the material, or 10⁻¹² m/N, a thousandth
//! of it and less, with the radius and so the inertia as they were. Rings have that of the material only, since their
//! radius follows from it.
//!
//! | state | chain | ring, net |
//! |---|---|---|
//! | `straight` | hanging at rest: a chain of scalar systems | – |
//! | `bent` | on a space curve under the tension of the hanging cable | – |
//! | `hanging` | – | static equilibrium |
//! | `unstrained` | – | as built, where there is no equilibrium to be found |
//! | `slack` | the same curve without gravity and tension | as built, without gravity |
//!
//! Two conditions are given of each. As the matrix stands, rows in metres and in radians and, in nets without tension, the
//! transverse rows, whose Σ is that of a filter, differ by up to 10²⁰; with rows and columns scaled to the same size
//! what is left is what mass ratio, size and compliance do.
//!
//! Beside them stands a [sequence](taut_measure::matrix::sequence): the systems of a gantry that is driven for ten seconds at
//! mass ratio 10⁵, in [`SEQUENCE`].
//!
//! Small systems come in both forms, and with every state and compliance; large ones in the hardest state alone, so that
//! the set stays small. Random velocities are those of fixed seeds: the set is the same in every run.

use crate::checks::each;
use indicatif::ProgressBar;
use serde::Serialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use taut_integrator::{Form, StepError, StepOptions, Stepper};
use taut_measure::files::{Output, make_folder};
use taut_measure::inputs::Inputs;
use taut_measure::matrix::Matrix;
use taut_measure::matrix::dump::{self, Dumped, Label};
use taut_measure::matrix::exact::condition;
use taut_measure::matrix::prepared::Problem;
use taut_measure::matrix::sequence::{Recorder, Wanted};
use taut_measure::pace;
use taut_measure::poses::{self, Pose};
use taut_measure::reference::reference_choice;
use taut_model::{GantryParams, HoistParams, Network, NetworkParams, Scene};
use taut_output::check::ExperimentError;
use taut_output::row::{self, Row};

/// Compliance of the stiff systems \[m/N].
pub const STIFF: f64 = 1e-12;

/// Seed of the random velocities of chains; those of the bent one have another, fixed in [`poses`].
pub const CHAIN_SEED: u64 = 7;

/// Seed of the random velocities of rings and nets.
pub const NETWORK_SEED: u64 = 1;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Topology {
    /// One cable with a load.
    Chain,
    /// A closed cable.
    Ring,
    /// Point masses with links in two directions.
    Net,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// Hanging straight at rest.
    Straight,
    /// On a space curve, under tension.
    Bent,
    /// In static equilibrium.
    Hanging,
    /// As built, under gravity.
    Unstrained,
    /// Without gravity or tension.
    Slack,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Compliance {
    /// l/EA of the default cable.
    Material,
    Stiff,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    pub topology: Topology,
    pub size: usize,
    pub state: State,
    /// Mass of the load over that of a segment.
    pub mass_ratio: f64,
    pub compliance: Compliance,
    /// Writes the KKT form too.
    pub kkt: bool,
}

/// The cases of the set; the small ones only if `quick`. The largest size has the first state and compliance only.
pub fn cases(quick: bool) -> Vec<Case> {
    use Compliance::{Material, Stiff};
    use State::{Bent, Hanging, Slack, Straight};
    use Topology::{Chain, Net, Ring};
    type Grades = (Topology, usize, &'static [State], &'static [Compliance]);
    let sets: [Grades; 3] = [
        (Chain, 6, &[Bent, Straight, Slack], &[Material, Stiff]),
        (Ring, 8, &[Hanging, Slack], &[Material]),
        (Net, 6, &[Hanging, Slack], &[Material, Stiff]),
    ];
    let mut cases = Vec::new();
    for (topology, smallest, states, compliances) in sets {
        for (rank, size) in [smallest, 24, 100, 1000].into_iter().enumerate() {
            if quick && rank > 1 {
                break;
            }
            let most = if rank == 3 { 1 } else { usize::MAX };
            for &state in states.iter().take(most) {
                for &compliance in compliances.iter().take(most) {
                    cases.extend([1.0, 1e3, 1e5, 1e6].map(|mass_ratio| Case {
                        topology,
                        size,
                        state,
                        mass_ratio,
                        compliance,
                        kkt: rank < 2,
                    }));
                }
            }
        }
    }
    cases
}

impl Case {
    pub fn name(&self) -> String {
        let word = |value: &dyn std::fmt::Debug| format!("{value:?}").to_lowercase();
        format!(
            "{}{}_{}_r{:.0e}_{}",
            word(&self.topology),
            self.size,
            word(&self.state),
            self.mass_ratio,
            word(&self.compliance)
        )
    }

    /// The scene, and the compliance of a joint in stretch \[m/N].
    fn scene(&self) -> Result<(Scene, f64), StepError> {
        match self.topology {
            Topology::Chain => self.chain(),
            Topology::Ring | Topology::Net => self.network(),
        }
    }

    fn chain(&self) -> Result<(Scene, f64), StepError> {
        let mut params = HoistParams {
            segments: self.size,
            mass_ratio: self.mass_ratio,
            seed: CHAIN_SEED,
            ..HoistParams::default()
        };
        let cable = params.resolve()?;
        let mut epsilon = cable.segment_length / cable.stiffness.ea;
        if self.compliance == Compliance::Stiff {
            params.radius = Some(cable.radius);
            params.segment_mass = Some(cable.segment_mass);
            params.ea = Some(cable.segment_length / STIFF);
            epsilon = STIFF;
        }
        if self.state == State::Slack {
            params.gravity = 0.0;
        }
        let pose = match self.state {
            State::Straight => Pose::Straight,
            _ => Pose::Bent,
        };
        Ok((poses::hoist(&params, pose)?, epsilon))
    }

    fn network(&self) -> Result<(Scene, f64), StepError> {
        let mut params = NetworkParams {
            mass_ratio: self.mass_ratio,
            seed: NETWORK_SEED,
            equilibrium: self.state == State::Hanging,
            ..NetworkParams::new(match self.topology {
                Topology::Net => Network::Net,
                _ => Network::Ring,
            })
        };
        if self.topology == Topology::Net {
            (params.rows, params.columns) = sides(self.size);
        } else {
            params.segments = self.size;
        }
        if self.state == State::Slack {
            params.gravity = 0.0;
        }
        let length = params.resolve()?.segment_length;
        if self.compliance == Compliance::Stiff {
            params.ea = length / STIFF;
        }
        Ok((params.build()?, length / params.ea))
    }

    /// Its systems, of one form or both; with the state that they have come to be in, and ε.
    fn systems(&self) -> Result<(Vec<Dumped>, State, f64), StepError> {
        let options = StepOptions {
            backend: reference_choice().backend,
            ..StepOptions::default()
        };
        let (mut scene, epsilon) = self.scene()?;
        let mut state = self.state;
        let mut stepper = match Stepper::new(scene.clone(), options.clone()) {
            Err(StepError::NoEquilibrium { .. }) => {
                state = State::Unstrained;
                scene.start_in_equilibrium = false;
                Stepper::new(scene, options)
            }
            other => other,
        }?;
        let mut systems = Vec::from(dump::systems(&mut stepper)?);
        systems.truncate(1 + usize::from(self.kkt));
        Ok((systems, state, epsilon))
    }

    /// Writes its systems; a row for each.
    fn write(&self, folder: &Path, gzip: bool) -> Result<Vec<Value>, ExperimentError> {
        let (systems, state, epsilon) = self
            .systems()
            .map_err(|e| format!("{}: {e}", self.name()))?;
        let case = Self { state, ..*self };
        let seed = match self.topology {
            Topology::Chain => CHAIN_SEED,
            _ => NETWORK_SEED,
        };
        let label = Label {
            name: case.name(),
            comments: vec![
                format!(
                    "{:?}, N = {}, {state:?}, mass ratio {:e}",
                    self.topology, self.size, self.mass_ratio
                ),
                format!("compliance {epsilon:e} m/N, time step 1/60 s, seed {seed}"),
            ],
        };
        let mut entries = Vec::new();
        for system in systems {
            let files = dump::write(&system, &label, folder, gzip)?;
            let size = |path: &PathBuf| std::fs::metadata(path).map_or(0, |m| m.len());
            let solution = system.x.is_ok();
            let matrix = Matrix::Symmetric(system.matrix);
            let condition = condition(&Problem::new(&matrix));
            let name = match system.form {
                Form::Kkt => format!("{}_kkt", label.name),
                _ => label.name.clone(),
            };
            entries.push(json!({
                "name": name,
                "topology": self.topology,
                // Segments, or nodes of the net.
                "size": self.size,
                "state": state,
                "mass_ratio": self.mass_ratio,
                // Compliance of a joint in stretch (m/N).
                "epsilon": epsilon,
                "form": system.form.to_string(),
                "dim": matrix.dim(),
                "blocks": matrix.blocks(),
                // Of both triangles, zeros of stored blocks among them.
                "entries": matrix.entries(),
                // Estimates in the ∞-norm, as it is and with rows and columns scaled; beyond 10¹⁶ no more than that.
                "condition": condition.map(|c| c.of_matrix),
                "condition_scaled": condition.map(|c| c.scaled),
                // The exact solution was found and is in `_x`.
                "solution": solution,
                "seed": seed,
                "bytes": files.iter().map(size).sum::<u64>(),
            }));
        }
        Ok(entries)
    }
}

/// Rows and columns of a net with that many nodes, as square as may be.
fn sides(nodes: usize) -> (usize, usize) {
    let rows = (2..=nodes)
        .take_while(|r| r * r <= nodes)
        .filter(|r| nodes.is_multiple_of(*r));
    let rows = rows.last().unwrap_or(2);
    (rows, nodes / rows)
}

/// Writes the cases and their `index.csv` to `folder`; `progress` advances once for each case.
pub fn generate(
    cases: &[Case],
    folder: &Path,
    gzip: bool,
    progress: &ProgressBar,
) -> Result<Vec<Row>, ExperimentError> {
    make_folder(folder)?;
    let entries = each(cases, progress, |case| case.write(folder, gzip))?;
    let entries = row::rows_of(&entries.concat().into(), "");
    Output::open(&folder.join("index.csv"))?.write(|out| row::csv(&entries, out))?;
    Ok(entries)
}

/// Folder of the sequence, in that of the set.
pub const SEQUENCE: &str = "gantry12_driven_r1e5";

/// Drive of the gantry: ten seconds of 600 steps.
const DRIVE: &str = "\
time,trolley_speed,hoist_speed
0,0,0
2,0.5,0
4,0.5,0.3
7,0,0.3
9,0,0
";

/// Writes the systems of the driven gantry's first steps. Returns the size of the files.
pub fn generate_sequence(
    steps: u64,
    folder: &Path,
    gzip: bool,
    progress: &ProgressBar,
) -> Result<u64, ExperimentError> {
    let params = GantryParams {
        mass_ratio: 1e5,
        equilibrium: true,
        seed: CHAIN_SEED,
        ..GantryParams::default()
    };
    let options = reference_choice().options(1.0 / 60.0);
    let mut stepper = Stepper::new(params.build()?, options)?;
    let inputs = Inputs::parse(DRIVE, stepper.scene())?;
    let comment = format!(
        "gantry of {} segments, mass ratio 1e5, time step 1/60 s, driven by trolley and hoist",
        params.segments
    );
    let mut recorder = Recorder::new(Wanted {
        folder: folder.join(SEQUENCE),
        comments: vec![comment],
        exact: true,
        gzip,
    })?;
    progress.set_length(steps);
    progress.set_position(0);
    for step in 0..steps {
        inputs.apply(&mut stepper)?;
        recorder.take(step, &stepper)?;
        pace::step(&mut stepper)?;
        progress.inc(1);
    }
    let files = recorder.finish()?.files;
    let size = |path: &PathBuf| std::fs::metadata(path).map_or(0, |m| m.len());
    Ok(files.iter().map(size).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;
    use taut_measure::matrix::System;

    #[test]
    fn nets_are_as_square_as_may_be() {
        let found = [6, 24, 100, 1000].map(sides);
        assert_eq!(found, [(2, 3), (4, 6), (10, 10), (25, 40)]);
    }

    /// Every file of two runs is the same, every system reads back, and mass ratios make them harder.
    #[test]
    fn the_set_is_the_same_in_every_run() {
        let folder = std::env::temp_dir().join(format!("taut-suite-{}", std::process::id()));
        let small: Vec<Case> = cases(true).into_iter().filter(|c| c.size < 24).collect();
        let run = |name: &str, gzip: bool| {
            let to = folder.join(name);
            let entries = generate(&small, &to, gzip, &ProgressBar::hidden()).expect("written");
            let files = std::fs::read_dir(&to).expect("a folder").map(|file| {
                let path = file.expect("a file").path();
                let name = path.file_name().expect("named").to_owned();
                (name, std::fs::read(path).expect("read"))
            });
            (entries, files.collect::<BTreeMap<_, _>>())
        };
        let (entries, files) = run("a", false);
        assert!((entries.clone(), files) == run("b", false));
        let number = |entry: &Row, key| row::number_of(entry, key);
        let bytes = |entries: &[Row]| {
            entries
                .iter()
                .filter_map(|e| number(e, "bytes"))
                .sum::<f64>()
        };
        assert!(3.0 * bytes(&run("c", true).0) < 2.0 * bytes(&entries));
        assert_eq!(entries.len(), 2 * small.len());
        for entry in &entries {
            let path = folder.join(format!("a/{}.mtx", row::text_of(entry, "name")));
            let read = System::read(&path, None, None).expect("reads");
            assert_eq!(entry["dim"], read.matrix.dim());
            assert_eq!(entry["blocks"], read.matrix.blocks());
            assert_eq!(entry["solution"], read.x.is_some(), "{entry:?}");
            assert!(number(entry, "condition") > Some(1.0), "{entry:?}");
        }
        let of = |name: &str| {
            let entry = entries.iter().find(|e| e["name"] == name)?;
            number(entry, "condition")
        };
        let easy = of("chain6_bent_r1e0_material");
        let hard = of("chain6_bent_r1e6_stiff");
        assert!(hard > easy.map(|c| 100.0 * c), "{easy:?} {hard:?}");
        std::fs::remove_dir_all(folder).expect("removed");
    }
}
