use super::*;
use crate::check_jacobian;
use crate::testing::*;
use std::f64::consts::PI;

const STIFFNESS: Stiffness = Stiffness {
    ea: 1e6,
    ei: 40.0,
    gj: 30.0,
};

fn pinned(x: f64, y: f64, z: f64) -> CableEnd {
    CableEnd::Pinned(Frame::world(Vector3::new(x, y, z)))
}

fn cable(ends: [CableEnd; 2]) -> Cable {
    Cable::round("rope", &Material::STEEL, 0.01, ends).with(|p| p.stiffness = STIFFNESS)
}

fn laid(cable: &Cable) -> Scene {
    let mut scene = Scene::new("scene");
    scene.add_cable(cable).expect("lies");
    assert_eq!(scene.validate(), Ok(()));
    scene
}

#[test]
fn a_straight_cable_is_the_hoist_s() {
    let hoist = crate::HoistParams::default()
        .with(|p| (p.segments, p.anchor, p.damping) = (5, End::Clamped, 0.01));
    let own = hoist.build().expect("builds");
    let resolved = hoist.resolve().expect("sound");
    let mut scene = Scene::new("hoist");
    let load = scene.add_body("load", own.bodies.get(5));
    let ends = [CableEnd::Clamped(origin()), CableEnd::Pinned(centre(load))];
    let rope = Cable::round("rope", &Material::STEEL, resolved.radius, ends)
        .with(|p| p.segments = Segments::Equal(5))
        .with(|p| p.density = resolved.segment_mass / resolved.segment_length)
        .with(|p| (p.stiffness, p.damping) = (resolved.stiffness, Damping::Time(0.01)));
    let parts = scene.add_cable(&rope).expect("lies");
    assert_eq!(parts.bodies, [1, 2, 3, 4, 5]);
    assert_eq!(parts.joints, [0, 1, 2, 3, 4, 5]);
    assert_eq!(scene.cables, [parts]);
    assert_eq!(own.cables[0].joints.len(), 6);
    let names = ["rope-start", "rope-joint-1", "rope-joint-2"];
    assert_eq!(scene.constraint_names[..3], names);
    let (a, b) = (Linearized::at(&own, 0.0), Linearized::at(&scene, 0.0));
    for i in 0..5 {
        let apart = own.bodies.position[i] - scene.bodies.position[i + 1];
        assert!(apart.norm() < 1e-14);
        assert!((own.bodies.inertia[i] - scene.bodies.inertia[i + 1]).amax() < 1e-15);
        assert_eq!(scene.bodies.orientation[i + 1], UnitQuaternion::identity());
    }
    assert_eq!(a.rows(), b.rows());
    for (ours, theirs) in a.compliance.iter().zip(&b.compliance) {
        assert!((ours - theirs).abs() <= 1e-15 * theirs);
    }
    assert!(b.phi.iter().all(|phi| phi.abs() < 1e-14));
}

#[test]
fn what_rests_as_routed_is_without_strain() {
    let around = |k: usize| {
        let (sine, cosine) = (0.3 * k as f64).sin_cos();
        Vector3::new(cosine, 2.0 * sine, 0.2 * (k * k) as f64)
    };
    let mut scene = Scene::new("scene");
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -1.0, 0.3));
    let block = scene.add_body("block", Body::sphere(0.3, 2.0).at(around(9)).turned(turn));
    for kind in [JointKind::Cosserat, JointKind::Paper] {
        let ends = [
            CableEnd::Clamped(Frame::world(around(0))),
            CableEnd::Clamped(centre(block)),
        ];
        let rope = Cable {
            name: format!("{kind:?}"),
            points: (1..9).map(around).collect(),
            segments: Segments::Equal(17),
            joint: kind,
            rest: Rest::AsRouted,
            ..cable(ends)
        };
        scene.add_cable(&rope).expect("lies");
    }
    assert_eq!(scene.validate(), Ok(()));
    assert!(
        Linearized::at(&scene, 0.0)
            .phi
            .iter()
            .all(|phi| phi.abs() < 1e-13)
    );
    // The paper's bend angle has no gradient where it is zero.
    for i in 0..scene.cables[0].joints.len() {
        let check = check_jacobian(&scene, i);
        assert!(check.max < 1e-7, "{}: {check:?}", scene.constraint_names[i]);
    }
}

#[test]
fn lengths_that_are_given_are_those_of_the_segments() {
    let ends = [
        pinned(1.0, 0.0, 0.0),
        CableEnd::Free(Vector3::new(1.0, 0.0, 4.5)),
    ];
    let rope = cable(ends).with(|p| p.segments = Segments::Lengths(vec![0.5, 1.0, 2.0, 1.0]));
    let scene = laid(&rope);
    let depth: Vec<f64> = scene.bodies.position.iter().map(|p| p.z).collect();
    assert_eq!(depth, [0.25, 1.0, 2.5, 4.0]);
    assert_eq!(scene.constraints.len(), 4);
    let lin = Linearized::at(&scene, 0.0);
    let stretch = [0, 1, 2, 3].map(|c| lin.compliance[lin.row_range(c).start] * STIFFNESS.ea);
    for (found, expected) in stretch.into_iter().zip([0.25, 0.75, 1.5, 1.5]) {
        assert!((found - expected).abs() < 1e-15);
    }
    assert!((scene.mass() - 4.5 * rope.density).abs() < 1e-12);
}

#[test]
fn a_damping_ratio_is_that_of_the_lowest_modes() {
    let ends = [
        pinned(0.0, 0.0, 0.0),
        CableEnd::Free(Vector3::new(0.0, 0.0, -2.0)),
    ];
    let rope = cable(ends).with(|p| p.damping = Damping::Ratio(0.05));
    let density = rope.density;
    let scene = laid(&rope);
    let [stretch, bend, twist] = [0, 3, 5].map(|row| scene.constraints[1].row(row).1.damping);
    let ratio = |time: f64, frequency: f64| 0.5 * time * frequency;
    let axial = 0.25 * PI * (STIFFNESS.ea / density).sqrt();
    assert!((ratio(stretch, axial) - 0.05).abs() < 1e-15);
    let swings = 3.516_015 / 4.0 * (STIFFNESS.ei / density).sqrt();
    assert!((ratio(bend, swings) - 0.05).abs() < 1e-7);
    let spins = 0.25 * PI * (STIFFNESS.gj / (0.5 * density * 1e-4)).sqrt();
    assert!((ratio(twist, spins) - 0.05).abs() < 1e-15);
}

#[test]
fn a_frame_that_moves_keeps_its_motion() {
    let motion = Motion::Circle {
        radius: 1.0,
        period: 2.0,
        start: 0.0,
        ramp: 1.0,
    };
    let top = origin().moving(motion);
    let scene = laid(&cable([CableEnd::Pinned(top), pinned(0.0, 0.0, -1.0)]));
    assert_eq!(scene.constraints[0].frames()[0].side, Side::World(motion));
}

#[test]
fn segments_over_corners_are_chords() {
    let rope = cable([pinned(0.0, 0.0, 0.0), pinned(3.0, 0.0, 5.0)])
        .with(|p| (p.points, p.segments) = (vec![Vector3::new(3.0, 0.0, 0.0)], Segments::Equal(2)));
    let scene = laid(&rope);
    let (chord, masses) = (10.0_f64.sqrt(), &scene.bodies.mass);
    assert!((scene.bodies.position[0].norm() - 0.5 * chord).abs() < 1e-14);
    assert_eq!([masses[0], masses[1]].map(|m| m / rope.density), [4.0; 2]);
    let lin = Linearized::at(&scene, 0.0);
    let gaps = (0..3).flat_map(|c| lin.row_range(c).take(3));
    assert!(gaps.map(|row| lin.phi[row]).all(|gap| gap.abs() < 1e-14));
}
