use super::*;

fn shared() -> Arc<Shared> {
    let save = Box::new(|_| Ok(Vec::new()));
    Shared::new((8021, "t".to_owned()), "crane".to_owned(), save).0
}

#[test]
fn only_the_own_page_may_ask() {
    let shared = shared();
    let target: Uri = "/t/".parse().expect("a target");
    let own = |host: &str, origin: Option<&str>| {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, host.parse().expect("a host"));
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, origin.parse().expect("an origin"));
        }
        shared.is_own(&target, &headers)
    };
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
    assert!(!shared.is_own(&target, &HeaderMap::new()));
}

#[test]
fn a_request_names_one_host() {
    let shared = shared();
    let own = |target: &str, names: &[(header::HeaderName, &str)]| {
        let mut headers = HeaderMap::new();
        for (name, value) in names {
            headers.append(name, value.parse().expect("a value"));
        }
        shared.is_own(&target.parse().expect("a target"), &headers)
    };
    let [here, there] = ["127.0.0.1:8021", "crane.example:8021"];
    let host = |name| (header::HOST, name);
    let page = (header::ORIGIN, "http://127.0.0.1:8021");
    assert!(own("http://127.0.0.1:8021/t/", &[host(here), page.clone()]));
    for (target, names) in [
        ("/t/", vec![host(here), host(there)]),
        ("/t/", vec![host(here), host(here)]),
        ("/t/", vec![host(here), page.clone(), page.clone()]),
        ("http://crane.example:8021/t/", vec![host(here)]),
        ("http://me@127.0.0.1:8021/t/", vec![host(here)]),
        ("http://127.0.0.1:8022/t/", vec![host(here)]),
    ] {
        assert!(!own(target, &names), "{target} {names:?}");
    }
}

/// A viewer that goes away leaves the controls that it was the last to set to other than zero.
#[test]
fn the_last_to_drive_a_control_leaves_it() {
    let shared = shared();
    let set = |viewer, control: &str, drive: Option<&str>, value| {
        let (control, drive) = (control.to_owned(), drive.map(str::to_owned));
        let command = Command::Set {
            control,
            drive,
            value,
        };
        shared.note(viewer, &command)
    };
    for (viewer, control, drive, value) in [
        (1, "hoist", Some("rope-1"), 1.0),
        (1, "hoist", None, 1.0),
        (1, "trolley", None, 1.0),
        (2, "trolley", None, 0.5),
        (1, "luff", None, 1.0),
        (1, "luff", None, 0.0),
    ] {
        assert!(set(viewer, control, drive, value));
    }
    let trolley = vec![("trolley".to_owned(), None)];
    assert_eq!(shared.left_by(1), [("hoist".to_owned(), None)]);
    assert_eq!(shared.left_by(2), trolley);
    assert_eq!(shared.left_by(2), []);
    let mut room = 0;
    while set(3, &format!("control-{room}"), None, 1.0) {
        room += 1;
    }
    assert_eq!(room, MAX_DRIVEN);
    assert!(set(3, "control-0", None, 2.0));
}
