//! The page: one file that asks its own server only.

use maud::{DOCTYPE, PreEscaped, html};
use taut_recording::{LOOK, PICTURE, STYLE};

const OWN_STYLE: &str = include_str!("view.css");
const SCRIPT: &str = include_str!("view.js");

/// The page of a scene with this title, whose script and style have that nonce.
pub(crate) fn page(title: &str, nonce: &str) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                link rel="icon" href="data:,";
                title { (title) }
                style nonce=(nonce) { (PreEscaped(STYLE)) (PreEscaped(OWN_STYLE)) }
            }
            body {
                h1 { (title) }
                noscript { p { "This page moves by a script, which is turned off." } }
                p id="alert" role="alert" {}
                div.views { div.view {
                    canvas id="picture" tabindex="0" role="img" aria-label="The scene in motion; arrow keys turn it" {}
                } }
                div.bar {
                    button id="pause" type="button" aria-pressed="false" { "Pause" }
                    button id="step" type="button" { "Step" }
                    button id="restart" type="button" { "Restart" }
                    span.number id="now" {}
                    label { "Colour " select id="colour" {
                        @for (k, quantity) in ["tension", "bending", "twist"].iter().enumerate() {
                            option value=(k) { (quantity) }
                        }
                    } }
                    span { span.scale id="scale" {} " " span.number id="range" {} }
                    label { input id="forces" type="checkbox" checked; " forces" }
                    label { input id="follow" type="checkbox" checked; " follow the load" }
                    button id="fit" type="button" { "Fit" }
                }
                div.drives id="drives" {}
                div.bar {
                    label { "Solver " select id="solver" {} }
                    label { "Scheme " select id="scheme" {} }
                    label id="heavy" { "Load (kg) " input id="mass" type="number" min="0" step="any"; " " span id="ratio" {} }
                    button id="record" type="button" aria-pressed="false" { "Record" }
                    button id="recording" type="button" hidden { "Get the recording" }
                    button id="save" type="button" { "Save the run" }
                }
                p.figures id="figures" {}
                p.quiet {
                    "A held key drives at the speed beside its slider until it is released. Space pauses, period steps, 0 fits. "
                    "Drag turns the picture, the wheel zooms, Shift and drag move it. A control stops when the page that drives it "
                    "closes."
                }
                div.plots id="plots" {}
                script type="application/json" id="data" { "[]" }
                script nonce=(nonce) { (PreEscaped([PICTURE, LOOK, SCRIPT].concat())) }
            }
        }
    };
    page.into_string()
}
