//! Who looks on: a page and its socket on the loopback interface.
//!
//! The address holds a random token, and only requests to that address by its own page are answered: others' pages can
//! neither read nor drive. The socket sends JSON (what frames mean, status) and frames; it takes commands. Values that a
//! page has set return to zero when it goes away.

use crate::drive::Command;
use crate::page::page;
use axum::Router;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Path, Request, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::get;
use serde::Deserialize;
use std::collections::BTreeSet;
use std::net::TcpListener;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::{broadcast, mpsc, oneshot};

/// Sockets at most.
pub const MOST: usize = 128;

/// Frames that wait for a slow browser; it misses those beyond.
const WAITING: usize = 32;

/// Commands that wait for the next frame.
const COMMANDS: usize = 256;

/// Longest command in bytes.
const LONGEST: usize = 4096;

/// What the server asks of the run.
pub(crate) enum Asked {
    /// Of a driver.
    Command(Command),
    /// The run as a file to be resumed.
    Save(oneshot::Sender<Result<Vec<u8>, String>>),
    /// The recording that has ended.
    Recording(oneshot::Sender<Result<Vec<u8>, String>>),
}

/// What all that look on share.
pub(crate) struct Shared {
    port: u16,
    token: String,
    title: String,
    all: broadcast::Sender<Message>,
    /// What frames mean, and the status.
    latest: Mutex<[Option<Message>; 2]>,
    asked: mpsc::Sender<Asked>,
    sockets: AtomicUsize,
}

impl Shared {
    pub(crate) fn new(
        port: u16,
        token: String,
        title: String,
    ) -> (Arc<Self>, mpsc::Receiver<Asked>) {
        let (asked, takes) = mpsc::channel(COMMANDS);
        let shared = Self {
            port,
            token,
            title,
            all: broadcast::channel(WAITING).0,
            latest: Mutex::default(),
            asked,
            sockets: AtomicUsize::new(0),
        };
        (Arc::new(shared), takes)
    }

    /// Those that look on.
    pub(crate) fn sockets(&self) -> usize {
        self.sockets.load(Ordering::Relaxed)
    }

    /// Sends a frame to all.
    pub(crate) fn send_frame(&self, frame: Vec<u8>) {
        // Without anyone there it goes nowhere.
        let _ = self.all.send(Message::Binary(frame.into()));
    }

    /// Sends what frames mean (0) or the status (1) to all, and to those who come later.
    pub(crate) fn send_text(&self, kind: usize, text: String) {
        let message = Message::Text(text.into());
        let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        latest[kind] = Some(message.clone());
        let _ = self.all.send(message);
    }

    fn latest(&self) -> [Option<Message>; 2] {
        let latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        latest.clone()
    }

    /// Whether it names this server.
    fn is_here(&self, host: &str) -> bool {
        ["127.0.0.1", "localhost"].iter().any(|name| {
            host == format!("{name}:{}", self.port) || (self.port == 80 && host == *name)
        })
    }

    /// Whether a request is to this server, and by its own page or by no page.
    fn is_own(&self, headers: &HeaderMap) -> bool {
        let text = |name| headers.get(name).map(|value| value.to_str().unwrap_or("?"));
        let origin = text(header::ORIGIN);
        let of_page = |origin: &str| {
            let host = origin.strip_prefix("http://");
            host.is_some_and(|host| self.is_here(host))
        };
        text(header::HOST).is_some_and(|host| self.is_here(host)) && origin.is_none_or(of_page)
    }
}

/// Serves until the program ends.
pub(crate) fn serve(shared: Arc<Shared>, listener: TcpListener) -> std::io::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?;
    runtime.block_on(async move {
        listener.set_nonblocking(true)?;
        let listener = tokio::net::TcpListener::from_std(listener)?;
        let guard = middleware::from_fn_with_state(Arc::clone(&shared), guard);
        let routes = Router::new()
            .route("/{token}/", get(shown))
            .route("/{token}/socket", get(socket))
            .route("/{token}/run.json", get(saved))
            .route("/{token}/recording", get(recording))
            .fallback(lost)
            .layer(guard)
            .with_state(shared);
        axum::serve(listener, routes).await
    })
}

async fn lost() -> Response {
    let text = "There is nothing here: open the address that `taut view` has printed.\n";
    (StatusCode::NOT_FOUND, text).into_response()
}

/// Turns away what other pages, other hosts, or strangers ask for.
async fn guard(State(shared): State<Arc<Shared>>, request: Request, next: Next) -> Response {
    if !shared.is_own(request.headers()) {
        let text = "Only the page that `taut view` serves may ask here.\n";
        return (StatusCode::FORBIDDEN, text).into_response();
    }
    let token = request.uri().path().split('/').nth(1);
    let mut response = if token == Some(&shared.token) {
        next.run(request).await
    } else {
        lost().await
    };
    let policy = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; img-src data:; \
                  frame-ancestors 'none'";
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, policy),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    ] {
        let value = header::HeaderValue::from_static(value);
        response.headers_mut().insert(name, value);
    }
    response
}

async fn shown(State(shared): State<Arc<Shared>>) -> Html<String> {
    Html(page(&shared.title))
}

/// Asks the run, and gives a browser what it answers as a file.
async fn asked(
    shared: &Shared,
    ask: impl FnOnce(oneshot::Sender<Result<Vec<u8>, String>>) -> Asked,
    name: &str,
) -> Response {
    let (answers, answer) = oneshot::channel();
    let gone = || Err("the run has ended".to_owned());
    let answer = match shared.asked.send(ask(answers)).await {
        Ok(()) => answer.await.unwrap_or_else(|_| gone()),
        Err(_) => gone(),
    };
    match answer {
        Ok(bytes) => {
            let disposition = format!("attachment; filename=\"{name}\"");
            let kind = "application/octet-stream".to_owned();
            let headers = [
                (header::CONTENT_TYPE, kind),
                (header::CONTENT_DISPOSITION, disposition),
            ];
            (headers, bytes).into_response()
        }
        Err(text) => (StatusCode::CONFLICT, text + "\n").into_response(),
    }
}

async fn saved(State(shared): State<Arc<Shared>>) -> Response {
    asked(&shared, Asked::Save, "run.json").await
}

async fn recording(State(shared): State<Arc<Shared>>) -> Response {
    asked(&shared, Asked::Recording, "run.tape").await
}

async fn socket(
    State(shared): State<Arc<Shared>>,
    Path(_): Path<String>,
    upgrade: WebSocketUpgrade,
) -> Response {
    if shared.sockets.fetch_add(1, Ordering::Relaxed) >= MOST {
        shared.sockets.fetch_sub(1, Ordering::Relaxed);
        let text = format!("{MOST} browsers look on already: close one.\n");
        return (StatusCode::SERVICE_UNAVAILABLE, text).into_response();
    }
    // Counted down when the socket closes, or is never opened.
    let counted = Counted(Arc::clone(&shared));
    let upgrade = upgrade.max_message_size(LONGEST).max_frame_size(LONGEST);
    upgrade.on_upgrade(move |socket| async move {
        let mut held = BTreeSet::new();
        look_on(&counted.0, socket, &mut held).await;
        for (control, drive) in held {
            let command = Command::Set {
                control,
                drive,
                value: 0.0,
            };
            let _ = counted.0.asked.send(Asked::Command(command)).await;
        }
        drop(counted);
    })
}

struct Counted(Arc<Shared>);

impl Drop for Counted {
    fn drop(&mut self) {
        self.0.sockets.fetch_sub(1, Ordering::Relaxed);
    }
}

/// A control, or one of what follows it.
type Held = BTreeSet<(usize, Option<usize>)>;

/// Sends what goes on and takes commands, until the browser goes away; `held` is what it has set to other than zero.
async fn look_on(shared: &Shared, mut socket: WebSocket, held: &mut Held) {
    let mut all = shared.all.subscribe();
    for message in shared.latest().into_iter().flatten() {
        if socket.send(message).await.is_err() {
            return;
        }
    }
    loop {
        tokio::select! {
            message = all.recv() => {
                let sent = match message {
                    Ok(message) => socket.send(message).await,
                    Err(broadcast::error::RecvError::Lagged(count)) => {
                        behind(shared, &mut socket, count).await
                    }
                    Err(broadcast::error::RecvError::Closed) => return,
                };
                if sent.is_err() {
                    return;
                }
            }
            message = socket.recv() => match message {
                Some(Ok(Message::Text(text))) => {
                    let refused = take(shared, &text, held).await;
                    if let Err(text) = refused && socket.send(told("refused", &text)).await.is_err() {
                        return;
                    }
                }
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                Some(Ok(_)) => {}
            },
        }
    }
}

fn told<T: serde::Serialize>(what: &str, value: T) -> Message {
    Message::Text(serde_json::json!({ what: value }).to_string().into())
}

/// Tells a browser that it has missed so many messages, and what frames mean now.
async fn behind(shared: &Shared, socket: &mut WebSocket, count: u64) -> Result<(), axum::Error> {
    socket.send(told("missed", count)).await?;
    for message in shared.latest().into_iter().flatten() {
        socket.send(message).await?;
    }
    Ok(())
}

/// Hands a command on, and remembers what it sets.
async fn take(shared: &Shared, text: &str, held: &mut Held) -> Result<(), String> {
    let mut reader = serde_json::Deserializer::from_str(text);
    let command =
        Command::deserialize(&mut reader).and_then(|command| reader.end().map(|()| command));
    let command = command.map_err(|e| format!("not a command: {e}"))?;
    if let Command::Set {
        control,
        drive,
        value,
    } = &command
    {
        let place = (*control, *drive);
        // A control sets all that follows it.
        if drive.is_none() {
            held.retain(|(other, _)| other != control);
        }
        if *value == 0.0 {
            held.remove(&place);
        } else if held.len() < COMMANDS {
            held.insert(place);
        }
    }
    let gone = |_| "the run has ended".to_owned();
    shared
        .asked
        .send(Asked::Command(command))
        .await
        .map_err(gone)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(host: &str, origin: Option<&str>) -> HeaderMap {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, host.parse().expect("a host"));
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, origin.parse().expect("an origin"));
        }
        headers
    }

    #[test]
    fn only_the_own_page_may_ask() {
        let (shared, _) = Shared::new(8021, "t".to_owned(), "crane".to_owned());
        let own = |host, origin| shared.is_own(&headers(host, origin));
        assert!(own("127.0.0.1:8021", None));
        assert!(own("localhost:8021", Some("http://localhost:8021")));
        for (host, origin) in [
            ("127.0.0.1:8022", None),
            ("127.0.0.1", None),
            ("crane.example:8021", None),
            ("127.0.0.1:8021", Some("null")),
            ("127.0.0.1:8021", Some("https://127.0.0.1:8021")),
            ("127.0.0.1:8021", Some("http://crane.example")),
            (
                "127.0.0.1:8021",
                Some("http://localhost:8021.crane.example"),
            ),
        ] {
            assert!(!own(host, origin), "{host} {origin:?}");
        }
        assert!(!shared.is_own(&HeaderMap::new()));
    }
}
