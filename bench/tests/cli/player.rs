use crate::browser::chromium;
use crate::replay::named;
use crate::*;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};

/// Holds the page's load open, for it is then that the browser tells what it has: until the script is done.
fn hold() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = listener.local_addr().expect("a port").port();
    std::thread::spawn(move || {
        let mut held: Vec<TcpStream> = Vec::new();
        for stream in listener.incoming() {
            let Ok(mut stream) = stream else { break };
            let mut begin = [0; 9];
            if stream.read_exact(&mut begin).is_ok() && begin == *b"GET /done" {
                let _ = stream.write_all(b"HTTP/1.1 204 done\r\n\r\n");
                break;
            }
            held.push(stream);
        }
    });
    port
}

/// Runs `script` in a page in a browser with extra `options`; returns the object `found` that it
/// fills.
fn found(at: &At, page: &str, script: &str, options: &[&str]) -> Option<Value> {
    let port = hold();
    let text = at.read(page);
    let (text, end) = text.rsplit_once("</body>").expect("a body");
    let script = format!(
        "<script>
        new Image().src = 'http://127.0.0.1:{port}/held';
        const wait = (ms) => new Promise((done) => setTimeout(done, ms));
        const press = (key, on = document.body) => on.dispatchEvent(new KeyboardEvent('keydown', {{ key, bubbles: true }}));
        (async () => {{
          const found = {{}};
          try {{ await replay.ready; {script} }} catch (e) {{ found.error = String(e.stack); }}
          const told = document.createElement('pre');
          told.textContent = 'FOUND' + encodeURIComponent(JSON.stringify(found)) + 'FOUND';
          document.body.append(told);
          await fetch('http://127.0.0.1:{port}/done', {{ mode: 'no-cors' }});
        }})();
        </script></body>"
    );
    let path = at.join("looked-at.html");
    fs::write(&path, format!("{text}{script}{end}")).expect("writable");
    let dom = chromium(&path, &at.join("profile"), options)?;
    // The last but one is in the script itself.
    let json = dom.rsplit("FOUND").nth(1).expect("told");
    let json = percent_decoded(json);
    let found: Value = serde_json::from_str(&json).expect("JSON");
    assert!(found["error"].is_null(), "{}", found["error"]);
    Some(found)
}

fn percent_decoded(text: &str) -> String {
    let (mut bytes, mut rest) = (Vec::new(), text.as_bytes());
    while let [first, others @ ..] = rest {
        rest = others;
        match (first, others) {
            (b'%', [a, b, after @ ..]) => {
                let digits = [*a, *b];
                let digits = std::str::from_utf8(&digits).expect("ASCII");
                bytes.push(u8::from_str_radix(digits, 16).expect("hexadecimal"));
                rest = after;
            }
            _ => bytes.push(*first),
        }
    }
    String::from_utf8(bytes).expect("UTF-8")
}

/// Script: uses the page as a reader would and notes its state.
const USED: &str = include_str!("texts/used.js");

/// Played with the software renderer, at 30 frames a second and more, by keys, on 400 pixels.
#[test]
fn a_browser_plays_recordings() {
    let at = folder("player");
    at.good("run hoist --set segments=100 --set seed=1 --set move_x=1 --time 6 --record a.tape");
    at.good("replay a.tape --html a.html");
    let Some(found) = found(&at, "a.html", USED, &["--window-size=400,800"]) else {
        return;
    };
    let number = |name: &str| {
        found[name]
            .as_f64()
            .unwrap_or_else(|| panic!("{name}: {found}"))
    };
    let holds = number("width") == 400.0 && number("overflow") <= 0.0 && number("narrow") > 300.0;
    assert!(holds, "{found}");
    let holds = number("colours") > 20.0 && number("plots") >= 4.0;
    assert!(holds, "{found}");
    assert!((number("step") - 1.0 / 60.0).abs() < 1e-6, "{found}");
    assert!(number("home") == 0.0 && number("end") == 0.0, "{found}");
    assert!(number("turned") != 0.0 && number("zoomed") < 1.0, "{found}");
    let holds = number("scrubbed") == 2.0 && number("colour") == 2.0;
    assert!(holds, "{found}");
    let says = found["unit"].as_str();
    let says = says.is_some_and(|unit| unit.ends_with("N m"));
    assert!(says, "{found}");
    let holds = found["playing"] == true && found["paused"] == true;
    assert!(holds, "{found}");
    assert!(number("played") > 1.0, "{found}");
    let rates = found["rates"].as_array();
    let rates = rates.expect("a list").iter().filter_map(Value::as_f64);
    let best = rates.fold(0.0, f64::max);
    assert!(best >= 30.0, "{found}");
}

/// Two runs side by side, in the dark, with the distance of their loads.
#[test]
fn a_browser_compares_recordings() {
    let at = folder("player-two");
    for (name, segments) in [("a", 12), ("b", 6)] {
        at.good(format!(
            "run hoist --set segments={segments} --set move_x=1 --time 2 --record {name}.tape"
        ));
    }
    at.good("replay a.tape --against b.tape --html both.html");
    let last = |name: &str| -> Vec<f64> {
        let table = at.good(format!("replay {name}.tape --csv load_x,load_y,load_z"));
        let line = table.lines().last().expect("a line");
        line.split(',')
            .map(|x| x.parse().expect("a number"))
            .collect()
    };
    let squares = last("a").into_iter();
    let squares = squares.zip(last("b")).map(|(a, b)| (a - b) * (a - b));
    let apart = 1e3 * squares.sum::<f64>().sqrt();
    assert!(apart > 1e-3, "{apart}");
    let script = "
        press('End');
        replay.show();
        found.told = document.getElementById('told').textContent;
        found.views = document.querySelectorAll('.view canvas').length;
        found.plots = [...document.querySelectorAll('.plot h2')].map((title) => title.textContent);
        found.back = getComputedStyle(document.body).backgroundColor;
        const canvas = document.querySelector('.view canvas');
        found.corner = [...canvas.getContext('2d').getImageData(1, 1, 1, 1).data];";
    let dark = ["--blink-settings=preferredColorScheme=0"];
    let Some(found) = found(&at, "both.html", script, &dark) else {
        return;
    };
    assert_eq!(found["views"], 2, "{found}");
    assert_eq!(found["back"], "rgb(22, 22, 22)", "{found}");
    assert_eq!(
        found["corner"],
        serde_json::json!([22, 22, 22, 255]),
        "{found}"
    );
    let plots = found["plots"].to_string();
    assert!(plots.contains("Distance of the loads (mm)"), "{plots}");
    let told = found["told"].as_str().expect("a text");
    let mut shown = told.rsplit("loads apart by ");
    let shown = shown.next().and_then(|text| text.split(' ').next());
    let shown = shown.and_then(|x| x.parse().ok());
    let shown: f64 = shown.unwrap_or_else(|| panic!("{told}"));
    assert!((shown - apart).abs() <= 0.06 * apart, "{told}: {apart}");
}

/// Names that hold HTML are text in the page that a browser makes of it; a run of no steps is told.
#[test]
fn a_browser_shows_names_as_text() {
    let at = folder("player-names");
    let name = "</script><img src=x onerror=\\\"document.title='broken'\\\"><b>&amp;";
    at.write("names.toml", named(name));
    at.good("run names.toml --time 0.2 --record n.tape");
    at.good("replay n.tape --html n.html");
    let script = "
        found.title = document.title;
        found.bold = document.querySelectorAll('b, img').length;
        found.heading = document.querySelector('.view h2').textContent;
        found.event = document.querySelector('#events button')?.textContent;";
    let Some(found) = found(&at, "n.html", script, &[]) else {
        return;
    };
    assert_eq!(
        (found["title"].as_str(), found["bold"].as_u64()),
        (Some("n.tape"), Some(0)),
        "{found}"
    );
    for place in ["heading", "event"] {
        let text = found[place].as_str().expect("a text");
        assert!(text.contains("</script><img src=x"), "{found}");
    }
}
