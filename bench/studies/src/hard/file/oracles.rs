//! Exact answers that the files of cases may name: each has its derivation and its test where it is.

mod bar;
mod beam;
mod bow;
mod catch;
mod catenary;
mod chain;
mod column;
mod elastica;
mod fall;
mod hoist;
mod ring;
mod uneven;
mod wound;

use super::expression::Function;
use crate::buckling::buckling_torque;
use crate::hard::special;
use crate::law;
use std::f64::consts::FRAC_PI_2;
use taut_ground::random::Random;
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
        buckling_torque(x[0] as usize, x[1], x[2])
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
    // Modulus and phase (rad) of the largest root of a step's law, by its weights, Ω and θ.
    ("law_modulus", 5, |x| largest_root(x)[0]),
    ("law_phase", 5, |x| largest_root(x)[1]),
    // Horizontal force, tension at the ends and sag of a catenary, from EA; of its chain of N links, from EA and whether its
    // masses are at the joints (1); and the place of the start (2i) and end (2i + 1) of link i.
    ("catenary_pull", 1, |x| catenary::continuum(x[0])[0]),
    ("catenary_tension", 1, |x| catenary::continuum(x[0])[1]),
    ("catenary_sag", 1, |x| catenary::continuum(x[0])[2]),
    ("links_pull", 3, |x| catenary::chain(x).1[0]),
    ("links_tension", 3, |x| catenary::chain(x).1[1]),
    ("links_sag", 3, |x| catenary::chain(x).1[2]),
    ("links_x", 4, |x| catenary::chain(x).0[x[3] as usize].x),
    ("links_z", 4, |x| catenary::chain(x).0[x[3] as usize].z),
    // Tip of the elastica of length 1 from α; of a bow of 45° from the load across it, as soft across as along (1) or not (0) \[m].
    ("elastica_x", 1, |x| elastica::elastica(x[0])[0]),
    ("elastica_y", 1, |x| elastica::elastica(x[0])[1]),
    ("elastica_slope", 1, |x| elastica::elastica(x[0])[2]),
    ("bow_x", 2, |x| bow::tip(x[0], x[1]).x),
    ("bow_y", 2, |x| bow::tip(x[0], x[1]).y),
    ("bow_z", 2, |x| bow::tip(x[0], x[1]).z),
    // Weight per length at which a clamped chain of N segments buckles, over EI/L³.
    ("column_weight", 1, |x| column::own_weight(x[0] as usize)),
    // Turns of a ring of N segments, GJ = 3 EI, at which it leaves its plane in so many waves.
    ("ring_turns", 2, |x| {
        ring::chain(x[0] as usize, x[1] as usize)
    }),
    // Masses that slip on a cylinder, from their number and the second load (kg): ratio of the legs' tensions, acceleration of the
    // loads; and the load that they hold.
    ("wound_ratio", 2, |x| {
        wound::accelerated(x[0] as usize, x[1])[1]
    }),
    ("wound_sinking", 2, |x| {
        wound::accelerated(x[0] as usize, x[1])[0]
    }),
    ("wound_limit", 1, |x| wound::limit(x[0] as usize)),
    // Where segment i of N of random lengths begins, from N, the seed, the share of the first half and i \[m].
    ("uneven", 4, |x| {
        uneven::begin(x[0] as usize, x[1] as u64, x[2], x[3] as usize)
    }),
    // Random numbers by seed and place in its sequence: in −1 … 1, and whole ones below another.
    ("drawn", 2, |x| drawn(x).uniform()),
    ("drawn_below", 3, |x| drawn(x).below(x[2] as usize) as f64),
];

fn largest_root(x: &[f64]) -> [f64; 2] {
    let weighed = x.first_chunk().map(law::weighed);
    let root = weighed.and_then(|law| law::roots(&law).first().copied());
    root.unwrap_or([f64::NAN; 2])
}

/// The generator of a seed after so many numbers.
fn drawn(x: &[f64]) -> Random {
    let mut random = Random::new(x[0] as u64);
    for _ in 0..x[1] as usize {
        random.bits();
    }
    random
}
