//! Parts of H43 and H49 that no row shows.

use taut_studies::hard::numerics::angles::joints::{Kind, Pose, jacobian_error};
use taut_studies::hard::numerics::long_run;

use indicatif::ProgressBar;
use std::f64::consts::PI;

#[test]
fn a_swing_goes_on_and_on() {
    let first = long_run::WINDOW;
    let windows = long_run::run(12 * first, &ProgressBar::hidden()).expect("steps");
    let steps: Vec<usize> = windows.iter().map(|w| w.steps).collect();
    assert_eq!(steps, [first, 10 * first, 12 * first]);
}

/// A wrong Jacobian would be seen: the paper's bend row has one where its safeguard is not small against the angle.
#[test]
fn jacobians_that_are_off_are_seen() {
    let pose = Pose {
        turn: nalgebra::UnitQuaternion::identity(),
        across: 0.3,
        twist: 0.2,
    };
    let error = |kind, theta| jacobian_error(kind, theta, &pose);
    let safeguard = error(Kind::PaperBend, 1e-10);
    assert!(safeguard > 5e-5, "{safeguard:e}");
    assert!(error(Kind::Cosserat, 1e-10) < 1e-9);
    assert!(error(Kind::Cosserat, PI - 1e-9) < 1e-6);
}
