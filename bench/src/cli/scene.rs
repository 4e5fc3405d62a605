//! `taut scene`: scenes as TOML text.

use super::{Failure, SceneArgs};
use clap::Args;
use taut_measure::files;
use taut_model::SceneSource;
use taut_model::scene_file::SceneText;

#[derive(Debug, Args)]
pub(crate) struct ExplicitArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Writes bodies and constraints one by one, not the parameters
    #[arg(long)]
    explicit: bool,
}

/// Writes the scene to standard output. One that cannot be built is refused, whatever is to be written.
pub(crate) fn run(args: &ExplicitArgs) -> Result<(), Failure> {
    let (mut source, scene) = args.scene.built()?;
    if args.explicit {
        source = SceneSource::Explicit(Box::new(SceneText::from_scene(&scene)?));
    }
    Ok(files::print(&source.to_commented_toml()?)?)
}
