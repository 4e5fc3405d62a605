//! What commands that end in checks share: how many came to what, and the exit code.

use crate::Failure;
use std::fmt::Write;
use taut_bench::check::{Check, Verdict};

/// How many checks came to what.
pub(crate) fn summary(checks: &[Check]) -> String {
    use Verdict::{DoesNotHold, Fail, Holds, HoldsOnlyIf, Limit, NotYet, Pass};
    let mut out = format!("\n{} checks:", checks.len());
    for verdict in [Pass, Fail, NotYet, Limit, Holds, HoldsOnlyIf, DoesNotHold] {
        let count = checks.iter().filter(|c| c.verdict == verdict).count();
        if count > 0 {
            let _ = write!(out, " {count} {verdict}");
            let beyond = |c: &&Check| c.verdict == verdict && c.is_beyond();
            let beyond = checks.iter().filter(beyond).count();
            if verdict == Limit && beyond > 0 {
                let _ = write!(out, " ({beyond} beyond the catalogue's bar)");
            }
            out.push(',');
        }
    }
    out.trim_end_matches(',').to_owned() + "\n"
}

/// Code 1 where a bar of our own is missed.
pub(crate) fn judge(checks: &[Check]) -> Result<(), Failure> {
    let failed = checks.iter().filter(|c| c.verdict == Verdict::Fail).count();
    if failed == 0 {
        return Ok(());
    }
    Err(Failure::Check(format!(
        "{failed} of {} checks miss their bar",
        checks.len()
    )))
}
