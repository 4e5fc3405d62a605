//! A slack rope with a damper catches a load where it is taut.
//!
//! With k = 1/ε, ω² = k/m and ζ = ωτ/2 the load stretches its rope by x from the speed v on, which it has at x = 0:
//!
//! ```text
//! m ẍ = m g − T,  T = max(0, k x + k τ ẋ) for x > 0, else 0;    x(0) = 0, ẋ(0) = v = √(2 g · slack)
//! ```
//!
//! Stretch and tension go about their values at rest as u = x − g/ω² and u = T/m − g, with
//!
//! ```text
//! ü + 2ζω u̇ + ω² u = 0:    u = e^(−ζωt) (u₀ C + (u̇₀ + ζω u₀) S)
//! C, S = cos w t, sin w t/w for ζ < 1;   1, t for ζ = 1;   cosh w t, sinh w t/w for ζ > 1
//! x − g/ω²: u₀ = −g/ω², u̇₀ = v;    T/m − g: u₀ = 2ζω v − g, u̇₀ = ω² v − 2ζω u₀
//! ```
//!
//! and w² = ω² |1 − ζ²|. The largest is where u̇ = 0, S/C = u̇₀/(ω² u₀ + ζω u̇₀), or at the beginning where u̇₀ < 0: there the
//! tension begins with its largest value, k τ v. A rigid rope has x = 0.

const GRAVITY: f64 = 9.81;

/// Largest u of the oscillator within `time` (s).
fn largest([omega, zeta]: [f64; 2], [u, rate]: [f64; 2], time: f64) -> f64 {
    let (a, square) = (zeta * omega, omega * omega * (1.0 - zeta * zeta));
    let (w, other) = (square.abs().sqrt(), omega * omega * u + a * rate);
    let turn = match square {
        _ if rate <= 0.0 => 0.0,
        0.0 => rate / other,
        x if x > 0.0 => (w * rate).atan2(other) / w,
        _ => (w * rate / other).atanh() / w,
    };
    // Where it only rises there is no turn, or one in the past.
    let t = if turn >= 0.0 { turn.min(time) } else { time };
    let decay = (-a * t).exp();
    // e^(−at) times C and S, the larger root without a difference.
    let [c, s] = match square {
        0.0 => [decay, decay * t],
        x if x > 0.0 => [decay * (w * t).cos(), decay * (w * t).sin() / w],
        _ => {
            let slow = (-omega * omega / (a + w) * t).exp();
            let fast = (-(a + w) * t).exp();
            [0.5 * (slow + fast), 0.5 * (slow - fast) / w]
        }
    };
    u * c + (rate + a * u) * s
}

/// Largest stretch \[m] and tension \[N] within `time` (s) of the catch of a mass that has fallen by `slack`, in a rope of
/// that compliance (m/N) and damping time (s).
pub(super) fn caught([compliance, damping, mass, slack, time]: [f64; 5]) -> [f64; 2] {
    let square = 1.0 / (compliance * mass);
    if square.is_infinite() {
        return [0.0; 2];
    }
    let (omega, speed) = (square.sqrt(), (2.0 * GRAVITY * slack).sqrt());
    let mode = [omega, 0.5 * omega * damping];
    let pull = square * damping * speed - GRAVITY;
    let rate = square * (speed - damping * pull);
    let rest = GRAVITY / square;
    [
        rest + largest(mode, [-rest, speed], time),
        mass * (GRAVITY + largest(mode, [pull, rate], time)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closed_form_has_the_known_ends() {
        let (slack, compliance) = (14.0, 1e-6);
        let peak = |damping| caught([compliance, damping, 100.0, slack, 0.3]);
        // The fall into a rope, and the jump to k τ v.
        let weight = 100.0 * GRAVITY;
        let undamped = weight * (1.0 + (1.0 + 2.0 * slack / (compliance * weight)).sqrt());
        assert!((peak(0.0)[1] / undamped - 1.0).abs() < 1e-12);
        let jump = 0.05 / compliance * (2.0 * GRAVITY * slack).sqrt();
        assert!((peak(0.05)[1] / jump - 1.0).abs() < 1e-12);
        // ζ = 1 at 0.02 s lies between its neighbours.
        let [below, critical, above] = [0.0199, 0.02, 0.0201].map(|damping| peak(damping)[0]);
        assert!(above < critical && critical < below);
        assert!((0.5 * (below + above) / critical - 1.0).abs() < 1e-4);
    }
}
