//! Every way in which a call can fail, some hundred times each: what a leak checker is to watch (`.ci/leaks`).

use taut_umfpack::{Error, Numeric, Options, Symbolic};

const COLUMNS: [i32; 4] = [0, 2, 4, 6];
const ROWS: [i32; 6] = [0, 1, 0, 1, 1, 2];
const REGULAR: [f64; 6] = [4.0, 1.0, 1.0, 3.0, 0.5, 2.0];
const SINGULAR: [f64; 6] = [1.0, 1.0, 1.0, 1.0, 0.0, 0.0];

/// All failures of one round, counted.
fn round() -> Result<usize, Error> {
    let options = Options::default();
    let analyse = |n, rows: &[i32], values: Option<&[f64]>| {
        Symbolic::new(n, &COLUMNS, rows, values, &options)
    };
    let symbolic = analyse(3, &ROWS, Some(&REGULAR))?;
    let mut numeric = Numeric::new(&symbolic, &COLUMNS, &ROWS, &REGULAR, &options)?;
    let mut x = [0.0; 3];
    let mut failures = 0;
    let mut failed = |error: Option<Error>| failures += usize::from(error.is_some());
    // Refused before C sees it.
    failed(analyse(4, &ROWS, None).err());
    failed(analyse(3, &[1, 0, 0, 1, 1, 2], None).err());
    failed(analyse(3, &ROWS, Some(&[f64::NAN; 6])).err());
    failed(analyse(usize::MAX, &ROWS, None).err());
    failed(
        numeric
            .solve(&COLUMNS, &ROWS, &REGULAR, &[1.0; 2], &mut x)
            .err(),
    );
    // Refused by C: once without factors before, once in their place.
    failed(Numeric::new(&symbolic, &COLUMNS, &ROWS, &SINGULAR, &options).err());
    failed(
        numeric
            .refactor(&symbolic, &COLUMNS, &ROWS, &SINGULAR)
            .err(),
    );
    failed(
        numeric
            .solve(&COLUMNS, &ROWS, &REGULAR, &[1.0; 3], &mut x)
            .err(),
    );
    // And well again, with a solution that overflows.
    numeric.refactor(&symbolic, &COLUMNS, &ROWS, &REGULAR)?;
    let tiny = REGULAR.map(|v| v * 1e-300);
    numeric.refactor(&symbolic, &COLUMNS, &ROWS, &tiny)?;
    failed(
        numeric
            .solve(&COLUMNS, &ROWS, &tiny, &[1e300; 3], &mut x)
            .err(),
    );
    Ok(failures)
}

fn main() -> Result<(), Error> {
    for _ in 0..100 {
        let failures = round()?;
        assert_eq!(failures, 9, "calls that should have failed");
    }
    println!("9 failing paths, 100 times each");
    Ok(())
}
