//! Scenes that are driven from a browser: a page on the loopback interface, 60 frames a second by the clock.
//!
//! [`Drive`] is the run, which obeys commands and shows frames; [`View::run`] moves it by the [`Clock`] and serves it. The
//! forms of what a socket carries are [`Command`], [`About`], [`Status`] and [`Drive::frame`].
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | `drive` | the run: commands, frames |
//! | `clock` | when frames are due, and which were late |
//! | `server` | page and socket: who may ask, what is sent |
//! | `page` | the page |

mod clock;
mod drive;
mod page;
mod server;

pub use clock::{Clock, RATE};
pub use drive::{About, Command, Drive, Status};
pub use server::MOST;

use serde_json::json;
use server::{Asked, Shared};
use std::fmt;
use std::io;
use std::net::{Ipv4Addr, TcpListener};
use std::sync::Arc;
use std::thread;
use std::time::Instant;
use taut_integrator::Stepper;
use tokio::sync::mpsc::Receiver;

/// Commands that a frame obeys at most.
const COMMANDS: usize = 64;

/// Frames from one status to the next.
const STATUS: u64 = 6;

/// Why nothing can be shown.
#[derive(Debug)]
#[non_exhaustive]
pub enum ViewError {
    /// The port cannot be taken.
    Port(u16, io::Error),
    /// There is no server, or no random token.
    Server(io::Error),
}

impl fmt::Display for ViewError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Port(port, e) if e.kind() == io::ErrorKind::AddrInUse => write!(
                f,
                "port {port} is in use: give another one with `--port`, or 0 for one that is free"
            ),
            Self::Port(port, e) => write!(f, "cannot listen at port {port}: {e}"),
            Self::Server(e) => write!(f, "cannot serve the page: {e}"),
        }
    }
}

impl std::error::Error for ViewError {}

/// A page that is served.
pub struct View {
    shared: Arc<Shared>,
    asked: Receiver<Asked>,
    address: String,
}

impl View {
    /// Serves a page with this title at a port of the loopback interface, 0 for one that is free.
    ///
    /// # Errors
    /// [`ViewError`].
    pub fn open(port: u16, title: &str) -> Result<Self, ViewError> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port));
        let listener = listener.map_err(|e| ViewError::Port(port, e))?;
        let port = listener.local_addr().map_err(ViewError::Server)?.port();
        let mut token = [0; 16];
        getrandom::fill(&mut token).map_err(|e| ViewError::Server(io::Error::other(e)))?;
        let token: String = token.iter().map(|byte| format!("{byte:02x}")).collect();
        let address = format!("http://127.0.0.1:{port}/{token}/");
        let (shared, asked) = Shared::new(port, token, title.to_owned());
        let serving = Arc::clone(&shared);
        thread::Builder::new()
            .name("server".to_owned())
            .spawn(move || server::serve(serving, listener))
            .map_err(ViewError::Server)?;
        Ok(Self {
            shared,
            asked,
            address,
        })
    }

    /// The address of the page.
    #[must_use]
    pub fn address(&self) -> &str {
        &self.address
    }

    /// Moves the run by the clock until `stop`; `save` makes a file of it.
    pub fn run(
        &mut self,
        drive: &mut Drive,
        save: &dyn Fn(&Stepper) -> Result<Vec<u8>, String>,
        stop: &dyn Fn() -> bool,
    ) {
        let mut clock = Clock::start(Instant::now());
        let (mut generation, mut busiest) = (0, 0.0);
        while !stop() {
            thread::sleep(clock.due().saturating_duration_since(Instant::now()));
            let begun = Instant::now();
            let is_asked = self.answer(drive, save);
            drive.advance(1.0 / RATE);
            if self.shared.sockets() > 0 || generation == 0 {
                let frame = drive.frame();
                if drive.generation() != generation {
                    generation = drive.generation();
                    let about = json!({ "about": drive.about() });
                    self.shared.send_text(0, about.to_string());
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
                    "browsers": self.shared.sockets(),
                } });
                self.shared.send_text(1, status.to_string());
            }
            clock.done(begun, Instant::now());
        }
    }

    /// Obeys what was asked since the last frame: whether there was anything.
    fn answer(
        &mut self,
        drive: &mut Drive,
        save: &dyn Fn(&Stepper) -> Result<Vec<u8>, String>,
    ) -> bool {
        for count in 0..COMMANDS {
            let Ok(asked) = self.asked.try_recv() else {
                return count > 0;
            };
            // Who has gone away needs no answer.
            match asked {
                Asked::Command(command) => drive.command(command),
                Asked::Save(answer) => {
                    let _ = answer.send(save(drive.stepper()));
                }
                Asked::Recording(answer) => {
                    let bytes = drive.recorded().map(<[u8]>::to_vec);
                    let none = "there is no recording that has ended";
                    let _ = answer.send(bytes.ok_or_else(|| none.to_owned()));
                }
            }
        }
        true
    }
}
