//! Files for programs: JSON and CSV, `-` for standard output.
//!
//! A file is written beside its place and takes it when it is whole ([`Output`]): whatever ends the program or fills the
//! disk on the way, there is the old file or the new one. Devices and pipes are written as they are, and so is a file that
//! no other can replace.

mod part;
mod shown;

use part::Part;
use serde::Serialize;
pub use shown::line;
use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

/// A file that could not be written or read.
#[derive(Debug, thiserror::Error)]
#[error("cannot {doing} `{}`: {source}", path.display())]
pub struct FileError {
    pub path: PathBuf,
    /// Verb of the message: `read`, `write`, `replace` or `secure`.
    pub doing: &'static str,
    /// Why it failed.
    pub source: std::io::Error,
}

impl FileError {
    /// What a file's failure while `doing` something becomes.
    pub fn at(path: &Path, doing: &'static str) -> impl FnOnce(io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self {
            path,
            doing,
            source,
        }
    }
}

/// Prints a text for people to standard output, with its colours and bold type where they are seen and wanted: on a
/// terminal, unless `NO_COLOR` or `CLICOLOR=0` is set, or wherever `CLICOLOR_FORCE` is. A reader that has gone away is
/// not an error: it has read what it wanted. Control characters are escaped but for line ends and tabs.
pub fn print(text: &str) -> Result<(), FileError> {
    put(&mut anstream::stdout().lock(), &shown::text(text))
}

/// Writes a text as it is to a stream of the program's own.
fn put(out: &mut impl Write, text: &str) -> Result<(), FileError> {
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    heard(written).map_err(FileError::at(Path::new("-"), "write"))
}

/// A reader that has gone away has read what it wanted.
fn heard(written: io::Result<()>) -> io::Result<()> {
    match written {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}

/// Says something on standard error in one line ([`line()`]), after the program's name. Where that is closed or full there is nobody to be told.
pub fn complain(text: &str) {
    let _ = writeln!(io::stderr().lock(), "taut: {}", line(text));
}

/// Says on standard error what stops nothing, in one line ([`line()`]).
pub fn note(text: impl std::fmt::Display) {
    let _ = writeln!(io::stderr().lock(), "note: {}", line(&text.to_string()));
}

/// Makes a folder, with those above it.
pub fn make_folder(path: &Path) -> Result<(), FileError> {
    std::fs::create_dir_all(path).map_err(FileError::at(path, "write"))
}

/// Removes a file if there is one.
pub fn remove(path: &Path) -> Result<(), FileError> {
    match std::fs::remove_file(path) {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(FileError::at(path, "replace")(e)),
        _ => Ok(()),
    }
}

/// Most bytes of a text that is read: more is no scene, table or run, but a device or a mistake.
const MOST_TEXT: u64 = 1 << 30;

/// Reads a text, without the mark of the order of bytes that some editors put before it.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    let text = read_at_most(path, MOST_TEXT).map_err(FileError::at(path, "read"))?;
    match text.strip_prefix('\u{feff}') {
        Some(rest) => Ok(rest.to_owned()),
        None => Ok(text),
    }
}

fn read_at_most(path: &Path, most: u64) -> std::io::Result<String> {
    let mut text = String::new();
    let file = std::fs::File::open(path)?;
    file.take(most + 1).read_to_string(&mut text)?;
    if text.len() as u64 > most {
        let message = format!("it has more than {most} bytes, which no text of this kind has");
        return Err(std::io::Error::new(
            std::io::ErrorKind::FileTooLarge,
            message,
        ));
    }
    Ok(text)
}

/// A place for results, found writable before the work that they come from.
#[derive(Debug)]
pub struct Output {
    /// As it was given.
    path: PathBuf,
    target: Target,
}

#[derive(Debug)]
enum Target {
    Stdout,
    /// A device or a pipe.
    Device(File),
    /// A file, by a path without links, there already or not.
    File(PathBuf),
}

impl Output {
    /// Finds out whether `path` can be written, `-` for standard output; makes its folder. A file stays as it is until
    /// [`write`](Self::write), and is not made here.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        Ok(Self {
            target: Target::of(path).map_err(FileError::at(path, "write"))?,
            path: path.to_owned(),
        })
    }

    /// The path as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// True for standard output, given as `-` or as a path that leads there.
    pub fn is_stdout(&self) -> bool {
        matches!(self.target, Target::Stdout)
    }

    pub fn write(
        &self,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), FileError> {
        let mut writing = self.begin()?;
        writing.add(write);
        writing.finish()
    }

    /// Writes a text.
    pub fn text(&self, text: &str) -> Result<(), FileError> {
        self.write(|out| out.write_all(text.as_bytes()))
    }

    /// Writes a value as JSON: see [`write_json`].
    pub fn json(&self, value: &impl Serialize) -> Result<(), FileError> {
        self.write(|out| {
            serde_json::to_writer_pretty(&mut *out, value)?;
            out.write_all(b"\n")
        })
    }

    /// Begins to write what comes bit by bit.
    pub fn begin(&self) -> Result<Writing, FileError> {
        let failed = |source| self.error(source);
        let (to, part): (Box<dyn Write>, _) = match &self.target {
            Target::Stdout => (Box::new(io::stdout()), None),
            Target::Device(file) => (Box::new(file.try_clone().map_err(failed)?), None),
            Target::File(path) => {
                let part = Part::create(path).map_err(failed)?;
                (Box::new(part.file.try_clone().map_err(failed)?), Some(part))
            }
        };
        Ok(Writing {
            path: self.path.clone(),
            to: BufWriter::with_capacity(1 << 16, to),
            part,
            failure: None,
        })
    }

    fn error(&self, source: io::Error) -> FileError {
        FileError::at(&self.path, "write")(source)
    }
}

impl Target {
    fn of(path: &Path) -> io::Result<Self> {
        if path == Path::new("-") {
            return Ok(Self::Stdout);
        }
        if let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
            fs::create_dir_all(folder)?;
        }
        match fs::metadata(path) {
            Ok(there) if is_stdout(&there) => Ok(Self::Stdout),
            Ok(there) => {
                // Refuses folders and what may not be written.
                let file = File::options().append(true).open(path)?;
                if there.is_file() && !is_stderr(&there) {
                    Self::file(path.canonicalize()?)
                } else {
                    Ok(Self::Device(file))
                }
            }
            Err(e) if e.kind() == ErrorKind::NotFound => Self::file(new_file(path)?),
            Err(e) => Err(e),
        }
    }

    /// A file that a new one can be laid beside.
    fn file(path: PathBuf) -> io::Result<Self> {
        Part::create(&path)?;
        Ok(Self::File(path))
    }
}

/// True if `file` is the pipe or the file that `stream` of this program is connected to. False for
/// character devices: a terminal or `/dev/null` may be opened a second time.
#[cfg(unix)]
fn is_stream(file: &fs::Metadata, stream: &impl std::os::fd::AsFd) -> bool {
    use std::os::unix::fs::{FileTypeExt, MetadataExt};
    if file.file_type().is_char_device() {
        return false;
    }
    let own = stream.as_fd().try_clone_to_owned().map(File::from);
    let own = own.and_then(|own| own.metadata());
    let place = |m: &fs::Metadata| (m.dev(), m.ino());
    own.is_ok_and(|own| place(&own) == place(file))
}

#[cfg(not(unix))]
fn is_stream<T>(_: &fs::Metadata, _: &T) -> bool {
    false
}

fn is_stdout(file: &fs::Metadata) -> bool {
    is_stream(file, &io::stdout())
}

fn is_stderr(file: &fs::Metadata) -> bool {
    is_stream(file, &io::stderr())
}

/// The path without links of a file that is not there.
fn new_file(path: &Path) -> io::Result<PathBuf> {
    // A link to nowhere: what it names is made.
    if let Ok(target) = fs::read_link(path) {
        return new_file(&path.with_file_name("").join(target));
    }
    let name = path.file_name().ok_or(ErrorKind::InvalidFilename)?;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
    Ok(folder.unwrap_or(Path::new(".")).canonicalize()?.join(name))
}

/// An [`Output`] that is being written. Dropped, it leaves a file as it was.
pub struct Writing {
    path: PathBuf,
    to: BufWriter<Box<dyn Write>>,
    part: Option<Part>,
    /// The first failure: nothing is written after it.
    failure: Option<io::Error>,
}

impl Writing {
    /// Writes on; a failure is reported by [`finish`](Self::finish).
    pub fn add(&mut self, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) {
        if self.failure.is_none() {
            self.failure = write(&mut self.to).err();
        }
    }

    /// Ends it: only now the file is there.
    ///
    /// # Errors
    /// [`FileError`] of this and of all before; a file is then what it was before, unless the error
    /// says that it is written and only its folder was not synced.
    pub fn finish(mut self) -> Result<(), FileError> {
        let written = self.flushed();
        let done = match &mut self.part {
            None => heard(written),
            Some(part) => written.and_then(|()| part.take_place()),
        };
        self.reported(done)?;
        self.secured()
    }

    /// Ends what is worth something without its end, too: what was written before a failure takes the place.
    pub fn keep(mut self) -> Result<(), FileError> {
        let written = self.flushed();
        let Some(part) = &mut self.part else {
            return self.reported(heard(written));
        };
        let placed = part.take_place();
        let secured = match &placed {
            Ok(()) => self.secured(),
            Err(_) => Ok(()),
        };
        self.reported(written.and(placed))?;
        secured
    }

    /// The file stands; makes it outlast a failure of the power.
    fn secured(&self) -> Result<(), FileError> {
        let done = self.part.as_ref().map_or(Ok(()), Part::secure);
        done.map_err(|e| not_secured(&self.path, &e))
    }

    fn flushed(&mut self) -> io::Result<()> {
        self.failure.take().map_or_else(|| self.to.flush(), Err)
    }

    fn reported(&self, done: io::Result<()>) -> Result<(), FileError> {
        done.map_err(FileError::at(&self.path, "write"))
    }
}

/// The error of a file that stands, whose folder was not synced.
fn not_secured(path: &Path, e: &io::Error) -> FileError {
    let message = format!(
        "it is written, but its folder could not be synced ({e}): a failure of the power may undo it"
    );
    FileError::at(path, "secure")(io::Error::new(e.kind(), message))
}

/// Finds out whether the paths of these options can be written, before the work that their content comes from.
pub fn open<const N: usize>(
    options: [(&'static str, Option<&Path>); N],
    read: &[&Path],
) -> Result<[Option<Output>; N], FileError> {
    let mut outputs = [const { None }; N];
    let read: Vec<PathBuf> = read.iter().filter_map(|p| p.canonicalize().ok()).collect();
    for (k, (option, path)) in options.into_iter().enumerate() {
        let Some(path) = path else { continue };
        let output = Output::open(path)?;
        let refused =
            |message: String| Err(output.error(io::Error::new(ErrorKind::InvalidInput, message)));
        let same =
            |other: &Option<Output>| match (other.as_ref().map(|o| &o.target), &output.target) {
                (Some(Target::Stdout), Target::Stdout) => true,
                (Some(Target::File(other)), Target::File(place)) => other == place,
                _ => false,
            };
        if let Some(other) = outputs[..k].iter().position(same) {
            let other = options[other].0;
            return refused(if output.is_stdout() {
                format!(
                    "`{other}` and `{option}` cannot share standard output: give all but one a file"
                )
            } else {
                format!("`{other}` and `{option}` cannot share a file: give each its own")
            });
        }
        if matches!(&output.target, Target::File(place) if read.contains(place)) {
            return refused(format!("it is read: give `{option}` a file of its own"));
        }
        outputs[k] = Some(output);
    }
    Ok(outputs)
}

/// True if both paths lead to one file, there or not.
pub fn is_same(one: &Path, other: &Path) -> bool {
    let place = |path: &Path| path.canonicalize().or_else(|_| new_file(path));
    // Where the folder is not there either it holds no links.
    let place = |path: &Path| place(path).or_else(|_| std::path::absolute(path)).ok();
    place(one).is_some_and(|one| place(other) == Some(one))
}

/// Writes text to `path`, making its folder, or to standard output for `-`.
pub fn write_text(path: &Path, text: &str) -> Result<(), FileError> {
    Output::open(path)?.text(text)
}

/// Writes bytes to `path`, making its folder.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    Output::open(path)?.write(|out| out.write_all(bytes))
}

/// Writes a value as JSON; numbers that are not finite become null, as what is not there does. The rows say which it
/// is: a check by its `reached`, a row of a solver by its `error` or `failure`, the reason why it has no numbers,
/// without which null is what was not measured.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), FileError> {
    Output::open(path)?.json(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_stands_is_not_said_to_be_unwritten() {
        let error = not_secured(Path::new("r.json"), &ErrorKind::QuotaExceeded.into());
        let text = error.to_string();
        let says = text.starts_with("cannot secure `r.json`: it is written");
        assert!(says, "{text}");
        assert_eq!(error.source.kind(), ErrorKind::QuotaExceeded);
    }

    #[test]
    fn a_text_begins_behind_the_mark_of_an_editor() {
        let path = std::env::temp_dir().join(format!("taut-mark-{}", std::process::id()));
        fs::write(&path, "\u{feff}{}").expect("writable");
        assert_eq!(read_text(&path).expect("readable"), "{}");
        fs::remove_file(&path).expect("removed");
    }

    #[test]
    fn a_text_without_end_is_refused() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
        let all = read_at_most(&path, MOST_TEXT).expect("readable");
        let length = all.len() as u64;
        assert_eq!(read_at_most(&path, length).expect("short enough"), all);
        let error = read_at_most(&path, length - 1).expect_err("too long");
        assert!(error.to_string().contains("more than"), "{error}");
    }
}
