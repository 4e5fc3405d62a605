//! Contact problems of bodies, for tests.

use super::super::Contacts;

/// Pseudo-random numbers.
pub(in super::super) struct Random(u64);

impl Random {
    pub(in super::super) fn new(seed: u64) -> Self {
        let mut random = Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5DEE_CE66);
        (0..4).for_each(|_| {
            random.next();
        });
        random
    }

    /// In 0 … 1.
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In −1 … 1.
    pub(in super::super) fn signed(&mut self) -> f64 {
        2.0 * self.next() - 1.0
    }

    pub(super) fn below(&mut self, n: usize) -> usize {
        ((self.next() * n as f64) as usize).min(n - 1)
    }

    pub(super) fn direction(&mut self) -> [f64; 3] {
        loop {
            let v = [self.signed(), self.signed(), self.signed()];
            let length = dot(v, v).sqrt();
            if length > 0.1 && length <= 1.0 {
                return v.map(|x| x / length);
            }
        }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Two tangents of a normal.
fn tangents(n: [f64; 3]) -> [[f64; 3]; 2] {
    let other = if n[0].abs() < 0.6 {
        [1.0, 0.0, 0.0]
    } else {
        [0.0, 1.0, 0.0]
    };
    let t = cross(n, other);
    let length = dot(t, t).sqrt();
    let t = t.map(|x| x / length);
    [t, cross(n, t)]
}

/// A cube of edge 1 m.
struct Body {
    mass: f64,
    centre: [f64; 3],
    /// Linear, then angular.
    velocity: [f64; 6],
}

/// A contact of two bodies.
struct Touch {
    upper: usize,
    /// None: the ground.
    lower: Option<usize>,
    place: [f64; 3],
    /// Towards the upper one.
    normal: [f64; 3],
    /// Addition to the normal velocity.
    recovery: f64,
    friction: f64,
}

/// Bodies and their contacts.
#[derive(Default)]
pub(super) struct World {
    bodies: Vec<Body>,
    touches: Vec<Touch>,
}

/// A problem that owns its numbers.
#[derive(Clone)]
pub(super) struct Problem {
    pub(super) operator: Vec<f64>,
    pub(super) rates: Vec<f64>,
    pub(super) friction: Vec<f64>,
    pub(super) regularization: Vec<f64>,
}

impl Problem {
    pub(super) fn contacts(&self) -> Contacts<'_> {
        Contacts {
            operator: &self.operator,
            rates: &self.rates,
            friction: &self.friction,
            regularization: &self.regularization,
        }
    }

    /// W₀ + Σ with σᵢ the part `relative` of the diagonal's mean.
    pub(super) fn new(
        mut operator: Vec<f64>,
        rates: Vec<f64>,
        friction: Vec<f64>,
        relative: f64,
    ) -> Self {
        let size = rates.len();
        let regularization: Vec<f64> = (0..size / 3)
            .map(|i| {
                let trace: f64 = (3 * i..3 * i + 3).map(|k| operator[k * (size + 1)]).sum();
                relative * trace / 3.0
            })
            .collect();
        for k in 0..size {
            operator[k * (size + 1)] += regularization[k / 3];
        }
        Self {
            operator,
            rates,
            friction,
            regularization,
        }
    }
}

impl World {
    /// W₀ = H M⁻¹ Hᵀ, q = H v + recovery.
    pub(super) fn problem(&self, relative: f64) -> Problem {
        let size = 3 * self.touches.len();
        // Rows of H M^-½: six numbers a body.
        let width = 6 * self.bodies.len();
        let mut rows = vec![0.0; size * width];
        let mut rates = vec![0.0; size];
        for (i, touch) in self.touches.iter().enumerate() {
            let [a, b] = tangents(touch.normal);
            for (k, axis) in [touch.normal, a, b].into_iter().enumerate() {
                let row = &mut rows[(3 * i + k) * width..][..width];
                for (body, sign) in [(Some(touch.upper), 1.0), (touch.lower, -1.0)] {
                    let Some(body) = body else { continue };
                    let Body {
                        mass,
                        centre,
                        velocity,
                    } = self.bodies[body];
                    let arm = [0, 1, 2].map(|k| touch.place[k] - centre[k]);
                    let turn = cross(arm, axis);
                    let inertia = mass / 6.0;
                    for c in 0..3 {
                        row[6 * body + c] = sign * axis[c] / mass.sqrt();
                        row[6 * body + 3 + c] = sign * turn[c] / inertia.sqrt();
                        rates[3 * i + k] +=
                            sign * (axis[c] * velocity[c] + turn[c] * velocity[3 + c]);
                    }
                }
            }
            rates[3 * i] += touch.recovery;
        }
        let mut operator = vec![0.0; size * size];
        for i in 0..size {
            for j in 0..=i {
                let product: f64 = rows[i * width..][..width]
                    .iter()
                    .zip(&rows[j * width..][..width])
                    .map(|(a, b)| a * b)
                    .sum();
                operator[i * size + j] = product;
                operator[j * size + i] = product;
            }
        }
        let friction = self.touches.iter().map(|touch| touch.friction).collect();
        Problem::new(operator, rates, friction, relative)
    }
}

pub(super) const FALL: f64 = 9.81 / 60.0;

/// Cubes on each other, the first on the ground, after a step of gravity.
pub(super) fn stack(
    masses: &[f64],
    friction: f64,
    push: f64,
    recovery: f64,
    random: &mut Random,
) -> World {
    let mut world = World::default();
    for (k, &mass) in masses.iter().enumerate() {
        let mut velocity = [0.0, 0.0, -FALL, 0.0, 0.0, 0.0];
        velocity[0] = push * random.signed();
        velocity[1] = push * random.signed();
        velocity[5] = push * random.signed();
        world.bodies.push(Body {
            mass,
            centre: [0.0, 0.0, 0.5 + k as f64],
            velocity,
        });
        for corner in 0..4 {
            let place = [
                if corner % 2 == 0 { -0.5 } else { 0.5 },
                if corner < 2 { -0.5 } else { 0.5 },
                k as f64,
            ];
            world.touches.push(Touch {
                upper: k,
                lower: k.checked_sub(1),
                place,
                normal: [0.0, 0.0, 1.0],
                recovery: -recovery * random.next(),
                friction,
            });
        }
    }
    world
}

/// Bodies with contacts at random: on bodies before them or the ground, with normals that lean up; `jammed` ones touch any
/// other, with normals of any direction.
pub(super) fn heap(
    bodies: usize,
    ratio: f64,
    friction: f64,
    jammed: bool,
    random: &mut Random,
) -> World {
    let mut world = World::default();
    for _ in 0..bodies {
        let mass = ratio.powf(random.next());
        let centre = [0, 1, 2].map(|_| 3.0 * random.signed());
        let mut velocity = [0; 6].map(|_| 0.3 * random.signed());
        velocity[2] -= FALL;
        world.bodies.push(Body {
            mass,
            centre,
            velocity,
        });
    }
    for upper in 0..bodies {
        for _ in 0..3 + random.below(6) {
            let other = random.below(if jammed { bodies + 1 } else { upper + 1 });
            let lower = (other < bodies && other != upper).then_some(other);
            let mut arm = [0; 3].map(|_| 0.5 * random.signed());
            let mut normal = random.direction();
            if !jammed {
                arm[2] = -0.5;
                normal[2] = normal[2].abs() + 0.5;
                let length = dot(normal, normal).sqrt();
                normal = normal.map(|x| x / length);
            }
            let centre = world.bodies[upper].centre;
            let place = [0, 1, 2].map(|k| centre[k] + arm[k]);
            let recovery = -0.2 * (random.next() - 0.7).max(0.0);
            world.touches.push(Touch {
                upper,
                lower,
                place,
                normal,
                recovery,
                friction,
            });
        }
    }
    world
}

/// Rows of bodies without a geometry: W₀ = H Hᵀ of random H, six columns a body.
pub(super) fn scatter(contacts: usize, ratio: f64, random: &mut Random) -> Problem {
    let bodies = 1 + contacts / 4;
    let masses: Vec<f64> = (0..bodies).map(|_| ratio.powf(random.next())).collect();
    let (size, width) = (3 * contacts, 6 * bodies);
    let mut rows = vec![0.0; size * width];
    for i in 0..contacts {
        let pair = [random.below(bodies), random.below(bodies)];
        for k in 0..3 {
            for body in pair {
                for c in 0..6 {
                    rows[(3 * i + k) * width + 6 * body + c] =
                        random.signed() / masses[body].sqrt();
                }
            }
        }
    }
    let mut operator = vec![0.0; size * size];
    for i in 0..size {
        for j in 0..size {
            operator[i * size + j] = (0..width)
                .map(|c| rows[i * width + c] * rows[j * width + c])
                .sum();
        }
    }
    let rates = (0..size).map(|_| random.signed()).collect();
    let friction = (0..contacts)
        .map(|_| [0.0, 0.1, 0.5, 1.0][random.below(4)])
        .collect();
    Problem::new(operator, rates, friction, 1e-8)
}
