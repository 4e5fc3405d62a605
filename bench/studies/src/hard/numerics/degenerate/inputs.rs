//! The inputs of H52.

use super::Expected::{self, Either, Refused, Sound};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use taut_integrator::StepOptions;
use taut_model::{
    Bodies, Body, Constraint, Distance, Frame, HoistParams, RowLaw, Scene, SceneError, Spherical,
};

/// An input, and what it has to end in.
pub(super) struct Input {
    pub(super) name: &'static str,
    pub(super) expected: Expected,
    pub(super) make: Make,
}

/// What is made.
#[derive(Clone, Copy)]
pub(super) enum Make {
    /// A scene.
    Scene(fn() -> Result<Scene, SceneError>),
    /// A change of the options for a sound scene.
    Options(fn(&mut StepOptions)),
    /// A change of its state in the midst of a run.
    State(fn(&mut Bodies)),
}

/// A sound hoist.
pub(super) fn small() -> Result<Scene, SceneError> {
    let params = HoistParams {
        segments: 4,
        mass_ratio: 10.0,
        seed: 3,
        ..HoistParams::default()
    };
    params.build()
}

fn with(change: fn(&mut HoistParams)) -> Result<Scene, SceneError> {
    let mut params = HoistParams {
        segments: 4,
        ..HoistParams::default()
    };
    change(&mut params);
    params.build()
}

fn changed(change: fn(&mut Scene)) -> Result<Scene, SceneError> {
    let mut scene = small()?;
    change(&mut scene);
    Ok(scene)
}

fn stone() -> Scene {
    let mut scene = Scene::new("stone");
    scene.gravity = Vector3::new(0.0, 0.0, -9.81);
    scene.add_body("stone", Body::sphere(0.1, 2.0));
    scene
}

/// A stone on a ball joint beside its centre.
fn hung(mass: f64) -> Scene {
    let mut scene = stone();
    scene.bodies.mass[0] = mass;
    scene.bodies.inertia[0] = Matrix3::identity() * (0.004 * mass);
    let frames = [
        Frame::world(Vector3::zeros()),
        Frame::body(0, Vector3::new(0.3, 0.0, 0.0)),
    ];
    scene.bodies.position[0].x = -0.3;
    let joint = Constraint::Spherical(Spherical {
        frames,
        stretch: RowLaw::RIGID,
    });
    scene.add_constraint("joint", joint, 0);
    scene
}

/// A stone on a link of that length, as far away as it is long.
fn linked(length: f64) -> Scene {
    let mut scene = stone();
    scene.bodies.position[0].x = length;
    let link = Constraint::Distance(Distance {
        frames: [
            Frame::world(Vector3::zeros()),
            Frame::body(0, Vector3::zeros()),
        ],
        length,
        law: RowLaw::RIGID,
        transverse: false,
    });
    scene.add_constraint("link", link, 0);
    scene
}

fn beside(scene: &mut Scene) {
    let other = hung(2.0);
    let stone = other.bodies.get(0);
    let b = scene.add_body("stone", stone);
    let frames = [
        Frame::world(Vector3::zeros()),
        Frame::body(b, Vector3::new(0.3, 0.0, 0.0)),
    ];
    let joint = Spherical {
        frames,
        stretch: RowLaw::RIGID,
    };
    scene.add_constraint("beside", Constraint::Spherical(joint), 7);
    scene.add_body(
        "loose",
        Body::sphere(0.1, 1.0).at(Vector3::new(9.0, 0.0, 0.0)),
    );
}

macro_rules! inputs {
    ($($name:literal, $expected:expr, $kind:ident($make:expr);)*) => {
        &[$(Input { name: $name, expected: $expected, make: Make::$kind($make) }),*]
    };
}

/// All of them.
pub(super) const INPUTS: &[Input] = inputs! {
    "no body", Refused("scene"), Scene(|| Ok(Scene::new("empty")));
    "zero mass", Refused("segment-2"), Scene(|| changed(|s| s.bodies.mass[1] = 0.0));
    "negative mass", Refused("segment-2"), Scene(|| changed(|s| s.bodies.mass[1] = -1.0));
    "mass NaN", Refused("segment-2"), Scene(|| changed(|s| s.bodies.mass[1] = f64::NAN));
    "mass ∞", Refused("segment-2"), Scene(|| changed(|s| s.bodies.mass[1] = f64::INFINITY));
    "indefinite inertia", Refused("segment-2"), Scene(|| changed(|s| s.bodies.inertia[1][(0, 0)] = -1.0));
    "unsymmetric inertia", Refused("segment-2"), Scene(|| changed(|s| s.bodies.inertia[1][(0, 1)] = 1.0));
    "zero inertia", Refused("segment-2"), Scene(|| changed(|s| s.bodies.inertia[1] = Matrix3::zeros()));
    "position NaN", Refused("segment-1"), Scene(|| changed(|s| s.bodies.position[0].x = f64::NAN));
    "velocity ∞", Refused("segment-1"), Scene(|| changed(|s| s.bodies.velocity[0].x = f64::INFINITY));
    "gravity NaN", Refused("gravity"), Scene(|| changed(|s| s.gravity.z = f64::NAN));
    "axes not orthonormal", Refused("joint-1"), Scene(|| changed(|s| {
        if let Constraint::Cosserat(joint) = &mut s.constraints[1] {
            joint.frames[0].axes *= 2.0;
        }
    }));
    "compliance negative", Refused("joint-1"), Scene(|| changed(|s| {
        if let Constraint::Cosserat(joint) = &mut s.constraints[1] {
            joint.law.stretch = Some(RowLaw::new(-1.0, 0.0));
        }
    }));
    "compliance NaN", Refused("joint-1"), Scene(|| changed(|s| {
        if let Constraint::Cosserat(joint) = &mut s.constraints[1] {
            joint.law.stretch = Some(RowLaw::new(f64::NAN, 0.0));
        }
    }));
    "joint on a body that is not there", Refused("99"), Scene(|| changed(|s| {
        if let Constraint::Cosserat(joint) = &mut s.constraints[1] {
            joint.frames[1] = Frame::body(99, Vector3::zeros());
        }
    }));
    "joint of a body with itself", Refused("joint-1"), Scene(|| changed(|s| {
        if let Constraint::Cosserat(joint) = &mut s.constraints[1] {
            joint.frames[1] = joint.frames[0];
        }
    }));
    "cable of length 0", Refused("length"), Scene(|| with(|p| p.length = 0.0));
    "cable of length NaN", Refused("length"), Scene(|| with(|p| p.length = f64::NAN));
    "link of length 0", Refused("link"), Scene(|| Ok(linked(0.0)));
    "no segments", Refused("segments"), Scene(|| with(|p| p.segments = 0));
    "usize::MAX segments", Refused("segments"), Scene(|| with(|p| p.segments = usize::MAX));
    "time step 0", Refused("dt"), Options(|o| o.dt = 0.0);
    "time step NaN", Refused("dt"), Options(|o| o.dt = f64::NAN);
    "time step 10⁻³²⁰ s", Either, Options(|o| o.dt = 1e-320);
    "time step 10³⁰⁰ s", Either, Options(|o| o.dt = 1e300);
    "no sub-steps", Refused("substeps"), Options(|o| o.substeps = 0);
    "state with NaN", Refused("segment-2"), State(|b| b.position[1].y = f64::NAN);
    "state with ∞", Refused("segment-2"), State(|b| b.velocity[1].y = f64::INFINITY);
    "orientation NaN", Refused("segment-2"), State(|b| {
        b.orientation[1] = UnitQuaternion::new_unchecked(Quaternion::new(1.0, f64::NAN, 0.0, 0.0));
    });
    "speed of 10²⁰⁰ m/s", Either, State(|b| b.velocity[1].y = 1e200);
    "spin of 10⁸ rad/s", Either, State(|b| b.angular_velocity[1].y = 1e8);
    "denormal mass", Either, Scene(|| Ok(hung(1e-310)));
    "mass of 10⁻³⁰⁰ kg", Either, Scene(|| Ok(hung(1e-300)));
    "mass of 10³⁰⁰ kg", Either, Scene(|| Ok(hung(1e300)));
    "mass of 10⁻³⁰ kg", Sound, Scene(|| Ok(hung(1e-30)));
    "mass of 10³⁰ kg", Sound, Scene(|| Ok(hung(1e30)));
    "denormal link", Either, Scene(|| Ok(linked(1e-310)));
    "link of 10⁻⁹ m", Either, Scene(|| Ok(linked(1e-9)));
    "link of 10¹² m", Sound, Scene(|| Ok(linked(1e12)));
    "denormal gravity", Sound, Scene(|| changed(|s| s.gravity.z = -1e-310));
    "gravity of 10³⁰⁰ m/s²", Either, Scene(|| changed(|s| s.gravity.z = -1e300));
    "one body, no joints", Sound, Scene(|| Ok(stone()));
    "one body, one joint", Sound, Scene(|| Ok(hung(2.0)));
    "one segment, no mass to speak of", Sound, Scene(|| with(|p| {
        (p.segments, p.mass_ratio) = (1, 1e-6);
    }));
    "nothing that moves", Sound, Scene(|| {
        let mut scene = Scene::new("fixed");
        scene.add_body("wall", Body::fixed());
        Ok(scene)
    });
    "parts that do not hang together", Sound, Scene(|| changed(beside));
};
