//! Scenes that are driven from a browser: a page on the loopback interface, 60 frames a second by the clock.
//!
//! [`Drive`] is the run, which obeys commands and shows frames; [`View::run`] moves it by the [`Clock`] and serves it. The
//! forms of what a socket carries are [`Command`], [`About`], [`Status`] and [`Drive::frame`].
//!
//! ```
//! use taut_integrator::StepOptions;
//! use taut_model::GantryParams;
//! use taut_view::Drive;
//!
//! let scene = GantryParams { segments: 3, ..GantryParams::default() }.build()?;
//! let mut drive = Drive::new(scene, StepOptions { backend: "dense".parse()?, ..StepOptions::default() })?;
//! drive.command(serde_json::from_str(r#"{"set": {"control": "trolley_speed", "value": 0.5}}"#)?)?;
//! drive.advance(2.0, &|| true);
//! let trolley = drive.stepper().scene().bodies.position[1];
//! assert!((trolley.x - 1.0).abs() < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | `drive` | the run: commands, frames |
//! | `clock` | when frames are due, and which were late |
//! | `server` | page and socket: who may ask, what is sent |
//! | `page` | the page |

// Unpublished: a comment says why, a unit or an error, not a name again.
#![allow(missing_docs)]

mod clock;
mod drive;
mod page;
mod server;

pub use clock::{Clock, RATE};
pub use drive::{About, Command, Drive, Error, Status};
pub use server::{MAX_VIEWERS, Save};

use serde_json::json;
use server::{RunRequest, Shared};
use std::fmt;
use std::io;
use std::net::{Ipv4Addr, TcpListener};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::mpsc::Receiver;

/// Requests that a frame answers at most.
const MAX_REQUESTS: usize = 64;

/// Frames from one status to the next.
const STATUS: u64 = 6;

/// Time after which a frame ends with steps still due.
const MAX_FRAME: Duration = Duration::from_millis(100);

/// Why the port cannot be taken.
fn refused(port: u16, e: &io::Error) -> io::Error {
    let text = match e.kind() {
        io::ErrorKind::AddrInUse => format!(
            "port {port} is in use: give another one with `--port`, or 0 for one that is free"
        ),
        _ => format!("cannot listen at port {port}: {e}"),
    };
    io::Error::new(e.kind(), text)
}

fn unserved(e: impl fmt::Display) -> io::Error {
    io::Error::other(format!("cannot serve the page: {e}"))
}

/// A page that is served.
pub struct View {
    shared: Arc<Shared>,
    requests: Receiver<RunRequest>,
    server: Option<JoinHandle<io::Result<()>>>,
    address: String,
}

impl View {
    /// Serves a page with this title at a port of the loopback interface, 0 for one that is free; `save` makes a file of a run.
    pub fn open(port: u16, title: &str, save: Box<Save>) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port));
        let listener = listener.map_err(|e| refused(port, &e))?;
        let port = listener.local_addr().map_err(unserved)?.port();
        let mut token = [0; 16];
        getrandom::fill(&mut token).map_err(unserved)?;
        let token: String = token.iter().map(|byte| format!("{byte:02x}")).collect();
        let address = format!("http://127.0.0.1:{port}/{token}/");
        let (shared, requests) = Shared::new((port, token), title.to_owned(), save);
        let (runtime, listener) = runtime(listener).map_err(unserved)?;
        let serving = server::serve(Arc::clone(&shared), listener);
        let server = thread::Builder::new()
            .name("server".to_owned())
            .spawn(move || runtime.block_on(serving))
            .map_err(unserved)?;
        Ok(Self {
            shared,
            requests,
            server: Some(server),
            address,
        })
    }

    /// The address of the page.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// Moves the run by the clock until `stop`.
    pub fn run(&mut self, drive: &mut Drive, stop: &dyn Fn() -> bool) -> io::Result<()> {
        let mut clock = Clock::start(Instant::now());
        let (mut generation, mut busiest) = (0, 0.0);
        while !stop() {
            self.check_server()?;
            thread::sleep(clock.due().saturating_duration_since(Instant::now()));
            let begun = Instant::now();
            let is_asked = self.answer(drive);
            drive.advance(1.0 / RATE, &|| begun.elapsed() < MAX_FRAME);
            if self.shared.viewers() > 0 || generation == 0 {
                let frame = drive.frame();
                if drive.generation() != generation {
                    generation = drive.generation();
                    let about = json!({ "about": drive.about() });
                    self.shared.send_about(about.to_string());
                }
                self.shared.send_frame(frame);
            }
            if is_asked || clock.frames.is_multiple_of(STATUS) {
                if clock.frames.is_multiple_of(STATUS) {
                    busiest = 1e3 * clock.busiest().as_secs_f64();
                }
                let status = json!({ "status": drive.status(), "clock": {
                    "frames": clock.frames,
                    "late": clock.late,
                    "lost_ms": 1e3 * clock.lost.as_secs_f64(),
                    "busiest_ms": busiest,
                    "viewers": self.shared.viewers(),
                } });
                self.shared.send_status(status.to_string());
            }
            clock.done(begun, Instant::now());
        }
        Ok(())
    }

    fn check_server(&mut self) -> io::Result<()> {
        let Some(server) = self.server.take_if(|server| server.is_finished()) else {
            return Ok(());
        };
        let ended = || io::Error::other("the server has ended");
        let error = server.join().ok().and_then(Result::err);
        Err(unserved(error.unwrap_or_else(ended)))
    }

    /// Answers the requests since the last frame: whether there were any.
    fn answer(&mut self, drive: &mut Drive) -> bool {
        for count in 0..MAX_REQUESTS {
            let Ok(request) = self.requests.try_recv() else {
                return count > 0;
            };
            // Who has gone away needs no answer.
            match request {
                RunRequest::Command(command, refuse) => {
                    if let (Err(text), Some(refuse)) = (drive.command(command), refuse) {
                        let _ = refuse.try_send(text);
                    }
                }
                RunRequest::Save(answer) => {
                    let run = drive.stepper().save();
                    let _ = answer.send(run.map_err(|e| e.to_string()));
                }
                RunRequest::Recording(answer) => {
                    let _ = answer.send(drive.recorded());
                }
            }
        }
        true
    }
}

fn runtime(listener: TcpListener) -> io::Result<(Runtime, tokio::net::TcpListener)> {
    let runtime = Builder::new_current_thread().enable_all().build()?;
    listener.set_nonblocking(true)?;
    let entered = runtime.enter();
    let listener = tokio::net::TcpListener::from_std(listener)?;
    drop(entered);
    Ok((runtime, listener))
}
