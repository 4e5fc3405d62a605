//! Scenes as the command line names them: by name or as a TOML file, with parameters overridden, and what drives them.

use crate::files::{FileError, read_text};
use crate::inputs::{InputError, Inputs};
use std::path::{Path, PathBuf};
use taut_model::{Scene, SceneError, SceneSource};

/// Why a scene cannot be prepared.
#[derive(Debug)]
pub enum SourceError {
    /// The file of that name cannot be read.
    File(FileError),
    /// The scene is not sound.
    Scene(SceneError),
    /// The file of that name holds no scene, or none that is sound.
    SceneFile(PathBuf, SceneError),
    /// The table of inputs in the file of that name does not fit the scene.
    Inputs(PathBuf, InputError),
}

impl std::fmt::Display for SourceError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File(e) => e.fmt(f),
            Self::Scene(e) => e.fmt(f),
            Self::SceneFile(path, e) => write!(f, "{}: {e}", path.display()),
            Self::Inputs(path, e) => write!(f, "{}: {e}", path.display()),
        }
    }
}

impl std::error::Error for SourceError {}

/// True if a scene is given as a file rather than by name.
pub fn is_file(scene: &str) -> bool {
    let named = taut_model::named::NAMES.contains(&scene);
    !named && (Path::new(scene).exists() || scene.ends_with(".toml") || scene.contains('/'))
}

/// Reads a scene by name or from a TOML file, with overrides. What looks like a file is one; anything else is a name,
/// and the error lists the names.
fn source(scene: &str, overrides: &[(&str, &str)]) -> Result<SceneSource, SourceError> {
    if is_file(scene) {
        let text = read_text(Path::new(scene)).map_err(SourceError::File)?;
        let source = SceneSource::parse(&text, overrides);
        source.map_err(|e| SourceError::SceneFile(PathBuf::from(scene), e))
    } else {
        SceneSource::load(scene, overrides).map_err(SourceError::Scene)
    }
}

/// Reads and builds a scene by name or from a TOML file, with overrides.
pub fn built(scene: &str, overrides: &[(&str, &str)]) -> Result<(SceneSource, Scene), SourceError> {
    let source = source(scene, overrides)?;
    let built = source.build().map_err(|e| match is_file(scene) {
        true => SourceError::SceneFile(PathBuf::from(scene), e),
        false => SourceError::Scene(e),
    })?;
    Ok((source, built))
}

/// The inputs of a CSV file for a scene, none without a file: see [`Inputs`].
pub fn inputs(path: Option<&Path>, scene: &Scene) -> Result<Inputs, SourceError> {
    let Some(path) = path else {
        return Ok(Inputs::default());
    };
    let text = read_text(path).map_err(SourceError::File)?;
    Inputs::parse(&text, scene).map_err(|e| SourceError::Inputs(path.to_owned(), e))
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
