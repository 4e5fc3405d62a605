//! `taut view` as drivers meet it: in a browser, by the clock. One test at a time, with the machine to itself.

mod browser;

use browser::{Browser, Page};
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tungstenite::Message;

static ALONE: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A trolley with a motor, and a point-like load on 4 m of massless cable.
const PENDULUM: &str = include_str!("pendulum.toml");

fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder to write to");
    folder
}

fn taut(folder: &Path, arguments: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_taut"));
    let program = program.current_dir(folder).args(arguments);
    program.stdin(Stdio::null()).output().expect("starts")
}

/// A scene that is served until this is dropped.
struct Served {
    child: Child,
    address: String,
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Served {
    fn new(folder: &Path, arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_taut"))
            .current_dir(folder)
            .arg("view")
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .expect("starts");
        let mut lines = BufReader::new(child.stdout.take().expect("piped")).lines();
        let line = lines.next().expect("a line").expect("text");
        let (_, address) = line.split_once(": ").expect("an address");
        Self {
            child,
            address: address.to_owned(),
        }
    }

    fn host(&self) -> &str {
        let rest = self.address.strip_prefix("http://").expect("http");
        rest.split('/').next().expect("a host")
    }

    fn path(&self) -> &str {
        let start = "http://".len() + self.host().len();
        &self.address[start..]
    }

    /// Status and body of a request with these headers.
    fn get(&self, path: &str, headers: &str) -> (u16, Vec<u8>) {
        let mut stream = TcpStream::connect(self.host()).expect("listens");
        let request = format!("GET {path} HTTP/1.1\r\nConnection: close\r\n{headers}\r\n");
        stream.write_all(request.as_bytes()).expect("sent");
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("an answer");
        let end = answer.windows(4).position(|w| w == b"\r\n\r\n");
        let body = answer.split_off(end.expect("headers") + 4);
        let head = String::from_utf8(answer).expect("text");
        let status = head.split(' ').nth(1).expect("a status");
        (status.parse().expect("a number"), body)
    }

    fn own(&self, name: &str) -> (u16, Vec<u8>) {
        let headers = format!("Host: {}\r\n", self.host());
        self.get(&format!("{}{name}", self.path()), &headers)
    }

    fn socket(&self) -> Result<tungstenite::WebSocket<TcpStream>, String> {
        let stream = TcpStream::connect(self.host()).expect("listens");
        let patience = Some(Duration::from_secs(20));
        stream.set_read_timeout(patience).expect("a time");
        let address = format!("ws://{}{}socket", self.host(), self.path());
        let opened = tungstenite::client(address, stream);
        opened.map(|(socket, _)| socket).map_err(|e| e.to_string())
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

/// Where the load is beside the trolley, over time \[s, m].
const BESIDE: &str = "(() => {
    const { part, past } = view;
    const { values, names } = part();
    const trolley = values[names.get('trolley.x')];
    return past.time.map((t, k) => [t, past.load[k][0] - trolley]);
})()";

/// Mean time from one passage through the middle to the next but one \[s].
fn period(path: &[[f64; 2]]) -> f64 {
    let pairs = path.windows(2).filter(|w| w[0][1] < 0.0 && w[1][1] >= 0.0);
    let passages = pairs.map(|w| w[0][0] - w[0][1] * (w[1][0] - w[0][0]) / (w[1][1] - w[0][1]));
    let passages: Vec<f64> = passages.collect();
    (passages[passages.len() - 1] - passages[0]) / (passages.len() - 1) as f64
}

fn beside(browser: &mut Browser, page: &Page, from: f64) -> Vec<[f64; 2]> {
    let path = browser.value(page, BESIDE);
    let all = path.as_array().expect("a path").iter();
    let all = all.map(|point| [number(&point[0]), number(&point[1])]);
    all.filter(|point| point[0] >= from).collect()
}

#[test]
fn a_driver_swings_the_load_and_changes_the_solver_on_the_way() {
    let _alone = alone();
    let at = folder("view-drive");
    fs::write(at.join("pendulum.toml"), PENDULUM).expect("writable");
    let served = Served::new(&at, &["pendulum.toml"]);
    let Some(mut browser) = Browser::open(&at) else {
        return;
    };
    let page = browser.page(&served.address);
    browser.until(&page, "window.view?.known.frames > 10");
    // A name is text.
    let begins = |place: &str, text: &str| {
        format!("document.querySelector('{place}').textContent.startsWith('{text}')")
    };
    browser.until(&page, &begins(".drive .name", "trolley <b>speed</b>"));
    browser.until(&page, &begins("h1", "pendulum <i>"));
    browser.value(
        &page,
        "view.send({ set: { control: '<s>x</s>', value: 1 } })",
    );
    browser.until(
        &page,
        "document.getElementById('alert').textContent.includes('<s>x</s>')",
    );
    let value = "document.querySelector('.drive .value').textContent";
    browser.value(
        &page,
        "document.querySelector('.drive input[type=number]').value = 0.3",
    );
    browser.key(&page, "d", true);
    browser.until(&page, &format!("{value} === '0.30'"));
    std::thread::sleep(Duration::from_millis(700));
    browser.key(&page, "d", false);
    browser.until(&page, &format!("{value} === '0.00'"));
    let from = number(&browser.value(&page, "view.state.time"));
    browser.until(&page, &format!("view.state.time > {}", from + 6.0));
    let choose = "(() => {
        const solver = document.getElementById('solver');
        solver.value = 'dense:double';
        solver.dispatchEvent(new Event('change'));
    })()";
    browser.value(&page, choose);
    browser.until(&page, "view.known.status.solver === 'dense:double'");
    browser.until(&page, &format!("view.state.time > {}", from + 13.0));
    let path = beside(&mut browser, &page, from);
    let found = period(&path);
    let expected = 2.0 * std::f64::consts::PI * (4.0_f64 / 9.81).sqrt();
    assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
    let size = path.iter().map(|p| p[1].abs()).fold(0.0, f64::max);
    assert!(size > 0.05, "{size}");
    // Each step is there, and the swing goes on smoothly over the change.
    let fastest = 1.1 * size * 2.0 * std::f64::consts::PI / expected / 60.0;
    for pair in path.windows(2) {
        let [dt, dx] = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
        let holds = (dt * 60.0).round() >= 1.0 && dx.abs() <= fastest * (dt * 60.0).round();
        assert!(holds, "{pair:?}");
    }
    no_step_is_missed(&mut browser, &page);
}

/// Waits for a status that is as it should be.
fn status(socket: &mut tungstenite::WebSocket<TcpStream>, is: impl Fn(&Value) -> bool) {
    let begun = Instant::now();
    loop {
        assert!(begun.elapsed() < Duration::from_secs(20));
        if let Message::Text(text) = socket.read().expect("a message") {
            let message: Value = serde_json::from_str(&text).expect("JSON");
            if message.get("status").is_some_and(&is) {
                return;
            }
        }
    }
}

/// A control that a viewer has set stops when that viewer closes its socket, or says nothing any more.
#[test]
fn what_a_viewer_drives_stops_when_it_is_gone() {
    let _alone = alone();
    let at = folder("view-gone");
    let served = Served::new(&at, &["gantry", "--set", "segments=4"]);
    let mut other = served.socket().expect("opened");
    let set = r#"{"set": {"control": "trolley_speed", "value": 0.5}}"#;
    for closes in [true, false] {
        let mut driver = served.socket().expect("opened");
        driver.send(Message::Text(set.into())).expect("sent");
        status(&mut other, |status| status["controls"][0][0] == 0.5);
        if closes {
            driver.close(None).expect("sent");
        }
        status(&mut other, |status| status["controls"][0][0] == 0.0);
    }
}

/// Sleeps for 10 s in ticks of a frame, and counts those from which the machine wakes it later than a frame.
fn machine_is_late() -> f64 {
    let period = Duration::from_secs_f64(1.0 / 60.0);
    let (mut due, mut late) = (Instant::now(), 0.0);
    for _ in 0..600 {
        due += period;
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        if due.elapsed() > period {
            late += 1.0;
            due = Instant::now();
        }
    }
    late
}

/// In 10 s by the clock 600 steps are made and shown, and none is later than the machine itself: in one of three spans.
fn no_step_is_missed(browser: &mut Browser, page: &Page) {
    let read = "[view.known.status.steps, view.known.clock.late, view.known.frames]";
    let mut seen = Vec::new();
    for _ in 0..3 {
        let counts = |value: Value| [0, 1, 2].map(|k| number(&value[k]));
        let before = counts(browser.value(page, read));
        let machine = machine_is_late();
        let after = counts(browser.value(page, read));
        let [steps, late, shown] = [0, 1, 2].map(|k| after[k] - before[k]);
        seen.push([steps, late, shown, machine]);
        // The status comes ten times a second; a late frame loses some time.
        let lost = 6.0 + 3.0 * machine;
        let is_whole = (600.0 - lost..=606.0).contains(&steps) && shown >= steps - 12.0 - lost;
        if late <= machine && is_whole {
            return;
        }
    }
    panic!("steps, late frames, frames shown, ticks that the machine was late: {seen:?}");
}

#[test]
fn two_browsers_and_one_that_goes_away() {
    let _alone = alone();
    let at = folder("view-two");
    let served = Served::new(&at, &["gantry", "--set", "segments=6"]);
    let Some(mut browser) = Browser::open(&at) else {
        return;
    };
    let [first, second] = [(); 2].map(|()| browser.page(&served.address));
    for page in [&first, &second] {
        browser.until(page, "window.view?.known.frames > 10");
    }
    browser.until(&second, "view.known.clock.viewers === 2");
    browser.key(&first, "d", true);
    browser.until(&second, "view.known.status.controls[0][0] === 1");
    browser.close(&first);
    browser.until(&second, "view.known.status.controls[0][0] === 0");
    browser.until(&second, "view.known.clock.viewers === 1");
    // A refused command is answered, and the run goes on.
    browser.value(&second, "view.send({ mass: -1 })");
    browser.until(
        &second,
        "document.getElementById('alert').textContent.includes('mass')",
    );
    browser.value(&second, "view.send({ mass: 2000 })");
    browser.until(&second, "document.getElementById('mass').value === '2000'");
    browser.value(&second, "document.getElementById('pause').click()");
    browser.until(&second, "view.known.status.paused");
    let time = number(&browser.value(&second, "view.state.time"));
    browser.value(&second, "document.getElementById('step').click()");
    browser.until(&second, &format!("view.state.time > {time}"));
    browser.narrow(&second);
    let fits = "window.innerWidth === 400 && document.documentElement.scrollWidth <= 400";
    browser.until(&second, fits);
}

#[test]
fn a_hundred_look_on() {
    let _alone = alone();
    let at = folder("view-hundred");
    let served = Served::new(&at, &["gantry"]);
    let mut sockets: Vec<_> = (0..100).map(|_| served.socket().expect("opened")).collect();
    let end = Instant::now() + Duration::from_secs(3);
    let mut frames = 0;
    let mut viewers = 0.0;
    while Instant::now() < end {
        for socket in &mut sockets {
            match socket.read().expect("a message") {
                Message::Binary(_) => frames += 1,
                Message::Text(text) => {
                    let message: Value = serde_json::from_str(&text).expect("JSON");
                    viewers = message["clock"]["viewers"].as_f64().unwrap_or(viewers);
                }
                _ => {}
            }
        }
    }
    assert_eq!(viewers, 100.0);
    assert!(frames > 100 * 144, "{frames}");
    while sockets.len() < taut_view::MAX_VIEWERS {
        sockets.push(served.socket().expect("opened"));
    }
    let refused = served.socket().expect_err("too many");
    assert!(refused.contains("503"), "{refused}");
    drop(sockets);
    let begun = Instant::now();
    while served.socket().is_err() {
        assert!(begun.elapsed() < Duration::from_secs(10), "nobody has gone");
    }
}

#[test]
fn others_may_not_ask() {
    let _alone = alone();
    let at = folder("view-others");
    let served = Served::new(&at, &["hoist", "--set", "segments=3"]);
    let host = format!("Host: {}\r\n", served.host());
    assert_eq!(served.own("").0, 200);
    assert_eq!(served.get(&served.address, &host).0, 200);
    for (path, headers, status) in [
        // A second host beside this one, or another authority.
        (served.path(), format!("{host}Host: crane.example\r\n"), 400),
        (served.path(), format!("{host}{host}"), 400),
        (
            &format!("http://crane.example{}", served.path()),
            host.clone(),
            400,
        ),
        ("/", host.clone(), 404),
        ("/0123456789abcdef0123456789abcdef/", host.clone(), 404),
        (served.path(), "Host: crane.example\r\n".to_owned(), 403),
        (served.path(), String::new(), 400),
        (
            served.path(),
            format!("{host}Origin: http://crane.example\r\n"),
            403,
        ),
        (
            &format!("{}socket", served.path()),
            format!(
                "{host}Origin: http://crane.example\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
                 Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
            ),
            403,
        ),
    ] {
        let found = served.get(path, &headers).0;
        let holds = found == status || (status == 400 && found == 403);
        assert!(holds, "{path} {headers}: {found}");
    }
    // Invalid and overlong messages affect only their sender.
    let mut socket = served.socket().expect("opened");
    for text in ["", "{}", "{\"set\": 1}", "\"restart\" 1", "[[[["] {
        socket.send(Message::Text(text.into())).expect("sent");
    }
    let mut refusals = 0;
    while refusals < 5 {
        if let Message::Text(text) = socket.read().expect("a message") {
            let message: Value = serde_json::from_str(&text).expect("JSON");
            refusals += usize::from(message.get("refused").is_some());
        }
    }
    let _ = socket.send(Message::Text("1".repeat(1 << 16).into()));
    assert_eq!(served.own("").0, 200);
    let output = taut(
        &at,
        &[
            "view",
            "hoist",
            "--port",
            served.host().split(':').nth(1).expect("a port"),
        ],
    );
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{told}");
    let holds = told.contains("is in use") && told.contains("--port");
    assert!(holds, "{told}");
}

#[test]
fn runs_and_recordings_are_files_for_other_commands() {
    let _alone = alone();
    let at = folder("view-files");
    let served = Served::new(&at, &["gantry", "--set", "segments=4"]);
    let (status, text) = served.own("recording");
    assert_eq!(status, 409, "{}", String::from_utf8_lossy(&text));
    let mut socket = served.socket().expect("opened");
    let mut ask = |command: &str| socket.send(Message::Text(command.into())).expect("sent");
    ask(r#"{"record": true}"#);
    std::thread::sleep(Duration::from_secs(1));
    ask(r#"{"record": false}"#);
    let begun = Instant::now();
    let recording = loop {
        let (status, bytes) = served.own("recording");
        if status == 200 {
            break bytes;
        }
        assert!(begun.elapsed() < Duration::from_secs(10));
    };
    fs::write(at.join("run.tape"), recording).expect("writable");
    let table = taut(&at, &["replay", "run.tape", "--csv", "time,load.z"]);
    let lines = String::from_utf8_lossy(&table.stdout).lines().count();
    assert!(table.status.success() && lines > 40, "{lines}");
    let (status, run) = served.own("run.json");
    assert_eq!(status, 200);
    fs::write(at.join("run.json"), run).expect("writable");
    let resumed = taut(
        &at,
        &[
            "run",
            "--resume",
            "run.json",
            "--time",
            "1",
            "--hold-controls",
        ],
    );
    let holds = resumed.status.success();
    assert!(holds, "{}", String::from_utf8_lossy(&resumed.stderr));
}

/// Connections that send half of a header are closed; more of them than there is room for keep nobody out for long.
#[test]
fn half_requests_are_closed() {
    let _alone = alone();
    let at = folder("view-half");
    let served = Served::new(&at, &["hoist", "--set", "segments=3"]);
    let mut half: Vec<TcpStream> = Vec::new();
    for begin in ["GET / HTTP/1.1\r\nX", "G", ""] {
        for _ in 0..50 {
            let mut stream = TcpStream::connect(served.host()).expect("listens");
            let patience = Some(Duration::from_secs(40));
            stream.set_read_timeout(patience).expect("a time");
            stream.write_all(begin.as_bytes()).expect("sent");
            half.push(stream);
        }
    }
    let begun = Instant::now();
    assert_eq!(served.own("").0, 200);
    let waited = begun.elapsed();
    assert!(waited < Duration::from_secs(25), "{waited:?}");
    for stream in &mut half {
        let mut rest = Vec::new();
        // An answer that says so may come before the end.
        let closed = stream.read_to_end(&mut rest);
        assert!(rest.len() < 1000);
        closed.expect("closed in time");
    }
    // A viewer needs no place of those.
    let viewers: Vec<_> = (0..100).map(|_| served.socket().expect("opened")).collect();
    assert_eq!(served.own("").0, 200);
    drop(viewers);
}
