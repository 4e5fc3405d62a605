//! Writes Matrix Market files: 17 digits, so that reading them back gives the same bits.
//!
//! A symmetric matrix is written with all entries of its stored blocks, zeros among them, so that its pattern comes back
//! as well; sizes, groups and signs of the blocks stand in comments (see [`super::market`]). Lines are short enough for
//! readers with a fixed buffer, which the format allows 1024 characters.

use crate::files::{FileError, Output};
use flate2::{Compression, GzBuilder};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use taut_solver::SymBlockMatrix;

/// Most characters of a line of comments.
const WIDTH: usize = 100;

/// A comment with numbers, in as many lines as it needs.
fn list(out: &mut String, word: &str, items: impl Iterator<Item = String>) {
    let mut line = String::new();
    for item in items {
        if line.len() + item.len() >= WIDTH {
            let _ = writeln!(out, "{line}");
            line.clear();
        }
        if line.is_empty() {
            let _ = write!(line, "% {word}");
        }
        let _ = write!(line, " {item}");
    }
    if !line.is_empty() {
        let _ = writeln!(out, "{line}");
    }
}

fn head(banner: &str, comments: &[String]) -> String {
    let mut out = format!("%%MatrixMarket matrix {banner}\n");
    for comment in comments.iter().flat_map(|c| c.lines()) {
        let _ = writeln!(out, "% {comment}");
    }
    out
}

/// The lower triangle as text; `signs` may be empty. Columns in order.
pub fn symmetric(a: &SymBlockMatrix, signs: &[bool], comments: &[String]) -> String {
    let p = a.pattern();
    let mut entries = Vec::new();
    a.for_each_lower(|r, c, value| entries.push((c, r, value)));
    entries.sort_by_key(|&(c, r, _)| (c, r));
    let mut out = head("coordinate real symmetric", comments);
    if (0..p.blocks()).any(|i| p.size(i) != 1) {
        list(
            &mut out,
            "blocks",
            (0..p.blocks()).map(|i| p.size(i).to_string()),
        );
    }
    if p.groups().iter().any(|&g| g != 0) {
        list(&mut out, "groups", p.groups().iter().map(u32::to_string));
    }
    let sign = |&s: &bool| if s { "+" } else { "-" }.to_owned();
    list(&mut out, "signs", signs.iter().map(sign));
    put_entries(&mut out, [a.dim(); 2], &entries);
    out
}

/// Sizes and entries (column, row, value), in order.
fn put_entries(out: &mut String, [rows, columns]: [usize; 2], entries: &[(usize, usize, f64)]) {
    out.reserve(40 * entries.len());
    let _ = writeln!(out, "{rows} {columns} {}", entries.len());
    for (c, r, value) in entries {
        let _ = writeln!(out, "{} {} {value:.16e}", r + 1, c + 1);
    }
}

pub fn vector(v: &[f64], comments: &[String]) -> String {
    let mut out = head("array real general", comments);
    let _ = writeln!(out, "{} 1", v.len());
    for value in v {
        let _ = writeln!(out, "{value:.16e}");
    }
    out
}

/// Columns of equal length as an array, each number in the fewest digits that give the same bits.
pub fn array(columns: &[Vec<f64>], comments: &[String]) -> String {
    let mut out = head("array real general", comments);
    let _ = writeln!(
        out,
        "{} {}",
        columns.first().map_or(0, Vec::len),
        columns.len()
    );
    for value in columns.iter().flatten() {
        let _ = writeln!(out, "{value:e}");
    }
    out
}

/// Writes `text` to `folder/name.mtx`, or packed to `folder/name.mtx.gz`, and returns the path. What is packed is the
/// same in every run.
pub fn file(folder: &Path, name: &str, text: &str, gzip: bool) -> Result<PathBuf, FileError> {
    let path = folder.join(format!("{name}.mtx{}", if gzip { ".gz" } else { "" }));
    Output::open(&path)?.write(|out| {
        if !gzip {
            return out.write_all(text.as_bytes());
        }
        let mut packed = GzBuilder::new().write(out, Compression::default());
        packed.write_all(text.as_bytes())?;
        packed.finish().map(|_| ())
    })?;
    Ok(path)
}
