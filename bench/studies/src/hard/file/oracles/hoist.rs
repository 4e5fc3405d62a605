//! A pendulum whose cable is hauled in steadily: θ̈ + 2 (L̇/L) θ̇ + (g/L) θ = 0, integrated by the classical Runge–Kutta
//! method in steps that leave nothing of their own.

const GRAVITY: f64 = 9.81;
/// Lengths before and after \[m].
const LENGTHS: [f64; 2] = [10.0, 5.0];
/// Angle at the start, at rest \[rad].
const ANGLE: f64 = 1e-3;

/// Amplitude of a pendulum of constant length from its angle and rate.
fn amplitude(angle: f64, rate: f64, length: f64) -> f64 {
    angle.hypot(rate / (GRAVITY / length).sqrt())
}

/// Adiabatic invariant of a slow hoist: the amplitude of x = θ L^(3/4) at the frequency of the
/// present length, while the cable is hauled at `speed` (m/s).
fn adiabatic(angle: f64, rate: f64, length: f64, speed: f64) -> f64 {
    let scale = length.powf(0.75);
    amplitude(
        angle * scale,
        (rate - 0.75 * speed / length * angle) * scale,
        length,
    )
}

/// Growth of the amplitude in the hoist, by the equation, and what has become of the adiabatic one during it.
pub(super) fn of_equation(speed: f64) -> [f64; 2] {
    let time = (LENGTHS[0] - LENGTHS[1]) / speed;
    let steps = (time * 2000.0).ceil();
    let h = time / steps;
    let rates = |t: f64, [angle, rate]: [f64; 2]| {
        let length = LENGTHS[0] - speed * t;
        [rate, (2.0 * speed * rate - GRAVITY * angle) / length]
    };
    let moved = |y: [f64; 2], k: [f64; 2], h: f64| [y[0] + h * k[0], y[1] + h * k[1]];
    let mut y = [ANGLE, 0.0];
    for n in 0..steps as usize {
        let t = n as f64 * h;
        let a = rates(t, y);
        let b = rates(t + 0.5 * h, moved(y, a, 0.5 * h));
        let c = rates(t + 0.5 * h, moved(y, b, 0.5 * h));
        let d = rates(t + h, moved(y, c, h));
        for k in 0..2 {
            y[k] += h / 6.0 * (a[k] + 2.0 * (b[k] + c[k]) + d[k]);
        }
    }
    let [before, after] = LENGTHS;
    let start = adiabatic(ANGLE, 0.0, before, speed);
    [
        amplitude(y[0], y[1], after) / ANGLE,
        adiabatic(y[0], y[1], after, speed) / start,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_hoist_keeps_the_action() {
        let [growth, kept] = of_equation(0.01);
        assert!((growth / 2.0_f64.powf(0.75) - 1.0).abs() < 5e-3, "{growth}");
        assert!((kept - 1.0).abs() < 1e-4, "{kept}");
    }
}
