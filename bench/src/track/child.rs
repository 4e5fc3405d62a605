//! Programs that are run for a limited time, and what they say line by line.

use std::io::{self, BufRead, BufReader, Read};
use std::process::{Child, ExitStatus};
use std::sync::mpsc::{self, Receiver};
use std::time::{Duration, Instant};

/// Most bytes of a line: longer ones are cut.
const MOST: u64 = 1 << 16;

/// Lines that are kept until they are asked for; whoever writes more waits.
const KEPT: usize = 16;

/// Waits for a program to end. `None` if it takes longer than `limit` and is ended.
pub(super) fn wait(child: &mut Child, limit: Duration) -> io::Result<Option<ExitStatus>> {
    let start = Instant::now();
    loop {
        match child.try_wait()? {
            Some(status) => return Ok(Some(status)),
            None if start.elapsed() > limit => {
                end(child);
                return Ok(None);
            }
            None => std::thread::sleep(Duration::from_millis(2)),
        }
    }
}

/// Ends a program, whether it still runs or not.
pub(super) fn end(child: &mut Child) {
    let _ = child.kill();
    let _ = child.wait();
}

/// The next line, without its end and the blanks around it; none at the end of the stream.
pub(super) fn line(from: &mut impl BufRead) -> io::Result<Option<String>> {
    let mut bytes = Vec::new();
    let read = from.take(MOST).read_until(b'\n', &mut bytes)?;
    let text = String::from_utf8_lossy(&bytes);
    Ok((read > 0).then(|| text.trim().to_owned()))
}

/// The lines of a stream, read in a thread of its own so that waiting for one can end.
pub(super) fn lines(stream: impl Read + Send + 'static) -> Receiver<String> {
    let (to, from) = mpsc::sync_channel(KEPT);
    std::thread::spawn(move || {
        let mut stream = BufReader::new(stream);
        while let Ok(Some(line)) = line(&mut stream) {
            if to.send(line).is_err() {
                return;
            }
        }
    });
    from
}

/// The last line of a stream that is not empty, once the stream has ended.
pub(super) fn last_line(stream: impl Read + Send + 'static) -> Receiver<String> {
    let (to, from) = mpsc::sync_channel(1);
    std::thread::spawn(move || {
        let (mut stream, mut last) = (BufReader::new(stream), String::new());
        while let Ok(Some(line)) = line(&mut stream) {
            if !line.is_empty() {
                last = line;
            }
        }
        let _ = to.send(last);
    });
    from
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_without_lines_is_cut_into_some() {
        let mut endless = BufReader::new(io::repeat(b'a'));
        let cut = line(&mut endless).unwrap().unwrap();
        assert_eq!(cut.len() as u64, MOST);
        let mut two = " one \n\ntwo".as_bytes();
        let read: Vec<_> = std::iter::from_fn(|| line(&mut two).unwrap()).collect();
        assert_eq!(read, ["one", "", "two"]);
    }

    #[test]
    fn the_last_line_is_what_was_said_last() {
        let said = last_line("first\nlast\n\n".as_bytes());
        assert_eq!(said.recv().unwrap(), "last");
        let said = lines("first\nlast".as_bytes());
        assert_eq!(said.iter().collect::<Vec<_>>(), ["first", "last"]);
    }
}
