//! The scenes in which errors are estimated.

use taut_model::{SceneError, SceneSource};

/// Table of inputs of the gantries.
const DRIVE: &str = "time,trolley_speed,hoist_speed\n0,0,0\n1,0.5,0.1\n4,0.5,0.1\n5,0,0\n";

/// A scene with its parameters.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Case {
    scene: &'static str,
    parameters: String,
    /// Table of inputs.
    pub(super) controls: Option<&'static str>,
    /// Time after which nothing is asked: loads of capstans fall \[s].
    pub(super) longest: f64,
}

impl Case {
    pub(super) fn new(scene: &'static str, parameters: impl Into<String>) -> Self {
        Self {
            scene,
            parameters: parameters.into(),
            controls: None,
            longest: f64::INFINITY,
        }
    }

    pub(super) fn name(&self) -> String {
        let driven = if self.controls.is_some() {
            " driven"
        } else {
            ""
        };
        format!("{}{driven} {}", self.scene, self.parameters)
    }

    pub(super) fn source(&self) -> Result<SceneSource, SceneError> {
        let pairs = self
            .parameters
            .split(' ')
            .filter_map(|text| text.split_once('='));
        SceneSource::load(self.scene, &pairs.collect::<Vec<_>>())
    }
}

/// Swings and jerks of hoists, driven gantries, branches and loops that shake, sheaves and contacts.
pub(super) fn all(ratios: &[&str]) -> Vec<Case> {
    let mut all = Vec::new();
    for ratio in ratios {
        let of = |text: &str| format!("mass_ratio={ratio} {text}");
        let mut hoist = |text: &str| all.push(Case::new("hoist", of(text)));
        for segments in [6, 24] {
            hoist(&format!("segments={segments} initial_angle=0.1"));
            hoist(&format!("segments={segments} initial_angle=1"));
            hoist(&format!("segments={segments} equilibrium=true move_x=1"));
        }
        hoist("segments=12 equilibrium=true circle_radius=0.5");
        hoist("segments=12 initial_angle=0.3 seed=1 seed_rate=0.3");
        all.push(Case {
            controls: Some(DRIVE),
            ..Case::new("gantry", of(""))
        });
        for scene in ["ring", "junction", "cranes", "ladder", "net"] {
            all.push(Case::new(scene, of("seed=1 seed_rate=0.2")));
        }
        for scene in ["stack", "floor", "pile"] {
            all.push(Case::new(scene, of("")));
        }
        for scene in ["tackle", "capstan", "elevator"] {
            let case = Case::new(scene, format!("load_mass={ratio}"));
            all.push(Case {
                longest: if scene == "capstan" {
                    1.0
                } else {
                    case.longest
                },
                ..case
            });
        }
    }
    // The equilibrium of a ring is not found there, and a pile's fine steps take hours.
    let known =
        |case: &Case| !["ring", "pile"].contains(&case.scene) || !case.parameters.contains("1e5");
    all.retain(known);
    all
}

/// Scenes for the comparison of times.
pub(super) fn timed() -> Vec<Case> {
    let hoist = |segments: usize| {
        Case::new(
            "hoist",
            format!("segments={segments} equilibrium=true move_x=1"),
        )
    };
    let gantry = Case {
        controls: Some(DRIVE),
        ..Case::new("gantry", "")
    };
    vec![hoist(24), hoist(100), gantry]
}
