//! The long swing of H49 that no row shows.

use taut_studies::hard::coded::long_run;

use indicatif::ProgressBar;

#[test]
fn a_swing_goes_on_and_on() {
    let first = long_run::WINDOW;
    let windows = long_run::run(12 * first, &ProgressBar::hidden()).expect("steps");
    let steps: Vec<usize> = windows.iter().map(|w| w.steps).collect();
    assert_eq!(steps, [first, 10 * first, 12 * first]);
}
