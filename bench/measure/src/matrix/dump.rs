//! The linear system of a step as files: both forms, with their exact solutions.
//!
//! A step has one system or, where the guard or rows with bounds redo it, several; written is the one that it begins
//! with, its rows at their bounds where these settle. For S there are two solutions: `_x` is that of S as it was
//! rounded, which is what a linear solver is to find; `_mu` are the multipliers of the pieces that S was formed from,
//! which the step is after and refinement from the pieces brings back.

use super::write;
use crate::files::{FileError, make_folder};
use std::path::{Path, PathBuf};
use taut_integrator::{Form, StepError, Stepper};
use taut_solver::{SolveError, SymBlockMatrix, forward_error, reference_solution};

/// A system with what is known of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Dumped {
    pub form: Form,
    pub matrix: SymBlockMatrix,
    pub b: Vec<f64>,
    /// The solution of A x = b in extended precision, rounded, or the error of finding it.
    pub x: Result<Vec<f64>, SolveError>,
    /// For S only: multipliers of the pieces in extended precision, rounded \[N s, N m s].
    pub multipliers: Option<Vec<f64>>,
    /// For the KKT matrix only: true for each block row with positive pivots, as those of bodies
    /// have.
    pub signs: Vec<bool>,
}

/// The system of the step that follows the present state: S, then the KKT matrix of the same pieces. That of the
/// stepper's own form is the one that it solved, to the last bit. The state stays as [`Stepper::begin`] leaves it; the
/// geometric stiffness of the next step is made of the tension found here.
pub fn systems(stepper: &mut Stepper) -> Result<[Dumped; 2], StepError> {
    let [(matrix, b), (kkt, kkt_b)] = assembled(stepper)?;
    let x = reference_solution(&kkt, &kkt_b);
    let signs = body_rows(&kkt);
    // The constraints stand in the same order in both forms.
    let p = kkt.pattern();
    let rows = || {
        (0..p.blocks())
            .filter(|&i| !signs[i])
            .flat_map(|i| p.rows(i))
    };
    let multipliers = x.as_ref().ok().map(|x| rows().map(|r| -x[r]).collect());
    let schur = Dumped {
        form: Form::Schur,
        x: reference_solution(&matrix, &b),
        matrix,
        b,
        multipliers,
        signs: Vec::new(),
    };
    let kkt = Dumped {
        form: Form::Kkt,
        matrix: kkt,
        b: kkt_b,
        x,
        multipliers: None,
        signs,
    };
    Ok([schur, kkt])
}

/// Matrix and right-hand side of both forms, without their solutions: see [`systems`].
pub fn assembled(stepper: &mut Stepper) -> Result<[(SymBlockMatrix, Vec<f64>); 2], StepError> {
    stepper.begin()?;
    // A second solve would have another geometric stiffness, made of the tension of the first.
    stepper.solve()?;
    Ok([in_form(stepper, Form::Schur)?, in_form(stepper, Form::Kkt)?])
}

/// Matrix and right-hand side of the last solve.
fn in_form(stepper: &mut Stepper, form: Form) -> Result<(SymBlockMatrix, Vec<f64>), StepError> {
    if stepper.options().form == form {
        let (matrix, b, _) = stepper.system();
        return Ok((matrix.clone(), b.to_vec()));
    }
    stepper.assembled(form)
}

/// The block rows of bodies: their masses stand on the diagonal, −Σ ≤ 0 on that of constraints.
pub fn body_rows(a: &SymBlockMatrix) -> Vec<bool> {
    let p = a.pattern();
    (0..p.blocks())
        .map(|i| {
            let n = p.size(i);
            let mut diagonal = a.block(p.column(i).start).iter().step_by(n + 1);
            n > 0 && diagonal.all(|&d| d > 0.0)
        })
        .collect()
}

/// Name of the files and extra comment lines.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Label {
    /// Name of the matrix; the KKT form has `_kkt` after it.
    pub name: String,
    /// Lines about scene and state.
    pub comments: Vec<String>,
}

/// Writes a system to `folder`: A, `_b`, `_x` and `_mu` where these are known. Returns the files.
pub fn write(
    system: &Dumped,
    label: &Label,
    folder: &Path,
    gzip: bool,
) -> Result<Vec<PathBuf>, FileError> {
    make_folder(folder)?;
    let name = match system.form {
        Form::Kkt => format!("{}_kkt", label.name),
        _ => label.name.clone(),
    };
    let with = |more: &[&str]| {
        let lines = label.comments.iter().cloned();
        lines
            .chain(more.iter().map(|line| (*line).to_owned()))
            .collect::<Vec<_>>()
    };
    let form = match system.form {
        Form::Kkt => {
            "form kkt: [M J'; J -Sigma], quasi-definite; unknowns: velocity changes and -mu"
        }
        _ => "form schur: S = J M^-1 J' + Sigma, positive definite; unknowns: impulses mu",
    };
    let mut written = Vec::new();
    let mut put = |what: &str, text: &str| {
        written.push(write::file(folder, &format!("{name}{what}"), text, gzip)?);
        Ok(())
    };
    put(
        "",
        &write::symmetric(&system.matrix, &system.signs, &with(&[form])),
    )?;
    put(
        "_b",
        &write::vector(&system.b, &with(&[form, "b: right-hand side"])),
    )?;
    if let Ok(x) = &system.x {
        let comment =
            "x: solution of A x = b with A as it stands in the file, in 32 digits, rounded";
        put("_x", &write::vector(x, &with(&[form, comment])))?;
    }
    if let Some(mu) = &system.multipliers {
        let mut comments = vec![
            "mu: multipliers of the pieces M, J, Sigma, from the KKT matrix in 32 digits, rounded"
                .to_owned(),
        ];
        if let Ok(x) = &system.x {
            let lost = forward_error(x, mu);
            comments.push(format!(
                "x of the rounded S is {lost:.1e} off (relative, largest norm)"
            ));
        }
        let comments: Vec<&str> = comments.iter().map(String::as_str).collect();
        put(
            "_mu",
            &write::vector(mu, &with(&[&[form], &comments[..]].concat())),
        )?;
    }
    Ok(written)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::choice::Choice;
    use crate::matrix::{Matrix, System};
    use taut_integrator::StepOptions;
    use taut_model::HoistParams;

    fn bits(v: &[f64]) -> Vec<u64> {
        v.iter().map(|v| v.to_bits()).collect()
    }

    fn stepper(form: Form) -> Stepper {
        let scene = HoistParams {
            segments: 5,
            move_x: 0.5,
            seed: 3,
            ..HoistParams::default()
        };
        let options = StepOptions {
            form,
            ..Choice::schur(taut_solver::Backend::Dense(Default::default())).options(1.0 / 60.0)
        };
        let mut stepper = Stepper::new(scene.build().expect("builds"), options).expect("starts");
        for _ in 0..4 {
            stepper.step().expect("steps");
        }
        stepper
    }

    /// A written system equals the stepper's and reads back bit by bit, with blocks and groups.
    #[test]
    fn systems_come_back_as_they_were() {
        let folder = std::env::temp_dir().join(format!("taut-dump-{}", std::process::id()));
        for form in [Form::Schur, Form::Kkt] {
            let mut stepper = stepper(form);
            let [schur, kkt] = systems(&mut stepper).expect("systems");
            let dumped = if form == Form::Kkt { kkt } else { schur };
            let (a, b, _) = stepper.system();
            assert_eq!(a.pattern(), dumped.matrix.pattern(), "{form}");
            assert_eq!(bits(a.values()), bits(dumped.matrix.values()), "{form}");
            assert_eq!(bits(b), bits(&dumped.b), "{form}");
            for gzip in [false, true] {
                let label = Label {
                    name: format!("hoist{gzip}"),
                    comments: vec!["scene hoist".to_owned()],
                };
                let files = write(&dumped, &label, &folder, gzip).expect("written");
                let read = System::read(&files[0], None, None).expect("read");
                let Matrix::Symmetric(back) = &read.matrix else {
                    panic!("symmetric")
                };
                assert_eq!(back.pattern(), dumped.matrix.pattern());
                let mut values = Vec::new();
                back.for_each_lower(|_, _, v| values.push(v));
                let mut at = 0;
                dumped.matrix.for_each_lower(|_, _, v| {
                    assert_eq!(v.to_bits(), values[at].to_bits());
                    at += 1;
                });
                assert_eq!(bits(&read.b), bits(&dumped.b));
                let (x, _) = read.x.expect("beside it");
                assert_eq!(bits(&x), bits(dumped.x.as_ref().expect("solved")));
                let market = crate::matrix::market::read(&files[0]).expect("read");
                assert_eq!(market.signs, dumped.signs);
                if !gzip {
                    let text = std::fs::read_to_string(&files[0]).expect("read");
                    assert!(text.contains("\n% scene hoist\n"), "{text}");
                }
            }
        }
        std::fs::remove_dir_all(folder).expect("removed");
    }

    /// With damping what a staggered scheme does to the velocities before its first step is in the system.
    #[test]
    fn the_first_system_is_that_of_the_first_step() {
        let scene = HoistParams {
            segments: 5,
            initial_angle: 0.5,
            seed: 2,
            damping: 0.05,
            ..HoistParams::default()
        };
        let options =
            Choice::schur(taut_solver::Backend::Dense(Default::default())).options(1.0 / 60.0);
        let [mut dumped, mut stepped] = [(); 2].map(|()| {
            Stepper::new(scene.build().expect("builds"), options.clone()).expect("starts")
        });
        let [schur, _] = systems(&mut dumped).expect("systems");
        stepped.step().expect("steps");
        let exact = schur.multipliers.expect("solved");
        assert!(forward_error(stepped.multipliers(), &exact) < 1e-12);
    }

    /// Both forms are of one system, that of the stepper's own reference; the stepper's state stays as it is.
    #[test]
    fn both_forms_have_the_same_multipliers() {
        let mut asked = stepper(Form::Schur);
        let mut other = stepper(Form::Schur);
        // Oracle: the stepper's own extended precision, of the state before any solve of it.
        let exact = other.reference_multipliers().expect("solved");
        let [schur, kkt] = systems(&mut asked).expect("systems");
        assert_eq!(schur.multipliers, Some(exact.clone()));
        let error = forward_error(schur.x.as_ref().expect("solved"), &exact);
        assert!(error < 1e-13, "{error:e}");
        let found = kkt.signs.iter().filter(|s| **s).count();
        assert_eq!(found, asked.scene().bodies.len());
        let places = |s: &Stepper| s.scene().bodies.clone();
        assert_eq!(places(&asked), places(&stepper(Form::Schur)));
        // Asked of a stepper with the other form it is the same system but for rounding.
        let [other, _] = systems(&mut stepper(Form::Kkt)).expect("systems");
        assert!(forward_error(other.matrix.values(), schur.matrix.values()) < 1e-6);
        assert!(forward_error(&other.b, &schur.b) < 1e-6);
    }
}
