//! Scenes as the command line names them: by name or as a TOML file, with parameters overridden, and what drives them.

use crate::errors::Cause;
use crate::files::read_text;
use crate::inputs::Inputs;
use std::path::Path;
use taut_model::{Scene, SceneError, SceneSource};

/// True if a scene is given as a file rather than by name.
pub fn is_file(scene: &str) -> bool {
    let named = taut_model::named::NAMES.contains(&scene);
    !named && (Path::new(scene).exists() || scene.ends_with(".toml") || scene.contains('/'))
}

/// Reads a scene by name or from a TOML file, with overrides. What looks like a file is one; anything else is a name,
/// and the error lists the names.
fn source(scene: &str, overrides: &[(&str, &str)]) -> Result<SceneSource, Cause> {
    if is_file(scene) {
        let source = SceneSource::parse(&read_text(Path::new(scene))?, overrides);
        Ok(source.map_err(|e| format!("{scene}: {e}"))?)
    } else {
        Ok(SceneSource::load(scene, overrides)?)
    }
}

/// Reads and builds a scene by name or from a TOML file, with overrides.
pub fn built(scene: &str, overrides: &[(&str, &str)]) -> Result<(SceneSource, Scene), Cause> {
    let source = source(scene, overrides)?;
    let built = source.build().map_err(|e| match is_file(scene) {
        true => Cause::from(format!("{scene}: {e}")),
        false => e.into(),
    })?;
    Ok((source, built))
}

/// The inputs of a CSV file for a scene, none without a file: see [`Inputs`].
pub fn inputs(path: Option<&Path>, scene: &Scene) -> Result<Inputs, Cause> {
    let Some(path) = path else {
        return Ok(Inputs::default());
    };
    let inputs = Inputs::parse(&read_text(path)?, scene);
    Ok(inputs.map_err(|e| format!("{}: {e}", path.display()))?)
}

/// Mass of the heaviest over that of the lightest moving body.
pub fn mass_ratio(scene: &Scene) -> Result<f64, SceneError> {
    let masses = || scene.dynamic_bodies().map(|i| scene.bodies.mass[i]);
    let ends = masses().reduce(f64::min).zip(masses().reduce(f64::max));
    let (least, most) = ends.ok_or_else(|| SceneError::Conflict {
        what: format!("scene `{}`", scene.name),
        reason: "has no moving bodies: give it a [[body]] that is neither static nor driven",
    })?;
    Ok(most / least)
}
