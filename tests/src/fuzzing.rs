//! Functions that take arbitrary input: from the fuzzer (`tests/fuzz`), from random mutations of
//! good inputs and from the inputs that once did harm (both in the test module `refuses`).
//!
//! Each function takes bytes and returns whether they came as far as something to be solved. It panics where the program
//! would have, where an error says nothing, where a result that claims to be good is not finite, and where an iteration, or the
//! solution of a matrix by itself, claims what neither its residual nor rounding allows: a direct solver of blocks, as steps
//! call it, says `Direct` of what nobody has looked at before it is refined. Sizes are limited so that no input takes long.

use crate::claims::{alone, over_claim};
use crate::decode::Bytes;
use crate::prelude::*;
use crate::products::invariants::{Outcome, judge};
use crate::products::{Choices, scene::toml, shrink::smallest};
use std::fmt::Display;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;
use taut_bench::run_file::RunFile;
use taut_measure::matrix::prepared::Problem;
use taut_measure::matrix::{Matrix, market, matrix_of, vector_of};
use taut_model::scene_file::SceneText;
use taut_recording::{Recording, animation, page, still, table};
use taut_solver::{GeneralMatrix, GeneralSolver};

/// Most bodies of a scene that is stepped.
const BODIES: usize = 40;

/// Most rows of a matrix that every backend solves.
const ROWS: usize = 60;

/// A target's name, as that of its folder of inputs, and what it does.
pub type Target = (&'static str, fn(&[u8]) -> bool);

/// All of them but [`products`], whose inputs take too long to be tried by hundreds.
pub const TARGETS: [Target; 6] = [
    ("scene_file", scene_file),
    ("scene_builder", scene_builder),
    ("matrix_and_rhs", matrix_and_rhs),
    ("matrix_market", matrix_market),
    ("saved_run", saved_run),
    ("recording", recording),
];

/// Every backend that is compiled in, with every option that changes its algorithm.
pub fn backends() -> Vec<Backend> {
    let names = "banded faer:llt faer:ldlt faer:lblt faer:lu nalgebra-sparse umfpack:refinement=0 umfpack \
        dense:double dense:extended cg:none cg:jacobi cg:group gauss-seidel:joints \
        gauss-seidel:groups gauss-seidel:groups:trial minres";
    let all = names.split(' ');
    let all = all.map(|name| name.parse().expect("a known name"));
    all.filter(Backend::is_compiled).collect()
}

/// An error says in words what is wrong, and where or what to do: it names something, counts something, or gives advice
/// after a colon. What `Debug` would write, and the numbers of lost memory, are no words.
fn says(error: &impl Display) -> bool {
    let text = error.to_string();
    let words = text.split_whitespace().count();
    let names = text.contains(['`', ':', '[']) || text.contains(|c: char| c.is_ascii_digit());
    assert!(words >= 3 && names && !text.contains(" { "), "{text:?}");
    false
}

fn finite<'a>(numbers: impl IntoIterator<Item = &'a f64>, what: &impl Display) {
    let bad = numbers.into_iter().find(|x| !x.is_finite());
    let holds = bad.is_none();
    assert!(holds, "{what}: {bad:?} in a result that is said to be good");
}

/// Some steps of a small scene, with loads, controls and a save in between.
fn step(stepper: &mut Stepper, bytes: &mut Bytes<'_>) {
    for n in 0..3 {
        if bytes.byte() % 4 == 3 {
            edit(stepper, bytes);
        }
        match stepper.step() {
            Ok(_) => {
                let bodies = &stepper.scene().bodies;
                let vectors = [&bodies.position, &bodies.velocity, &bodies.angular_velocity];
                let place = format!("{}, step {n}", stepper.options().backend);
                finite(vectors.into_iter().flatten().flatten(), &place);
                finite(
                    bodies.orientation.iter().flat_map(|q| q.coords.iter()),
                    &place,
                );
                finite(stepper.multipliers(), &place);
            }
            Err(e) => {
                says(&e);
            }
        }
        if n == 1 {
            match stepper.save().map(Stepper::restore) {
                Ok(Ok(again)) => assert_eq!(again.time().to_bits(), stepper.time().to_bits()),
                // Every saved run can be restored.
                Ok(Err(e)) => panic!("{e}"),
                Err(e) => {
                    says(&e);
                }
            }
        }
    }
}

/// A change between two steps, sound or not.
fn edit(stepper: &mut Stepper, bytes: &mut Bytes<'_>) {
    let body = bytes.below(stepper.scene().bodies.len() + 1);
    let mut vector = || Vector3::from_fn(|_, _| bytes.number());
    let [a, b] = [vector(), vector()];
    let value = bytes.number();
    let results = match bytes.byte() % 5 {
        0 => stepper.set_load(body, a, b),
        1 => stepper.set_velocity(body, a, b),
        2 => stepper.set_control(body, value),
        3 => {
            let rows = vec![value; stepper.multipliers().len()];
            stepper
                .set_tension(&rows)
                .and_then(|()| stepper.set_multipliers(&rows))
        }
        _ => {
            let mut bodies = stepper.scene().bodies.clone();
            if let Some(x) = bodies.position.get_mut(body) {
                *x = a;
            }
            stepper.set_state(&bodies, value)
        }
    };
    if let Err(e) = results {
        says(&e);
    }
}

/// Steps a scene that is small enough; whether there is a stepper.
fn run(scene: Scene, options: StepOptions, bytes: &mut Bytes<'_>) -> bool {
    if scene.bodies.len() > BODIES || scene.constraints.len() > 2 * BODIES {
        return false;
    }
    match Stepper::new(scene, options) {
        Ok(mut stepper) => {
            step(&mut stepper, bytes);
            true
        }
        Err(e) => says(&e),
    }
}

/// True if a scene is small enough to be built here.
fn small(source: &SceneSource) -> bool {
    match source {
        SceneSource::Hoist(p) => p.segments <= 1000,
        SceneSource::Gantry(p) => p.segments <= 1000,
        SceneSource::Particles(p) => p.particles <= 1000,
        SceneSource::Specimen(p) => p.segments <= 1000,
        SceneSource::Network(p) => p.segments <= 30,
        _ => true,
    }
}

/// The text of a scene.
pub fn scene_file(data: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(data) else {
        return false;
    };
    let source = match SceneSource::parse(text, &[]) {
        Ok(source) => source,
        Err(e) => return says(&e),
    };
    if !small(&source) {
        return false;
    }
    match source.build() {
        Ok(scene) => run(scene, StepOptions::default(), &mut Bytes::new(&[])),
        Err(e) => says(&e),
    }
}

/// Scenes that a program makes: named ones with overrides, or bodies and constraints with any numbers.
pub fn scene_builder(data: &[u8]) -> bool {
    let mut bytes = Bytes::new(data);
    let scene = if bytes.byte().is_multiple_of(2) {
        match bytes.named() {
            Ok(source) if small(&source) => source.build(),
            Ok(_) => return false,
            Err(e) => Err(e),
        }
    } else {
        Ok(bytes.scene())
    };
    match scene {
        Ok(scene) => {
            let _ = reads_back(scene.clone());
            let options = bytes.options(&backends());
            run(scene, options, &mut bytes)
        }
        Err(e) => says(&e),
    }
}

/// What a sound scene is written as is read back to it, to the bit: Rust's debug text tells −0 from 0. Whether it can be written.
pub fn reads_back(mut scene: Scene) -> bool {
    // What decoding leaves as it is.
    for (i, constraint) in scene.constraints.iter_mut().enumerate() {
        let law = RowLaw::new(1e-6 * i as f64, 0.1);
        let turned = 7.0 * i as f64;
        match constraint {
            Constraint::Cosserat(c) => c.twist_reference = turned,
            Constraint::Paper(p) => {
                (p.twist_reference, p.safeguard) = (turned, 1e-9);
                p.twist_definition = TwistDefinition::Alternative;
            }
            Constraint::Hinge(h) => (h.stretch, h.tilt, h.angle_reference) = (law, law, turned),
            Constraint::Slider(s) => (s.rotation, s.across) = (law, law),
            Constraint::LinkBend(b) => b.definition = BendDefinition::Vector,
            _ => {}
        }
    }
    if scene.validate().is_err() {
        return false;
    }
    let text = match SceneText::from_scene(&scene) {
        Ok(text) => text,
        Err(e) => return says(&e),
    };
    let source = SceneSource::Explicit(Box::new(text));
    for toml in [source.to_toml(), source.to_commented_toml()] {
        let toml = toml.expect("writes");
        let again = SceneSource::parse(&toml, &[]).and_then(|source| source.build());
        let again = again.unwrap_or_else(|e| panic!("{e}\n{toml}"));
        assert_eq!(format!("{again:?}"), format!("{scene:?}"), "{toml}");
    }
    true
}

/// Judges the result of a backend; true if it solved the system.
fn solved(result: Result<(), SolveError>, x: &[f64], backend: &Backend) -> bool {
    match result {
        Ok(()) => {
            finite(x, backend);
            true
        }
        Err(e) => says(&e),
    }
}

/// The residual of A x = b, in double-double arithmetic, is at most the claimed one. It is NaN for
/// norms beyond the range of doubles, which prove nothing.
fn verified(report: &SolveReport, backend: &Backend, a: &Matrix, b: &[f64], x: &[f64]) {
    if report.is_claim() {
        let over = over_claim(&alone(a, b, x), backend);
        let holds = over.is_nan() || over <= 1.0;
        assert!(holds, "{backend}: {report:?}, {over:e} times its claim");
    }
}

fn solve(
    backend: &Backend,
    a: &SymBlockMatrix,
    b: &[f64],
    x: &mut [f64],
) -> Result<(), SolveError> {
    let mut solver = backend.create()?;
    solver.analyze(a.pattern())?;
    solver.factorize(a)?;
    solver.solve(a, b, x)?;
    // Again, as steps do.
    solver.factorize(a)?;
    let report = solver.solve(a, b, x)?;
    // A direct solver by itself does not look at what it left; refinement does.
    if backend.is_iterative() {
        verified(&report, backend, &Matrix::Symmetric(a.clone()), b, x);
    }
    Ok(())
}

/// Matrices and right-hand sides of any numbers, by every backend.
pub fn matrix_and_rhs(data: &[u8]) -> bool {
    let mut bytes = Bytes::new(data);
    let kind = bytes.byte();
    let blocks = bytes.below(6);
    let sizes: Vec<usize> = (0..blocks).map(|_| bytes.below(7)).collect();
    let couplings = bytes.below(8);
    let couplings = (0..couplings).map(|_| (bytes.below(blocks + 1), bytes.below(blocks)));
    let couplings: Vec<_> = couplings.collect();
    let groups: Vec<u32> = (0..blocks).map(|_| u32::from(bytes.byte() % 3)).collect();
    let pattern = BlockPattern::new(&sizes, &couplings).and_then(|p| p.with_groups(groups));
    let pattern = match pattern {
        Ok(pattern) => Arc::new(pattern),
        Err(e) => return says(&e),
    };
    let mut a = SymBlockMatrix::zeros(pattern.clone());
    for value in a.values_mut() {
        *value = bytes.number();
    }
    // Else all are refused or pivoted: diagonals that lead.
    for j in 0..if kind.is_multiple_of(4) {
        0
    } else {
        pattern.blocks()
    } {
        let (n, k) = (pattern.size(j), pattern.column(j).start);
        let block = a.block_mut(k);
        for r in 0..n {
            for c in 0..r {
                block[r + n * c] = block[c + n * r];
            }
            block[r * (n + 1)] += if kind % 4 == 1 { 0.0 } else { 100.0 };
        }
    }
    let b: Vec<f64> = (0..a.dim()).map(|_| bytes.number()).collect();
    let guess: Vec<f64> = (0..a.dim()).map(|_| bytes.number()).collect();
    let mut any = false;
    for backend in backends() {
        let mut x = guess.clone();
        any |= solved(solve(&backend, &a, &b, &mut x), &x, &backend);
    }
    let mut entries = Vec::new();
    a.for_each_lower(|r, c, value| entries.push((r, c, value)));
    let general = match GeneralMatrix::from_entries(a.dim(), entries) {
        Ok(general) => general,
        Err(e) => return says(&e),
    };
    let matrix = Matrix::General(general.clone());
    for backend in backends() {
        let mut x = guess.clone();
        let result = GeneralSolver::analyze(&backend, &general).and_then(|mut solver| {
            solver.factorize(&general)?;
            let report = solver.solve(&general, &b, &mut x)?;
            verified(&report, &backend, &matrix, &b, &x);
            Ok(())
        });
        any |= solved(result, &x, &backend);
    }
    any
}

/// The text of a Matrix Market file, as a matrix and as a vector; small matrices are solved.
pub fn matrix_market(data: &[u8]) -> bool {
    let path = Path::new("any.mtx");
    let read = match market::read_from(data, path) {
        Ok(read) => read,
        Err(e) => return says(&e),
    };
    if read.rows <= 1 << 20
        && let Err(e) = vector_of(&read, path, read.rows)
    {
        says(&e);
    }
    let matrix = match matrix_of(&read, path) {
        Ok((matrix, _)) => matrix,
        Err(e) => return says(&e),
    };
    if matrix.dim() > ROWS {
        return false;
    }
    let problem = Problem::new(&matrix);
    let b = vec![1.0; matrix.dim()];
    let mut any = false;
    for backend in backends() {
        let mut x = vec![0.0; matrix.dim()];
        let result = problem.analyze(&backend).and_then(|mut prepared| {
            prepared.factorize()?;
            let report = prepared.solve(&b, &mut x)?;
            verified(&report, &backend, &matrix, &b, &x);
            Ok(())
        });
        any |= solved(result, &x, &backend);
    }
    if let Matrix::Symmetric(a) = &matrix {
        let error = taut_solver::backward_error(a, &b, &b);
        assert!(error.is_ok(), "of this dimension");
    }
    any
}

/// A saved run, as JSON or as CBOR.
pub fn saved_run(data: &[u8]) -> bool {
    let read: Option<SavedRun> = match std::str::from_utf8(data).ok().map(RunFile::parse) {
        Some(Ok(file)) => Some(file.run),
        Some(Err(e)) => {
            says(&e);
            None
        }
        None => None,
    };
    let read = match read {
        Some(run) => run,
        None => match ciborium::from_reader(data) {
            Ok(run) => run,
            // In the words of the library that reads CBOR, which are not ours.
            Err(_) => return false,
        },
    };
    let run: SavedRun = read;
    let (bodies, most) = (run.scene().bodies.len(), 100_000);
    let work = run
        .options()
        .substeps
        .saturating_mul(run.options().refinements.max(1));
    let guard = run.options().guard.map_or(1, |g| {
        g.substeps
            .saturating_mul(g.passes)
            .saturating_mul(1 << g.halvings.min(20))
    });
    let heavy = work.saturating_mul(guard).saturating_mul(bodies) > most;
    let text = run.options().backend.to_string();
    if bodies > BODIES || heavy || iterations(&text) > 2000 {
        return false;
    }
    match Stepper::restore(run) {
        Ok(mut stepper) => {
            step(&mut stepper, &mut Bytes::new(&[]));
            true
        }
        Err(e) => says(&e),
    }
}

/// The limit of iterations in a backend's text.
fn iterations(backend: &str) -> usize {
    let options = backend.split(':');
    let limit = options.filter_map(|o| o.strip_prefix("iterations=")?.parse().ok());
    limit.max().unwrap_or(1)
}

/// Choices of features: whatever they are, their scene is refused or keeps all invariants of [`crate::products`].
pub fn products(data: &[u8]) -> bool {
    let choices = Choices::of_bytes(data);
    match judge(&choices) {
        Outcome::Sound(_) => true,
        Outcome::Refused(_) => false,
        Outcome::Violated(found) => {
            let (small, violation) = smallest(&choices, &found);
            panic!("{violation:?}\n{}", toml(&small).unwrap_or_default());
        }
    }
}

/// Lines of a recording that was just written, one for each chunk: its item as JSON, a tab, and the
/// hexadecimal digits of the bytes behind the item.
pub fn lines_of_recording(file: &[u8]) -> String {
    let mut text = String::new();
    let mut rest = &file[16..];
    while rest.len() > 8 {
        let length = u32::from_le_bytes([rest[0], rest[1], rest[2], rest[3]]) as usize;
        let mut bytes = Vec::new();
        let mut reader = flate2::read::DeflateDecoder::new(&rest[8..8 + length]);
        reader.read_to_end(&mut bytes).expect("deflated");
        let mut tail = &bytes[..];
        let item: serde_json::Value = ciborium::from_reader(&mut tail).expect("CBOR");
        let digits: String = tail.iter().map(|byte| format!("{byte:02x}")).collect();
        text += &format!("{item}\t{digits}\n");
        rest = &rest[8 + length..];
    }
    text
}

/// A recording of those lines, whole whatever they hold.
fn recording_of(text: &str) -> Option<Vec<u8>> {
    let mut file = b"taut-recording\n\x01".to_vec();
    for line in text.lines() {
        let (item, digits) = line.split_once('\t').unwrap_or((line, ""));
        let item: serde_json::Value = serde_json::from_str(item).ok()?;
        let mut bytes = Vec::new();
        ciborium::into_writer(&item, &mut bytes).ok()?;
        let pairs = digits.as_bytes().chunks_exact(2);
        let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok();
        bytes.extend(pairs.map_while(byte));
        let level = flate2::Compression::fast();
        let mut deflated = Vec::new();
        flate2::read::DeflateEncoder::new(&bytes[..], level)
            .read_to_end(&mut deflated)
            .ok()?;
        file.extend((deflated.len() as u32).to_le_bytes());
        file.extend(crc32fast::hash(&deflated).to_le_bytes());
        file.extend(deflated);
    }
    Some(file)
}

/// Recordings, by their [lines](lines_of_recording) or as they are: read, and shown in every form.
pub fn recording(data: &[u8]) -> bool {
    let lines = std::str::from_utf8(data).ok().and_then(recording_of);
    let file = lines.as_deref().unwrap_or(data);
    let recording = match Recording::read(&mut &file[..]) {
        Ok(recording) => recording,
        Err(e) => return says(&e),
    };
    let names = recording.parts.iter().flat_map(|p| &p.layout.channels);
    let names: Vec<String> = names.map(|c| c.name.clone()).take(20).collect();
    let mut out = Vec::new();
    if let Ok(rows) = table(&recording, &names) {
        rows(&mut out).expect("memory takes all");
    }
    let _ = page(&[("a", &recording)]).expect("a page");
    let _ = animation(&recording, true);
    // A picture takes as long as many of the others.
    if data.len().is_multiple_of(16) {
        let _ = still(&recording, 0.0);
    }
    recording.frames() > 0
}
