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
use nalgebra::Vector3;
use std::f64::consts::FRAC_PI_2;
use taut_integrator::Scheme;
use taut_measure::random::Random;

pub(super) const ORACLES: &[Function] = &[
    // Complete elliptic integral of the first kind of the modulus k.
    ("complete_k", 1, |x| special::elliptic(FRAC_PI_2, x[0])[0]),
    // θ of the first mode of N masses in a row with an end mass, all together so many times it.
    ("end_mass", 2, |x| of(x[0], 1, |n| bar::end_mass(n, x[1]))),
    // β of β tan β = ratio.
    ("end_mass_continuum", 1, |x| bar::end_mass_continuum(x[0])),
    // √(k/m) t of the front's arrival at mass j of N.
    ("bar_front", 2, |x| {
        of(x[0], 1, |n| of(x[1], 0, |j| bar::front(n, j)))
    }),
    // √(g/L) t in which the tip of a folded chain falls by x L.
    ("folded_fall", 1, |x| fall::time(x[0])),
    // Greenhill's torque of N segments over EI/L, from EA L²/EI and P L²/EI.
    ("buckling_torque", 3, |x| {
        of(x[0], 2, |n| buckling_torque(n, x[1], x[2]))
    }),
    // Growth of the amplitude of a pendulum that is hauled in from 10 to 5 m, and ratio of its action, from the speed.
    ("hoisted_growth", 1, |x| hauled(x[0], 0)),
    ("hoisted_action", 1, |x| hauled(x[0], 1)),
    // (βL)² of a beam's mode from 1, and ω of N rods, of a cantilever (0) or of one clamped at both ends (1).
    ("beam", 2, |x| {
        of(x[1], 1, |mode| beam::square(x[0] != 0.0, mode))
    }),
    ("rods_in_bending", 3, |x| {
        let frequency = |all: Vec<f64>, mode: usize| all.get(mode - 1).copied().unwrap_or(f64::NAN);
        of(x[1], 2, |n| {
            of(x[2], 1, |mode| frequency(beam::rods(x[0] != 0.0, n), mode))
        })
    }),
    // ω₁ √(L/g) of a chain of so many times its payload's mass; of N masses of 1 but for the last.
    ("payload_chain", 1, |x| chain::loaded(x[0])),
    ("payload_masses", 2, |x| {
        of(x[0], 1, |n| chain::masses(n, x[1]))
    }),
    // Zeros: of Laguerre's L_N from 0 on, of the Bessel function of some order from 1 on.
    ("laguerre_zero", 2, |x| {
        let zero = |n, k: usize| {
            special::laguerre_zeros(n)
                .get(k)
                .copied()
                .unwrap_or(f64::NAN)
        };
        of(x[0], 1, |n| of(x[1], 0, |k| zero(n, k)))
    }),
    ("bessel_zero", 2, |x| {
        of(x[1], 1, |k| special::bessel_zero(x[0], k))
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
    ("links_pull", 3, |x| {
        of(x[0], 1, |_| catenary::chain(x).1[0])
    }),
    ("links_tension", 3, |x| {
        of(x[0], 1, |_| catenary::chain(x).1[1])
    }),
    ("links_sag", 3, |x| of(x[0], 1, |_| catenary::chain(x).1[2])),
    ("links_x", 4, |x| link(x).x),
    ("links_z", 4, |x| link(x).z),
    // Tip of the elastica of length 1 from α; of a bow of 45° from the load across it, as soft across as along (1) or not (0) \[m].
    ("elastica_x", 1, |x| elastica::elastica(x[0])[0]),
    ("elastica_y", 1, |x| elastica::elastica(x[0])[1]),
    ("elastica_slope", 1, |x| elastica::elastica(x[0])[2]),
    ("bow_x", 2, |x| bow::tip(x[0], x[1]).x),
    ("bow_y", 2, |x| bow::tip(x[0], x[1]).y),
    ("bow_z", 2, |x| bow::tip(x[0], x[1]).z),
    // Weight per length at which a clamped chain of N segments buckles, over EI/L³.
    ("column_weight", 1, |x| of(x[0], 2, column::own_weight)),
    // Turns of a ring of N segments, GJ = 3 EI, at which it leaves its plane in so many waves.
    ("ring_turns", 2, |x| {
        of(x[0], 3, |n| of(x[1], 1, |waves| ring::chain(n, waves)))
    }),
    // Masses that slip on a cylinder, from their number and the second load (kg): ratio of the legs' tensions, acceleration of the
    // loads; and the load that they hold.
    ("wound_ratio", 2, |x| {
        of(x[0], 1, |n| wound::accelerated(n, x[1])[1])
    }),
    ("wound_sinking", 2, |x| {
        of(x[0], 1, |n| wound::accelerated(n, x[1])[0])
    }),
    ("wound_limit", 1, |x| of(x[0], 1, wound::limit)),
    // Where segment i of N of random lengths begins, from N, the seed, the share of the first half and i \[m].
    ("uneven", 4, |x| {
        of(x[0], 1, |n| {
            let begin = |i| uneven::begin(n, x[1] as u64, x[2], i);
            of(x[3], 0, |i| if i <= n { begin(i) } else { f64::NAN })
        })
    }),
    // Random numbers by seed and place in its sequence: in −1 … 1, and whole ones below another.
    ("drawn", 2, |x| drawn(x, Random::uniform)),
    ("drawn_below", 3, |x| {
        of(x[2], 1, |most| drawn(x, |random| random.below(most) as f64))
    }),
];

/// A function of a count from `least` to [`MOST`]; NaN of any other number.
fn of(count: f64, least: usize, function: impl Fn(usize) -> f64) -> f64 {
    if count >= least as f64 && count <= MOST {
        function(count as usize)
    } else {
        f64::NAN
    }
}

/// Most masses, segments and modes: matrices of as many rows.
const MOST: f64 = 2e3;

/// Where a link of a catenary's chain starts or ends.
fn link(x: &[f64]) -> Vector3<f64> {
    let nowhere = Vector3::repeat(f64::NAN);
    if of(x[0], 1, |_| 0.0).is_nan() || !(0.0..=2.0 * MOST).contains(&x[3]) {
        return nowhere;
    }
    let (places, _) = catenary::chain(x);
    places.get(x[3] as usize).copied().unwrap_or(nowhere)
}

/// At a speed of 1 mm/s and more: a slower pendulum swings for days.
fn hauled(speed: f64, number: usize) -> f64 {
    if speed >= 1e-3 {
        hoist::of_equation(speed)[number]
    } else {
        f64::NAN
    }
}

fn largest_root(x: &[f64]) -> [f64; 2] {
    let weighed = x.first_chunk().map(law::weighed);
    let root = weighed.and_then(|law| law::roots(&law).first().copied());
    root.unwrap_or([f64::NAN; 2])
}

/// What the generator of a seed draws after so many numbers.
fn drawn(x: &[f64], draw: impl Fn(&mut Random) -> f64) -> f64 {
    if !(0.0..=1e6).contains(&x[1]) {
        return f64::NAN;
    }
    let mut random = Random::new(x[0] as u64);
    for _ in 0..x[1] as usize {
        random.bits();
    }
    draw(&mut random)
}
