//! How often a solver that says it has solved a system has.

use super::Record;

/// Claims of a solver over all its rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Claims {
    pub backend: String,
    /// Solves measured.
    pub solves: usize,
    /// Solves claimed.
    pub claimed: usize,
    /// Claims whose residual met the tolerance by the letter.
    pub verified: usize,
    /// Claims that are true with rounding allowed for; none where the rows are older than that count.
    pub to_rounding: Option<usize>,
}

impl Claims {
    /// Claims that hold for rounding's sake alone.
    #[must_use]
    pub fn rounded(&self) -> Option<usize> {
        Some(self.to_rounding?.saturating_sub(self.verified))
    }

    /// Claims that are false, whatever rounding leaves.
    #[must_use]
    pub fn false_ones(&self) -> Option<usize> {
        Some(self.claimed.saturating_sub(self.to_rounding?))
    }
}

/// The claims of each solver, in the order of the rows. Rows without such counts are left out.
#[must_use]
pub fn claims(records: &[Record]) -> Vec<Claims> {
    let mut all: Vec<Claims> = Vec::new();
    for r in records {
        let counts = (r.claimed_converged, r.verified_converged);
        let (claimed, verified, to_rounding) = match (counts, &r.error) {
            ((Some(claimed), Some(verified)), _) => (claimed, verified, r.verified_to_rounding),
            // A failed row claims nothing.
            (_, Some(_)) => (0, 0, Some(0)),
            _ => continue,
        };
        let own = Claims {
            backend: r.backend.clone(),
            solves: r.frames,
            claimed,
            verified,
            to_rounding,
        };
        match all.iter_mut().find(|c| c.backend == r.backend) {
            None => all.push(own),
            Some(sum) => {
                sum.solves = sum.solves.saturating_add(own.solves);
                sum.claimed = sum.claimed.saturating_add(claimed);
                sum.verified = sum.verified.saturating_add(verified);
                let both = sum.to_rounding.zip(own.to_rounding);
                sum.to_rounding = both.map(|(a, b)| a.saturating_add(b));
            }
        }
    }
    all
}
