//! The file that is being written, beside the one whose place it takes.
//!
//! It is called `.NAME.taut-PID-N.part`, with a hash for the rest of a NAME over 200 bytes, and its program holds a lock on it, which ends with the program however that ends.
//! A part without such a lock is what a killed program has left. It may be all that there is of a recording, so it stays until
//! another file takes the same place.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// Longest name that is a part of another one: file systems take 255 bytes.
const LONGEST: usize = 200;

/// Marker before the process id in the name of a part.
const OF_PROGRAM: &str = "taut-";
const END: &str = ".part";

/// A temporary file beside its place. Dropping it removes it unless it has taken the place, or the
/// place was spoilt in the attempt.
#[derive(Debug)]
pub(super) struct Part {
    pub(super) file: File,
    at: PathBuf,
    place: PathBuf,
    /// Set where the place may have been spoilt: dropping then leaves the part.
    stays: bool,
}

/// Common prefix of the names of all parts of `place`, and of no other place's.
fn beginning(place: &Path) -> OsString {
    let name = place.file_name().unwrap_or_default();
    let mut all = OsString::from(".");
    if name.len() <= LONGEST {
        all.push(name);
    } else {
        all.push(format!("{:016x}", fnv1a(name.as_encoded_bytes())));
    }
    all.push(".");
    all.push(OF_PROGRAM);
    all
}

/// FNV-1a: stays the same from version to version of the standard library.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

impl Part {
    pub(super) fn create(place: &Path) -> io::Result<Self> {
        static PARTS: AtomicUsize = AtomicUsize::new(0);
        loop {
            let number = PARTS.fetch_add(1, Ordering::Relaxed);
            let mut name = beginning(place);
            name.push(format!("{}-{number}{END}", std::process::id()));
            let at = place.with_file_name(name);
            let file = match File::create_new(&at) {
                // One of a program that was killed.
                Err(e) if e.kind() == ErrorKind::AlreadyExists => continue,
                file => file?,
            };
            // Where files cannot be locked no part is taken for one that was left.
            let _ = file.try_lock();
            return Ok(Self {
                file,
                at,
                place: place.to_owned(),
                stays: false,
            });
        }
    }

    /// Takes the place, with the permissions of what was there. A file that cannot be replaced, as
    /// one that is mounted by itself into a container, is written over.
    pub(super) fn take_place(&mut self) -> io::Result<()> {
        let there = fs::metadata(&self.place);
        if let Ok(there) = &there {
            self.file.set_permissions(there.permissions())?;
        }
        self.file.sync_all()?;
        match fs::rename(&self.at, &self.place) {
            Err(_) if there.is_ok_and(|there| there.is_file()) => self.write_over(),
            done => done,
        }
    }

    /// Copies itself into the place. Where that fails, all of it stays beside.
    fn write_over(&mut self) -> io::Result<()> {
        let copied = File::open(&self.at).and_then(|mut from| {
            let mut to = File::options()
                .write(true)
                .truncate(true)
                .open(&self.place)?;
            io::copy(&mut from, &mut to)?;
            to.sync_all()
        });
        copied.map_err(|e| {
            self.stays = true;
            let message = format!("{e}: all of it is in `{}`", self.at.display());
            io::Error::new(e.kind(), message)
        })
    }

    /// After it has taken the place: makes that outlast a failure of the power, then removes what
    /// killed programs have left of it. On error the file stands, and so does what they have left.
    pub(super) fn secure(&self) -> io::Result<()> {
        let folder = self.place.parent().unwrap_or(Path::new("."));
        sync_folder(folder)?;
        remove_left(folder, &beginning(&self.place));
        Ok(())
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        if !self.stays {
            // Nothing where it has taken its place.
            let _ = fs::remove_file(&self.at);
        }
    }
}

/// The names in a folder outlast a failure of the power from now on.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> io::Result<()> {
    // A folder that may not be read, or a file system that does not know of this.
    let Ok(folder) = File::open(folder) else {
        return Ok(());
    };
    match folder.sync_all() {
        Err(e) if matches!(e.kind(), ErrorKind::InvalidInput | ErrorKind::Unsupported) => Ok(()),
        done => done,
    }
}

#[cfg(not(unix))]
fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}

/// Removes the parts whose names begin so and which no program is writing. What cannot be removed stays.
fn remove_left(folder: &Path, beginning: &OsStr) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let rest = name
            .as_encoded_bytes()
            .strip_prefix(beginning.as_encoded_bytes());
        let Some(program) = rest.and_then(program) else {
            continue;
        };
        // A pipe of such a name would be waited for.
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        let path = entry.path();
        let is_free = || File::open(&path).is_ok_and(|file| file.try_lock().is_ok());
        let is_old = || entry.metadata().is_ok_and(|part| is_old(&part));
        if is_file && (!is_running(program) || is_old()) && is_free() {
            let _ = fs::remove_file(path);
        }
    }
}

/// The first number of `PID-N.part`.
fn program(rest: &[u8]) -> Option<u32> {
    let numbers = std::str::from_utf8(rest.strip_suffix(END.as_bytes())?).ok()?;
    let (program, number) = numbers.split_once('-')?;
    number.parse::<usize>().ok()?;
    program.parse().ok()
}

/// Age from which on a part without a lock belongs to nobody, whatever process has its number now:
/// in a container that is often the same one again.
const OLD: Duration = Duration::from_secs(60);

fn is_old(part: &fs::Metadata) -> bool {
    let written = part
        .modified()
        .and_then(|at| at.elapsed().map_err(io::Error::other));
    written.is_ok_and(|age| age > OLD)
}

/// True if `/proc` lists the process `program`, and not as a zombie. A running process that has just
/// made its part may not hold the lock yet.
fn is_running(program: u32) -> bool {
    let path = Path::new("/proc").join(program.to_string()).join("stat");
    // The state follows the name in parentheses, which may hold others.
    let Ok(stat) = fs::read_to_string(path) else {
        return false;
    };
    let state = stat.rsplit(')').next().map(str::trim_start);
    !state.is_some_and(|state| state.starts_with(['Z', 'X']))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::Output;
    use std::io::Write;

    fn folder(name: &str) -> PathBuf {
        let name = format!("taut-part-{name}-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).expect("a folder");
        folder
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("readable");
        let names = entries.map(|e| e.expect("an entry").file_name().into_string());
        let mut names: Vec<String> = names.map(|name| name.expect("text")).collect();
        names.sort();
        names
    }

    #[test]
    fn a_whole_file_removes_what_killed_programs_left_of_it_and_nothing_else() {
        let at = folder("left");
        let left = [
            ".r.tape.taut-4194304-1.part",
            ".r.tape.taut-4194305-22.part",
        ];
        let others = [
            ".other.tape.taut-4194305-1.part",
            ".r.tape.taut-4194305-.part",
            ".r.tape.taut-4194305-1-2.part",
            ".r.tape.taut-4194305-1.part.txt",
            ".r.tape.taut-me-1.part",
            "r.tape.taut-4194305-1.part",
        ];
        for name in left.iter().chain(&others) {
            fs::write(at.join(name), b"left").expect("writable");
        }
        // A part that its writer still locks.
        let held = at.join(".r.tape.taut-4194305-3.part");
        let held_file = File::create(&held).expect("writable");
        held_file.try_lock().expect("locked");
        let output = Output::open(&at.join("r.tape")).expect("writable");
        let all_hold = left.iter().all(|name| at.join(name).exists());
        assert!(all_hold, "{:?}", names(&at));
        let writing = output.begin().expect("begun");
        drop(writing);
        let all_hold = left.iter().all(|name| at.join(name).exists());
        assert!(all_hold, "{:?}", names(&at));
        output
            .write(|out| out.write_all(b"whole"))
            .expect("written");
        assert!(held.exists(), "{:?}", names(&at));
        drop(held_file);
        let mut expected: Vec<&str> = others.to_vec();
        expected.extend([".r.tape.taut-4194305-3.part", "r.tape"]);
        expected.sort_unstable();
        assert_eq!(names(&at), expected);
        output
            .write(|out| out.write_all(b"again"))
            .expect("written");
        assert!(!held.exists());
        assert_eq!(fs::read(at.join("r.tape")).expect("there"), b"again");
        fs::remove_dir_all(&at).expect("removed");
    }

    #[test]
    fn a_part_is_named_after_its_file_as_far_as_names_go() {
        let at = folder("names");
        let short = Part::create(&at.join("a.json")).expect("begun");
        assert!(names(&at)[0].starts_with(&format!(".a.json.taut-{}-", std::process::id())));
        drop(short);
        let long = "x".repeat(250);
        let output = Output::open(&at.join(&long)).expect("writable");
        output.write(|out| out.write_all(b"1")).expect("written");
        assert_eq!(names(&at), [long]);
        fs::remove_dir_all(&at).expect("removed");
    }

    /// A process of the number is running, here this one: the part is old, and nobody holds it.
    #[test]
    fn a_part_is_no_younger_for_a_process_of_its_number() {
        let at = folder("number");
        let part = |n: u32| at.join(format!(".r.tape.taut-{}-{n}.part", std::process::id()));
        let [young, old, held] = [900_001, 900_002, 900_003].map(part);
        let long_ago = std::time::SystemTime::now() - 2 * OLD;
        let mut files = Vec::new();
        for path in [&young, &old, &held] {
            let file = File::create_new(path).expect("writable");
            if *path != young {
                file.set_modified(long_ago).expect("dated");
            }
            files.push(file);
        }
        files[2].try_lock().expect("locked");
        let output = Output::open(&at.join("r.tape")).expect("writable");
        output
            .write(|out| out.write_all(b"whole"))
            .expect("written");
        assert!(young.exists() && held.exists(), "{:?}", names(&at));
        assert!(!old.exists(), "{:?}", names(&at));
        fs::remove_dir_all(&at).expect("removed");
    }

    #[test]
    fn a_file_that_cannot_be_replaced_is_written_over() {
        let at = folder("over");
        let place = at.join("r.json");
        fs::write(&place, b"an old one that is longer").expect("writable");
        let mut part = Part::create(&place).expect("begun");
        (&part.file).write_all(b"new").expect("written");
        part.write_over().expect("written over");
        drop(part);
        assert_eq!(fs::read(&place).expect("there"), b"new");
        assert_eq!(names(&at), ["r.json"]);
        // Where even that fails nothing is lost.
        let mut part = Part::create(&at.join("gone.json")).expect("begun");
        let error = part.write_over().expect_err("no such file");
        assert_eq!(error.kind(), ErrorKind::NotFound);
        let left = part.at.display().to_string();
        drop(part);
        assert!(error.to_string().contains(&left) && Path::new(&left).exists());
        fs::remove_dir_all(&at).expect("removed");
    }

    #[test]
    fn long_names_share_no_parts() {
        let at = folder("long");
        let [a, b] = ["a", "b"].map(|end| "x".repeat(250) + end);
        let left = |name: &str| {
            let mut part = beginning(&at.join(name));
            part.push("4194305-1.part");
            at.join(part)
        };
        for name in [&a, &b] {
            fs::write(left(name), b"left").expect("writable");
        }
        assert_ne!(left(&a), left(&b));
        let output = Output::open(&at.join(&a)).expect("writable");
        output.write(|out| out.write_all(b"1")).expect("written");
        assert!(!left(&a).exists() && left(&b).exists(), "{:?}", names(&at));
        // The hash is FNV-1a of 64 bits for ever: parts of other versions are found.
        assert_eq!(fnv1a(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a(b"foobar"), 0x8594_4171_f739_67e8);
        fs::remove_dir_all(&at).expect("removed");
    }
}
