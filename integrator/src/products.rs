//! Matrix-free products with the Jacobian.

use taut_model::Linearized;

/// p += Jᵀ μ; p: 6 numbers a body, μ: one a row.
pub(crate) fn add_transposed(rows: &Linearized, mu: &[f64], p: &mut [f64]) {
    let (p, _) = p.as_chunks_mut::<6>();
    for slot in &rows.slots {
        let mu = &mu[rows.row_range(slot.constraint)];
        let (jacobian, _) = rows.jacobian[slot.offset..].as_chunks::<6>();
        let p = &mut p[slot.body];
        for (j, mu) in jacobian.iter().zip(mu) {
            for (p, j) in p.iter_mut().zip(j) {
                *p += j * mu;
            }
        }
    }
}

/// r −= J v; v: 6 numbers a body, r: one a row.
pub(crate) fn subtract_jacobian(rows: &Linearized, v: &[f64], r: &mut [f64]) {
    let (v, _) = v.as_chunks::<6>();
    for slot in &rows.slots {
        let r = &mut r[rows.row_range(slot.constraint)];
        let (jacobian, _) = rows.jacobian[slot.offset..].as_chunks::<6>();
        for (j, r) in jacobian.iter().zip(r) {
            *r -= dot(j, &v[slot.body]);
        }
    }
}

/// a · b, summed in two halves: a shorter chain of additions.
#[inline]
pub(crate) fn dot(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    (a[0] * b[0] + a[2] * b[2] + a[4] * b[4]) + (a[1] * b[1] + a[3] * b[3] + a[5] * b[5])
}
