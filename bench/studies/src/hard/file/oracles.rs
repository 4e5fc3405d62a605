//! Exact answers that the files of cases may name: each has its derivation and its test where it is.

mod bar;
mod beam;
mod catch;
mod chain;
mod fall;
mod hoist;

use super::expression::Function;
use crate::hard::special;
use crate::law;
use crate::paper::specimens::twist;
use std::f64::consts::FRAC_PI_2;
use taut_integrator::Scheme;

pub(super) const ORACLES: &[Function] = &[
    // Complete elliptic integral of the first kind of the modulus k.
    ("complete_k", 1, |x| special::elliptic(FRAC_PI_2, x[0])[0]),
    // θ of the first mode of N masses in a row with an end mass, all together so many times it.
    ("end_mass", 2, |x| bar::end_mass(x[0] as usize, x[1])),
    // β of β tan β = ratio.
    ("end_mass_continuum", 1, |x| bar::end_mass_continuum(x[0])),
    // √(k/m) t of the front's arrival at mass j of N.
    ("bar_front", 2, |x| bar::front(x[0] as usize, x[1] as usize)),
    // √(g/L) t in which the tip of a folded chain falls by x L.
    ("folded_fall", 1, |x| fall::time(x[0])),
    // Greenhill's torque of N segments over EI/L, from EA L²/EI and P L²/EI.
    ("buckling_torque", 3, |x| {
        twist::buckling_torque(x[0] as usize, x[1], x[2])
    }),
    // Growth of the amplitude of a pendulum that is hauled in from 10 to 5 m, and ratio of its action, from the speed.
    ("hoisted_growth", 1, |x| hoist::of_equation(x[0])[0]),
    ("hoisted_action", 1, |x| hoist::of_equation(x[0])[1]),
    // (βL)² of a beam's mode from 1, and ω of N rods, of a cantilever (0) or of one clamped at both ends (1).
    ("beam", 2, |x| beam::square(x[0] != 0.0, x[1] as usize)),
    ("rods_in_bending", 3, |x| {
        let all = beam::rods(x[0] != 0.0, x[1] as usize);
        all.get(x[2] as usize - 1).copied().unwrap_or(f64::NAN)
    }),
    // ω₁ √(L/g) of a chain of so many times its payload's mass; of N masses of 1 but for the last.
    ("payload_chain", 1, |x| chain::loaded(x[0])),
    ("payload_masses", 2, |x| chain::masses(x[0] as usize, x[1])),
    // Zeros: of Laguerre's L_N from 0 on, of the Bessel function of some order from 1 on.
    ("laguerre_zero", 2, |x| {
        let zeros = special::laguerre_zeros(x[0] as usize);
        zeros.get(x[1] as usize).copied().unwrap_or(f64::NAN)
    }),
    ("bessel_zero", 2, |x| {
        special::bessel_zero(x[0], x[1] as usize)
    }),
    // Largest stretch and tension of a damped rope that catches a load, from compliance, damping, mass, slack and time.
    ("caught_stretch", 5, |x| {
        catch::caught([x[0], x[1], x[2], x[3], x[4]])[0]
    }),
    ("caught_tension", 5, |x| {
        catch::caught([x[0], x[1], x[2], x[3], x[4]])[1]
    }),
    // Frequency that the default step gives an elastic oscillation, from ω and Δt.
    ("stepped_elastic", 2, |x| {
        law::elastic_frequency(Scheme::default(), x[0], x[1])
    }),
    // Frequency that a step gives a swing of small amplitude, from ω and Δt.
    ("stepped_swing", 2, |x| law::geometric_frequency(x[0], x[1])),
];
