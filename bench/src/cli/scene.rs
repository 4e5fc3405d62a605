//! `taut scene`: scenes as TOML text.

use super::Failure;
use clap::Args;
use taut_ground::{files, source};
use taut_model::SceneSource;
use taut_model::scene_file::SceneText;
use taut_studies::options::overrides;

#[derive(Debug, Args)]
pub(crate) struct SceneArgs {
    /// Name of a scene, or a TOML file
    #[arg(value_name = "NAME")]
    scene: String,
    /// Overrides a parameter of the scene
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// Writes bodies and constraints one by one, not the parameters
    #[arg(long)]
    explicit: bool,
}

/// Writes the scene to standard output. One that cannot be built is refused, whatever is to be written.
pub(crate) fn run(args: &SceneArgs) -> Result<(), Failure> {
    let built = source::built(&args.scene, &overrides(&args.overrides)?);
    let (mut source, scene) = built.map_err(Failure::of)?;
    if args.explicit {
        source = SceneSource::Explicit(Box::new(SceneText::from_scene(&scene)?));
    }
    Ok(files::print(&source.to_commented_toml()?)?)
}
