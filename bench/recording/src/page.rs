//! The page of a recording, or of two side by side: one file without network, to play, turn and scrub through.

use crate::file::deflated;
use crate::planes;
use crate::read::{Part, Recording};
use crate::record::OF_CONTACT;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, PreEscaped, html};
use serde_json::{Value, json};
use std::io;

/// The style of pages that show runs.
pub const STYLE: &str = include_str!("page.css");

/// Script that draws a frame.
pub const PICTURE: &str = include_str!("picture.js");

/// Plots, and the ways to look at a picture.
pub const LOOK: &str = include_str!("look.js");

const SCRIPTS: [&str; 3] = [PICTURE, LOOK, include_str!("page.js")];

/// Most numbers of a run on a page; frames are left out beyond.
const MOST: usize = 1 << 23;

/// The page of recordings, each with the title that stands over it.
pub fn page(recordings: &[(&str, &Recording)]) -> io::Result<String> {
    let runs = recordings
        .iter()
        .map(|(title, recording)| run(title, recording));
    let runs: Vec<Value> = runs.collect::<io::Result<_>>()?;
    // No text ends the element that holds it.
    let data = Value::from(runs).to_string().replace('<', "\\u003c");
    let titles: Vec<&str> = recordings.iter().map(|(title, _)| *title).collect();
    let title = titles.join(" against ");
    let text = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                link rel="icon" href="data:,";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { (title) }
                noscript { p { "This page moves by a script, which is turned off." } }
                div.views id="views" {}
                div.bar {
                    button id="play" type="button" aria-pressed="false" { "Play" }
                    input id="time" type="range" aria-label="Time";
                    output id="now" {}
                }
                div.bar {
                    label { "Speed " select id="speed" {
                        @for speed in ["0.1", "0.25", "0.5", "1", "2", "4"] {
                            option value=(speed) selected[speed == "1"] { (speed) "×" }
                        }
                    } }
                    label { "Colour " select id="colour" {
                        @for (k, quantity) in ["tension", "bending", "twist"].iter().enumerate() {
                            option value=(k) { (quantity) }
                        }
                    } }
                    span { span.scale id="scale" {} " " output id="range" {} }
                    label { input id="forces" type="checkbox" checked; " forces" }
                    button id="fit" type="button" { "Fit" }
                }
                p id="told" aria-live="off" {}
                div.bar id="events" {}
                p.quiet {
                    "Drag turns, wheel zooms, Shift and drag move. Keys: space plays, ← and → step, Home and End, + and −, 0 fits; \
                     arrows turn a picture that has the focus. The dark stripe is fixed to the material: it shows twist."
                }
                div.plots id="plots" {}
                script type="application/json" id="data" { (PreEscaped(data)) }
                script { (PreEscaped(SCRIPTS.concat())) }
            }
        }
    };
    Ok(text.into_string())
}

fn run(title: &str, recording: &Recording) -> io::Result<Value> {
    let numbers: usize = recording
        .parts
        .iter()
        .map(|p| p.raw.len() + p.contacts.len())
        .sum();
    let stride = numbers.div_ceil(MOST).max(1);
    let parts = recording.parts.iter().map(|p| part(p, stride));
    // One stream: the layouts of a scene that changes often are much alike.
    let layouts: Vec<_> = recording.parts.iter().map(|p| &p.layout).collect();
    let layouts = deflated(&serde_json::to_vec(&layouts)?)?;
    let header = &recording.header;
    Ok(json!({
        "title": title,
        "scene": header.scene,
        "solver": header.solver,
        "dt": header.dt,
        "gravity": header.gravity,
        "early": recording.early(),
        "events": recording.events,
        "thinned": stride,
        "layouts": STANDARD.encode(layouts),
        "parts": parts.collect::<io::Result<Vec<_>>>()?,
    }))
}

/// Each `stride`-th frame of a part.
fn part(part: &Part, stride: usize) -> io::Result<Value> {
    let width = part.layout.channels.len();
    let frames = || (0..part.times.len()).step_by(stride);
    let raw: Vec<i32> = frames()
        .flat_map(|k| &part.raw[k * width..(k + 1) * width])
        .copied()
        .collect();
    let mut begins = vec![0];
    for count in &part.counts {
        begins.push(begins[begins.len() - 1] + *count as usize * OF_CONTACT);
    }
    let contacts = frames().flat_map(|k| &part.contacts[begins[k]..begins[k + 1]]);
    let contacts: Vec<i32> = contacts.copied().collect();
    let mut bytes = planes::encode(&raw, width);
    bytes.extend(planes::encode(&contacts, OF_CONTACT));
    Ok(json!({
        "times": frames().map(|k| part.times[k]).collect::<Vec<_>>(),
        "counts": frames().map(|k| part.counts[k]).collect::<Vec<_>>(),
        "data": STANDARD.encode(deflated(&bytes)?),
    }))
}
