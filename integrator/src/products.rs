//! Matrix-free products with the Jacobian.

use taut_model::Linearized;

/// p += Jᵀ μ; p: 6 numbers a body, μ: one a row.
pub(crate) fn add_transposed(rows: &Linearized, mu: &[f64], p: &mut [f64]) {
    for slot in &rows.slots {
        let mu = &mu[rows.row_range(slot.constraint)];
        let p = &mut p[6 * slot.body..6 * slot.body + 6];
        for (j, &mu) in rows.jacobian[slot.offset..].chunks_exact(6).zip(mu) {
            for (p, j) in p.iter_mut().zip(j) {
                *p += j * mu;
            }
        }
    }
}

/// r −= J v; v: 6 numbers a body, r: one a row.
pub(crate) fn subtract_jacobian(rows: &Linearized, v: &[f64], r: &mut [f64]) {
    for slot in &rows.slots {
        let r = &mut r[rows.row_range(slot.constraint)];
        let v = &v[6 * slot.body..6 * slot.body + 6];
        for (j, r) in rows.jacobian[slot.offset..].chunks_exact(6).zip(r) {
            *r -= j.iter().zip(v).map(|(j, v)| j * v).sum::<f64>();
        }
    }
}
