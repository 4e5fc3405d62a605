//! The file that is being written, beside the one whose place it takes.
//!
//! It is called `.NAME.taut-PID-N.part`, and its program holds a lock on it, which ends with the program however that ends.
//! A part without such a lock is what a killed program has left. It may be all that there is of a recording, so it stays until
//! another file takes the same place.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Longest name that is a part of another one: file systems take 255 bytes.
const LONGEST: usize = 200;

/// Marker before the process id in the name of a part.
const OF_PROGRAM: &str = "taut-";
const END: &str = ".part";

/// A temporary file beside its place. Dropping it removes it unless it has taken the place.
#[derive(Debug)]
pub(super) struct Part {
    pub(super) file: File,
    at: PathBuf,
    place: PathBuf,
}

/// Common prefix of the names of all parts of `place`.
fn beginning(place: &Path) -> OsString {
    let name = place.file_name().unwrap_or_default();
    let mut all = OsString::from(".");
    if name.len() <= LONGEST {
        all.push(name);
        all.push(".");
    }
    all.push(OF_PROGRAM);
    all
}

impl Part {
    pub(super) fn beside(place: &Path) -> io::Result<Self> {
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
            });
        }
    }

    /// Takes the place, with the permissions of what was there; then removes what killed programs have left of it.
    pub(super) fn take_place(&self) -> io::Result<()> {
        if let Ok(there) = fs::metadata(&self.place) {
            self.file.set_permissions(there.permissions())?;
        }
        self.file.sync_all()?;
        fs::rename(&self.at, &self.place)?;
        let folder = self.place.parent().unwrap_or(Path::new("."));
        sync_folder(folder)?;
        remove_left(folder, &beginning(&self.place));
        Ok(())
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        // Nothing where it has taken its place.
        let _ = fs::remove_file(&self.at);
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
        if is_file && !is_running(program) && is_free() {
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

/// True if `/proc` lists the process `program`. A running process that has just made its part may
/// not hold the lock yet.
fn is_running(program: u32) -> bool {
    Path::new("/proc").join(program.to_string()).exists()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::Output;

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
        assert!(
            left.iter().all(|name| at.join(name).exists()),
            "{:?}",
            names(&at)
        );
        let writing = output.begin().expect("begun");
        drop(writing);
        assert!(
            left.iter().all(|name| at.join(name).exists()),
            "{:?}",
            names(&at)
        );
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
        let short = Part::beside(&at.join("a.json")).expect("begun");
        assert!(names(&at)[0].starts_with(&format!(".a.json.taut-{}-", std::process::id())));
        drop(short);
        let long = "x".repeat(250);
        let output = Output::open(&at.join(&long)).expect("writable");
        output.write(|out| out.write_all(b"1")).expect("written");
        assert_eq!(names(&at), [long]);
        fs::remove_dir_all(&at).expect("removed");
    }
}
