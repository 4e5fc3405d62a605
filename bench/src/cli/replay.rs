//! `taut replay`: what was recorded, for people and programs.

use super::Failure;
use clap::Args;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use taut_measure::files;
use taut_recording::{Ending, Recording, RecordingError, animation, page, still, table};
use taut_studies::options::number;

pub(crate) const AFTER_HELP: &str = "\
Examples:
  taut run gantry --time 20 --record gantry.tape
  taut replay gantry.tape --html gantry.html
  taut replay gantry.tape --csv time,hook.z,bottom.tension,hoist_speed --out lift.csv
  taut replay gantry.tape --png 12.5
  taut replay gantry.tape --gltf gantry.glb
  taut replay gantry.tape --against coarse.tape --html both.html";

#[derive(Debug, Args)]
pub(crate) struct ReplayArgs {
    /// A recording of `taut run --record`; of one that was cut, what is whole
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// A table of a line a frame: time load_x load_y load_z kinetic gravity elastic max_gap iterations step load_tension contacts
    /// sliding groups error (mm) segments asleep; NAME.QUANTITY of a body (x y z qw qx qy qz contact contact_x contact_y contact_z), of a
    /// joint or cable (tension bending twist drive length); the name of a control
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    csv: Vec<String>,
    /// Where the table goes (default: standard output)
    #[arg(long, value_name = "FILE.csv", requires = "csv")]
    out: Option<PathBuf>,
    /// The frame at this time (s) as a picture, without a browser
    #[arg(long, value_name = "T", value_parser = number, allow_negative_numbers = true)]
    png: Option<f64>,
    /// Where the picture goes (default: beside the recording, ending in .png)
    #[arg(long, value_name = "FILE.png", requires = "png")]
    picture: Option<PathBuf>,
    /// A page to play, turn and scrub through, without network: colours by tension, bending or twist, forces, plots
    #[arg(long, value_name = "PATH")]
    html: Option<PathBuf>,
    /// Animated glTF 2.0, of binary form unless the name ends in `.gltf`: a node for each body
    #[arg(long, value_name = "FILE.glb")]
    gltf: Option<PathBuf>,
    /// Another recording beside it on the page, with the distance of the loads (mm)
    #[arg(long, value_name = "OTHER", requires = "html")]
    against: Option<PathBuf>,
}

fn open(path: &Path) -> Result<Recording, Failure> {
    let named =
        |e: RecordingError| Failure::Input(format!("cannot read `{}`: {e}", path.display()));
    let recording = Recording::open(path).map_err(named)?;
    if recording.frames() == 0 && recording.ending == Ending::Cut {
        return Err(Failure::Input(format!(
            "cannot read `{}`: it is cut, and no frame of it is whole: record the run again",
            path.display()
        )));
    }
    if let Some(early) = recording.early() {
        files::note(format!("`{}`: {early}", path.display()));
    }
    Ok(recording)
}

/// Reads the recording, and writes what is asked for.
pub(crate) fn run(args: &ReplayArgs) -> Result<(), Failure> {
    let csv = Some(args.out.as_deref().unwrap_or(Path::new("-")));
    let csv = csv.filter(|_| !args.csv.is_empty());
    let mut read: Vec<&Path> = vec![&args.file];
    read.extend(args.against.as_deref());
    let beside = || args.file.with_extension("png");
    let picture = args
        .png
        .map(|_| args.picture.clone().unwrap_or_else(beside));
    let options = [
        ("--csv", csv),
        ("--html", args.html.as_deref()),
        ("--gltf", args.gltf.as_deref()),
        ("--png", picture.as_deref()),
    ];
    let [csv, html, gltf, png] = files::open(options, &read)?;
    let recording = open(&args.file)?;
    let against = args.against.as_deref().map(open).transpose()?;
    let is_asked = csv.is_some() || html.is_some() || gltf.is_some() || png.is_some();
    if let Some(csv) = csv {
        csv.write(table(&recording, &args.csv).map_err(Failure::Input)?)?;
    }
    if let Some(html) = html {
        let mut shown = vec![(title(&args.file), &recording)];
        shown.extend(args.against.as_deref().map(title).zip(against.as_ref()));
        let shown: Vec<_> = shown
            .iter()
            .map(|(title, r)| (title.as_str(), *r))
            .collect();
        html.write(|out| out.write_all(page(&shown)?.as_bytes()))?;
    }
    if let Some(gltf) = gltf {
        let is_text = gltf.path().extension().is_some_and(|e| e == "gltf");
        let bytes = animation(&recording, !is_text)?;
        gltf.write(|out| out.write_all(&bytes))?;
    }
    if let (Some(png), Some(time)) = (png, args.png) {
        let shown = still(&recording, time)?;
        png.write(|out| out.write_all(&shown.png))?;
        if let Some([low, high]) = shown.tensions.filter(|_| !png.is_stdout()) {
            let time = shown.time;
            files::print(&format!(
                "t = {time:.3} s, coloured by tension from {low:.4e} N to {high:.4e} N\n"
            ))?;
        }
    }
    if !is_asked {
        files::print(&text(&recording))?;
    }
    Ok(())
}

fn title(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

/// Summary of a recording.
fn text(recording: &Recording) -> String {
    let header = &recording.header;
    let span = recording.span();
    let times = span.map_or_else(
        || "none: no step was made".to_owned(),
        |[first, last]| format!("{}, from {first:.3} s to {last:.3} s", recording.frames()),
    );
    let names = |all: &mut dyn Iterator<Item = &String>| {
        let all: Vec<&str> = all.map(String::as_str).collect();
        let more = all.len().saturating_sub(NAMES);
        let more = (more > 0).then(|| format!(" and {more} more"));
        format!(
            "{}{}",
            all[..all.len().min(NAMES)].join(", "),
            more.unwrap_or_default()
        )
    };
    let last = recording.parts.last().map(|part| &part.layout);
    let bodies = last.map(|l| names(&mut l.bodies.iter().map(|b| &b.name)));
    let columns = last.map(|l| names(&mut l.channels.iter().map(|c| &c.name)));
    let rows = [
        ("scene", header.scene.clone()),
        (
            "program",
            format!(
                "{}, {}, steps of {:.6} s",
                header.program, header.solver, header.dt
            ),
        ),
        ("frames", times),
        ("bodies", bodies.unwrap_or_default()),
        ("columns", columns.unwrap_or_default()),
    ];
    let events = recording.events.iter();
    let events = events.map(|(time, name)| ("event", format!("t = {time:.4} s: {name}")));
    let mut out = String::new();
    for (name, value) in rows.into_iter().chain(events) {
        let _ = writeln!(out, "{name:>16}  {}", files::line(&value));
    }
    out
}

/// Names that are listed at most.
const NAMES: usize = 12;
