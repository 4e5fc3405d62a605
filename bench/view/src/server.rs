//! The page and its socket on the loopback interface.
//!
//! The address holds a random token. Requests with another host or origin are refused, so that pages of other sites can neither
//! read nor drive. The socket sends JSON (layout, status) and frames, and takes commands. A control returns to zero when the
//! viewer that set it last goes away: closed, or silent for [`SILENCE`].

use crate::drive::Command;
use crate::page::page;
use axum::Router;
use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri, header};
use axum::middleware::{self, Next};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::get;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::io;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use taut_integrator::SavedRun;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::broadcast::{self, error::RecvError};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc, oneshot};
use tokio::task;
use tokio::time::{interval, sleep, timeout};

/// Most viewers at a time.
pub const MAX_VIEWERS: usize = 128;

/// Most connections at a time that are no viewer's yet; others wait until one of them ends.
const MAX_CONNECTIONS: usize = 64;

/// Time for the header of a request, and between two of a connection.
const HEADER: Duration = Duration::from_secs(5);

/// Time of a connection that becomes no viewer's: far more than the page or a saved run takes on this machine.
const CONNECTION: Duration = Duration::from_secs(60);

/// Time until the next try where no connection can be taken, as without free file descriptors.
const RETRY: Duration = Duration::from_millis(100);

/// Messages that wait for a slow viewer, who misses those beyond.
const MAX_WAITING: usize = 32;

/// Commands that wait for the next frame.
const MAX_COMMANDS: usize = 256;

/// Refusals that wait for a viewer.
const MAX_REFUSALS: usize = 16;

/// Controls that differ from zero at a time.
const MAX_DRIVEN: usize = 1024;

/// Longest command in bytes.
const LONGEST: usize = 4096;

/// Time after which a viewer that neither takes nor sends anything is gone.
const SILENCE: Duration = Duration::from_secs(5);

/// Encodes a saved run as the bytes of a file.
pub type Save = dyn Fn(SavedRun) -> Result<Vec<u8>, String> + Send + Sync;

pub(crate) enum RunRequest {
    /// A command, and where its refusal goes.
    Command(Command, Option<mpsc::Sender<String>>),
    Save(oneshot::Sender<Result<SavedRun, String>>),
    /// The recording that has ended.
    Recording(oneshot::Sender<Option<Bytes>>),
}

/// State shared by all viewers.
pub(crate) struct Shared {
    port: u16,
    token: String,
    title: String,
    save: Box<Save>,
    all: broadcast::Sender<Message>,
    latest: Mutex<Latest>,
    requests: mpsc::Sender<RunRequest>,
    viewers: AtomicUsize,
    /// Viewers so far: the number of each.
    count: AtomicU64,
    /// The viewer that set a control, or one of what follows it, to other than zero.
    driven: Mutex<BTreeMap<DriveKey, u64>>,
}

/// A control, and what follows it if that is driven alone.
type DriveKey = (String, Option<String>);

/// Messages that a new viewer gets first.
#[derive(Default, Clone)]
struct Latest {
    about: Option<Message>,
    status: Option<Message>,
}

fn locked<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    pub(crate) fn new(
        (port, token): (u16, String),
        title: String,
        save: Box<Save>,
    ) -> (Arc<Self>, mpsc::Receiver<RunRequest>) {
        let (requests, received) = mpsc::channel(MAX_COMMANDS);
        let shared = Self {
            port,
            token,
            title,
            save,
            all: broadcast::channel(MAX_WAITING).0,
            latest: Mutex::default(),
            requests,
            viewers: AtomicUsize::new(0),
            count: AtomicU64::new(0),
            driven: Mutex::default(),
        };
        (Arc::new(shared), received)
    }

    pub(crate) fn viewers(&self) -> usize {
        self.viewers.load(Ordering::Relaxed)
    }

    pub(crate) fn send_frame(&self, frame: Vec<u8>) {
        // Without viewers it goes nowhere.
        let _ = self.all.send(Message::Binary(frame.into()));
    }

    /// Sends what frames mean to all viewers, and to those to come.
    pub(crate) fn send_about(&self, text: String) {
        let message = Message::Text(text.into());
        locked(&self.latest).about = Some(message.clone());
        let _ = self.all.send(message);
    }

    /// Sends the status to all viewers, and to those to come.
    pub(crate) fn send_status(&self, text: String) {
        let message = Message::Text(text.into());
        locked(&self.latest).status = Some(message.clone());
        let _ = self.all.send(message);
    }

    /// Takes note of who drives what; whether there is room.
    fn note(&self, viewer: u64, command: &Command) -> bool {
        let Command::Set {
            control,
            drive,
            value,
        } = command
        else {
            return true;
        };
        let mut driven = locked(&self.driven);
        // A control sets all that follows it.
        if drive.is_none() {
            driven.retain(|(other, _), _| other != control);
        }
        let place = (control.clone(), drive.clone());
        if *value == 0.0 {
            driven.remove(&place);
            return true;
        }
        let has_room = driven.len() < MAX_DRIVEN || driven.contains_key(&place);
        if has_room {
            driven.insert(place, viewer);
        }
        has_room
    }

    /// Removes and returns the places that `viewer` was the last to set to other than zero.
    fn left_by(&self, viewer: u64) -> Vec<DriveKey> {
        let mut left = Vec::new();
        locked(&self.driven).retain(|place, of| {
            if *of == viewer {
                left.push(place.clone());
            }
            *of != viewer
        });
        left
    }

    /// True if `host` names this server.
    fn is_here(&self, host: &str) -> bool {
        ["127.0.0.1", "localhost"].iter().any(|name| {
            host == format!("{name}:{}", self.port) || (self.port == 80 && host == *name)
        })
    }

    /// True if a request is to this server, and comes from its own page or from no page. A second
    /// `Host` or `Origin` is refused. An authority in the request's target has to be this server's.
    fn is_own(&self, target: &Uri, headers: &HeaderMap) -> bool {
        let text = |name| headers.get(name).map(|value| value.to_str().unwrap_or("?"));
        let repeated = |name| headers.get_all(name).iter().nth(1).is_some();
        let mut authority = target.authority().into_iter();
        if [header::HOST, header::ORIGIN].into_iter().any(repeated)
            || authority.any(|authority| !self.is_here(authority.as_str()))
        {
            return false;
        }
        let origin = text(header::ORIGIN);
        let of_page = |origin: &str| {
            let host = origin.strip_prefix("http://");
            host.is_some_and(|host| self.is_here(host))
        };
        text(header::HOST).is_some_and(|host| self.is_here(host)) && origin.is_none_or(of_page)
    }
}

/// Serves until the program ends.
pub(crate) async fn serve(shared: Arc<Shared>, listener: TcpListener) -> io::Result<()> {
    let routes = routes(shared);
    let places = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    loop {
        let place = Arc::clone(&places).acquire_owned().await;
        let place = place.map_err(io::Error::other)?;
        match listener.accept().await {
            Ok((stream, _)) => drop(task::spawn(converse(routes.clone(), stream, place))),
            Err(_) => sleep(RETRY).await,
        }
    }
}

/// Answers the requests of a connection, which has its place until it ends or becomes a viewer's.
async fn converse(routes: Router, stream: TcpStream, _place: OwnedSemaphorePermit) {
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEADER)
        .serve_connection(TokioIo::new(stream), TowerToHyperService::new(routes))
        .with_upgrades();
    // Who breaks off or is late gets no answer.
    let _ = timeout(CONNECTION, connection).await;
}

fn routes(shared: Arc<Shared>) -> Router {
    let guard = middleware::from_fn_with_state(Arc::clone(&shared), guard);
    Router::new()
        .route("/{token}/", get(own_page))
        .route("/{token}/socket", get(socket))
        .route("/{token}/run.json", get(saved))
        .route("/{token}/recording", get(recording))
        .fallback(not_found)
        .layer(guard)
        .with_state(shared)
}

/// Closes the connection, so that a refused client holds no place.
fn refuse(status: StatusCode, text: &'static str) -> Response {
    (status, [(header::CONNECTION, "close")], text).into_response()
}

async fn not_found() -> Response {
    let text = "There is nothing here: open the address that `taut view` has printed.\n";
    refuse(StatusCode::NOT_FOUND, text)
}

/// Refuses requests of other pages, to other hosts, or without the token.
async fn guard(State(shared): State<Arc<Shared>>, request: Request, next: Next) -> Response {
    if !shared.is_own(request.uri(), request.headers()) {
        let text = "Only the page that `taut view` serves may send requests here.\n";
        return refuse(StatusCode::FORBIDDEN, text);
    }
    let token = request.uri().path().split('/').nth(1);
    let mut response = if token == Some(&shared.token) {
        next.run(request).await
    } else {
        not_found().await
    };
    let nonce = &shared.token;
    let policy = format!(
        "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; connect-src 'self'; img-src data:; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    );
    let headers = response.headers_mut();
    if let Ok(policy) = HeaderValue::from_str(&policy) {
        headers.insert(header::CONTENT_SECURITY_POLICY, policy);
    }
    for (name, value) in [
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

async fn own_page(State(shared): State<Arc<Shared>>) -> Html<String> {
    Html(page(&shared.title, &shared.token))
}

/// Sends a request to the run, and waits for its answer.
async fn answer<T>(
    shared: &Shared,
    request: impl FnOnce(oneshot::Sender<T>) -> RunRequest,
) -> Result<T, String> {
    let (answers, answer) = oneshot::channel();
    let ended = || "the run has ended".to_owned();
    let sent = shared.requests.send(request(answers)).await;
    sent.map_err(|_| ended())?;
    answer.await.map_err(|_| ended())
}

/// A file for the browser, or why there is none.
fn file(name: &str, bytes: Result<Bytes, String>) -> Response {
    match bytes {
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
    let run = answer(&shared, RunRequest::Save).await.flatten();
    let bytes = match run {
        // Not where sockets wait.
        Ok(run) => task::spawn_blocking(move || (shared.save)(run)).await,
        Err(e) => Ok(Err(e)),
    };
    let bytes = bytes.unwrap_or_else(|e| Err(e.to_string()));
    file("run.json", bytes.map(Bytes::from))
}

async fn recording(State(shared): State<Arc<Shared>>) -> Response {
    let none = "there is no recording yet: start one and stop it";
    let recorded = answer(&shared, RunRequest::Recording).await;
    let recorded = recorded.and_then(|bytes| bytes.ok_or_else(|| none.to_owned()));
    file("run.tape", recorded)
}

/// A viewer, counted while there is one.
struct Viewer(Arc<Shared>);

impl Drop for Viewer {
    fn drop(&mut self) {
        self.0.viewers.fetch_sub(1, Ordering::Relaxed);
    }
}

async fn socket(State(shared): State<Arc<Shared>>, upgrade: WebSocketUpgrade) -> Response {
    let others = shared.viewers.fetch_add(1, Ordering::Relaxed);
    let viewer = Viewer(shared);
    if others >= MAX_VIEWERS {
        let text = format!("There are {MAX_VIEWERS} viewers already: close one.\n");
        return (StatusCode::SERVICE_UNAVAILABLE, text).into_response();
    }
    let upgrade = upgrade.max_message_size(LONGEST).max_frame_size(LONGEST);
    upgrade.on_upgrade(move |socket| async move {
        let shared = &viewer.0;
        let number = shared.count.fetch_add(1, Ordering::Relaxed);
        show(shared, socket, number).await;
        for (control, drive) in shared.left_by(number) {
            let command = Command::Set {
                control,
                drive,
                value: 0.0,
            };
            let request = RunRequest::Command(command, None);
            let _ = shared.requests.send(request).await;
        }
    })
}

/// Sends a message. False if the viewer is gone or does not take it within [`SILENCE`].
async fn send(socket: &mut WebSocket, message: Message) -> bool {
    matches!(timeout(SILENCE, socket.send(message)).await, Ok(Ok(())))
}

/// Shows the run to a viewer and takes its commands, until it goes away.
async fn show(shared: &Shared, mut socket: WebSocket, viewer: u64) {
    let mut all = shared.all.subscribe();
    let (refuse, mut refusals) = mpsc::channel(MAX_REFUSALS);
    if !send_latest(shared, &mut socket).await {
        return;
    }
    let mut beat = interval(SILENCE / 3);
    let mut heard = Instant::now();
    loop {
        let is_here = tokio::select! {
            message = all.recv() => match message {
                Ok(message) => send(&mut socket, message).await,
                Err(RecvError::Lagged(count)) => {
                    send(&mut socket, json_message("missed", count)).await
                        && send_latest(shared, &mut socket).await
                }
                Err(RecvError::Closed) => false,
            },
            Some(refusal) = refusals.recv() => send(&mut socket, json_message("refused", refusal)).await,
            _ = beat.tick() => {
                heard.elapsed() < SILENCE && send(&mut socket, Message::Ping(Bytes::new())).await
            }
            message = socket.recv() => {
                heard = Instant::now();
                match message {
                    Some(Ok(Message::Text(text))) => {
                        match take(shared, &text, (viewer, &refuse)).await {
                            Ok(()) => true,
                            Err(text) => send(&mut socket, json_message("refused", text)).await,
                        }
                    }
                    Some(Ok(Message::Close(_)) | Err(_)) | None => false,
                    Some(Ok(_)) => true,
                }
            }
        };
        if !is_here {
            return;
        }
    }
}

fn json_message<T: serde::Serialize>(what: &str, value: T) -> Message {
    Message::Text(serde_json::json!({ what: value }).to_string().into())
}

async fn send_latest(shared: &Shared, socket: &mut WebSocket) -> bool {
    let Latest { about, status } = locked(&shared.latest).clone();
    for message in [about, status].into_iter().flatten() {
        if !send(socket, message).await {
            return false;
        }
    }
    true
}

/// Hands a viewer's command to the run.
async fn take(
    shared: &Shared,
    text: &str,
    (viewer, refuse): (u64, &mpsc::Sender<String>),
) -> Result<(), String> {
    let mut reader = serde_json::Deserializer::from_str(text);
    let command = Command::deserialize(&mut reader);
    let command = command.and_then(|command| reader.end().map(|()| command));
    let command = command.map_err(|e| format!("not a command: {e}"))?;
    if !shared.note(viewer, &command) {
        return Err(format!("{MAX_DRIVEN} controls are driven: stop one"));
    }
    let request = RunRequest::Command(command, Some(refuse.clone()));
    let sent = shared.requests.send(request).await;
    sent.map_err(|_| "the run has ended".to_owned())
}

#[cfg(test)]
mod tests;
