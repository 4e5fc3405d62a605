//! Reads Matrix Market files, plain or compressed by gzip.
//!
//! The format is that of Boisvert, Pozo and Remington, *The Matrix Market Exchange Formats* (1996): a banner, comments, a
//! line of sizes, then one entry a line. Read are real and integer matrices, as coordinates or arrays, general or
//! symmetric; entries at the same place are added, in the order of the file. Comments and blank lines may stand
//! anywhere. Complex, skew-symmetric and Hermitian matrices and patterns without values are refused.
//!
//! Three comments of our own keep what the format has no place for: `% blocks 6 6 3`, the sizes of block rows; `% groups
//! 0 0 1`, a group for each; `% signs + + -`, the sign of each one's pivots. Any of them may go on over several lines.
//! Where the numbers do not make sense as such the comment is one for people only.
//!
//! A reader of our own, because that of nalgebra-sparse takes a whole text at once, knows no compression, tells places
//! by its grammar's rules and stores both triangles of a symmetric matrix. Here nothing is allocated because a header
//! asks for it: memory grows with the entries that are there, and comments for people are not kept.

use flate2::bufread::MultiGzDecoder;
use std::fmt;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::num::{IntErrorKind, ParseIntError};
use std::path::{Path, PathBuf};

/// Most bytes of a line. Every number is shorter; a file without line ends is longer.
const LONGEST_LINE: usize = 1 << 20;

/// Most block rows that comments may tell of: a few bytes of gzip say a million.
const MOST_BLOCKS: usize = 1 << 23;

/// Entries that memory is made for before they are there.
const EXPECTED: usize = 1 << 12;

/// A file that is not read, with its line where there is one, and what to do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MarketError {
    pub path: PathBuf,
    /// Line from 1.
    pub line: Option<u64>,
    /// Fault and remedy, in words.
    pub message: String,
}

impl fmt::Display for MarketError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = self.path.display();
        match self.line {
            Some(line) => write!(f, "{path}, line {line}: {}", self.message),
            None => write!(f, "{path}: {}", self.message),
        }
    }
}

impl std::error::Error for MarketError {}

/// The content of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Market {
    pub rows: usize,
    pub columns: usize,
    /// Array file: all values column by column. Otherwise coordinates.
    pub array: bool,
    /// The entries are the lower triangle of a symmetric matrix.
    pub symmetric: bool,
    /// Row and column from 0, and value, in the order of the file; of an array all that are not zero or that stand in a
    /// matrix of one column.
    pub entries: Vec<(usize, usize, f64)>,
    /// Sizes of the block rows; empty where the file tells none.
    pub blocks: Vec<usize>,
    /// Group of each block row; empty where the file tells none.
    pub groups: Vec<u32>,
    /// True for each block row with positive pivots; empty if the file does not tell.
    pub signs: Vec<bool>,
}

/// Reads a file, unpacking it where it begins as gzip does.
pub fn read(path: &Path) -> Result<Market, MarketError> {
    let unreadable = |e: io::Error| MarketError {
        path: path.to_owned(),
        line: None,
        message: format!("cannot be read: {e}"),
    };
    let mut file = BufReader::with_capacity(1 << 16, File::open(path).map_err(unreadable)?);
    let packed = file
        .fill_buf()
        .map_err(unreadable)?
        .starts_with(&[0x1f, 0x8b]);
    if packed {
        read_from(BufReader::new(MultiGzDecoder::new(file)), path)
    } else {
        read_from(file, path)
    }
}

/// Reads plain text; errors name `path`.
pub fn read_from(text: impl BufRead, path: &Path) -> Result<Market, MarketError> {
    Reader {
        text,
        path,
        number: 0,
        line: Vec::new(),
        market: Market::default(),
    }
    .read()
}

/// Format and type of the entries, from the banner.
#[derive(Debug, Clone, Copy)]
struct Banner {
    array: bool,
    integer: bool,
}

struct Reader<'a, R> {
    text: R,
    path: &'a Path,
    /// Line that was read last, from 1.
    number: u64,
    line: Vec<u8>,
    market: Market,
}

impl<R: BufRead> Reader<'_, R> {
    fn error(&self, message: impl Into<String>) -> MarketError {
        MarketError {
            path: self.path.to_owned(),
            line: (self.number > 0).then_some(self.number),
            message: message.into(),
        }
    }

    fn read(mut self) -> Result<Market, MarketError> {
        let banner = self.banner()?;
        let promised = self.sizes(banner)?;
        let at = self.number;
        self.market.entries.reserve(promised.min(EXPECTED));
        let mut count = 0;
        while self.next_data()? {
            if count == promised {
                return Err(self.error(format!(
                    "more than the {promised} entries that line {at} promises: correct it there"
                )));
            }
            if banner.array {
                self.array_entry(banner, count)?;
            } else {
                self.coordinate_entry(banner)?;
            }
            count += 1;
        }
        if count < promised {
            return Err(self.error(format!(
                "the file ends after {count} of the {promised} entries that line {at} promises: it is cut off, or the \
                 line is wrong"
            )));
        }
        if banner.array && self.market.columns > 1 {
            self.market.entries.retain(|&(_, _, value)| value != 0.0);
        }
        Ok(self.market)
    }

    /// The next line into `self.line`, without its end; `false` at the end of the file.
    fn next(&mut self) -> Result<bool, MarketError> {
        self.line.clear();
        self.number += 1;
        let mut limited = self.text.by_ref().take(LONGEST_LINE as u64 + 1);
        let read = limited.read_until(b'\n', &mut self.line);
        let read = read.map_err(|e| {
            self.error(format!(
                "cannot be read further: {e}; a compressed file may be damaged"
            ))
        })?;
        if read > LONGEST_LINE {
            return Err(self.error("is no line of text: not a Matrix Market file"));
        }
        while self.line.last().is_some_and(u8::is_ascii_whitespace) {
            self.line.pop();
        }
        Ok(read > 0)
    }

    /// The next line that is neither blank nor a comment into `self.line`; `false` at the end of the file.
    fn next_data(&mut self) -> Result<bool, MarketError> {
        while self.next()? {
            let text = self.line.trim_ascii_start();
            match text.first() {
                None => {}
                Some(b'%') => self.comment()?,
                Some(_) => return Ok(true),
            }
        }
        Ok(false)
    }

    /// Takes what a comment tells of the blocks; any other is for people.
    fn comment(&mut self) -> Result<(), MarketError> {
        let text = self.line.trim_ascii_start().get(1..).unwrap_or_default();
        let Ok(comment) = std::str::from_utf8(text) else {
            return Ok(());
        };
        let (word, rest) = comment.trim().split_once(' ').unwrap_or_default();
        let words = rest.split_whitespace();
        let market = &mut self.market;
        match word {
            "blocks" => extend(&mut market.blocks, words.map(|w| w.parse().ok())),
            "groups" => extend(&mut market.groups, words.map(|w| w.parse().ok())),
            "signs" => extend(
                &mut market.signs,
                words.map(|w| match w {
                    "+" => Some(true),
                    "-" => Some(false),
                    _ => None,
                }),
            ),
            _ => {}
        }
        let lists = [market.blocks.len(), market.groups.len(), market.signs.len()];
        if lists.into_iter().max() > Some(MOST_BLOCKS) {
            return Err(self.error(format!(
                "comments tell of more than {MOST_BLOCKS} blocks: drop them"
            )));
        }
        Ok(())
    }

    fn banner(&mut self) -> Result<Banner, MarketError> {
        const CURE: &str =
            "the first line has to be such as `%%MatrixMarket matrix coordinate real symmetric`";
        if !self.next()? {
            return Err(self.error(format!("the file is empty: {CURE}")));
        }
        if self.line.contains(&0) {
            return Err(self.error(
                "is not text: unpack archives such as .tar.gz first, and give the .mtx in it",
            ));
        }
        let line = String::from_utf8_lossy(&self.line).to_lowercase();
        // Editors put a byte order mark first.
        let line = line.trim_start_matches('\u{feff}');
        let words: Vec<&str> = line.split_whitespace().collect();
        let ["%%matrixmarket", object, format, field, symmetry] = words[..] else {
            return Err(self.error(format!("no Matrix Market banner: {CURE}")));
        };
        let unsupported = |what: &str, cure: &str| {
            Err(self.error(format!("`{what}` is not solved here: {cure}")))
        };
        if object != "matrix" {
            return unsupported(object, "store it as a `matrix`");
        }
        let array = match format {
            "coordinate" => false,
            "array" => true,
            other => return unsupported(other, "the formats are `coordinate` and `array`"),
        };
        let integer = match field {
            "real" | "double" => false,
            "integer" => true,
            "complex" => {
                return unsupported(
                    field,
                    "write it as a real one of twice the size, [A −B; B A]",
                );
            }
            "pattern" => {
                return unsupported(field, "a pattern has no values, take one that is `real`");
            }
            other => return unsupported(other, "the fields are `real` and `integer`"),
        };
        let symmetric = match symmetry {
            "general" => false,
            "symmetric" => true,
            "skew-symmetric" => return unsupported(symmetry, "store both triangles as `general`"),
            "hermitian" => return unsupported(symmetry, "a real one is `symmetric`"),
            other => return unsupported(other, "the symmetries are `general` and `symmetric`"),
        };
        self.market.symmetric = symmetric;
        self.market.array = array;
        Ok(Banner { array, integer })
    }

    /// The line of sizes: how many entries follow.
    fn sizes(&mut self, banner: Banner) -> Result<usize, MarketError> {
        let what = if banner.array {
            "ROWS COLUMNS"
        } else {
            "ROWS COLUMNS ENTRIES"
        };
        if !self.next_data()? {
            return Err(self.error(format!(
                "the file ends before its sizes: a line `{what}` is needed"
            )));
        }
        let line = String::from_utf8_lossy(&self.line).into_owned();
        let mut sizes = Vec::new();
        for word in line.split_whitespace() {
            // Limit of a pointer's range of doubles. It also keeps a product of three sizes within
            // u128.
            let size = word
                .parse::<usize>()
                .ok()
                .filter(|&n| n <= isize::MAX as usize / 8);
            let size = size.ok_or_else(|| {
                self.error(format!(
                    "`{word}` is no size that can be held: `{what}` are needed, not negative"
                ))
            })?;
            sizes.push(size);
        }
        let wanted = if banner.array { 2 } else { 3 };
        if sizes.len() != wanted {
            return Err(self.error(format!("has {} numbers: `{what}` are needed", sizes.len())));
        }
        let (rows, columns) = (sizes[0], sizes[1]);
        let market = &mut self.market;
        (market.rows, market.columns) = (rows, columns);
        if market.symmetric && rows != columns {
            return Err(self.error(format!(
                "a symmetric matrix has as many rows as columns, not {rows} and {columns}"
            )));
        }
        let promised = match sizes.get(2) {
            Some(&entries) => Some(entries),
            None if market.symmetric => (rows + 1).checked_mul(rows).map(|n| n / 2),
            None => rows.checked_mul(columns),
        };
        promised.ok_or_else(|| {
            self.error(format!(
                "an array of {rows} × {columns} cannot be held: store it by coordinates"
            ))
        })
    }

    /// The words of the line, which are to be `N`.
    fn words<const N: usize>(&self, what: &str) -> Result<[&str; N], MarketError> {
        let no_text = |_| self.error(format!("is not text: `{what}` are needed"));
        let line = std::str::from_utf8(&self.line).map_err(no_text)?;
        let mut words = line.split_ascii_whitespace();
        let mut found = [""; N];
        for word in &mut found {
            *word = words.next().unwrap_or_default();
        }
        let n = line.split_ascii_whitespace().count();
        if n != N {
            return Err(self.error(format!("has {n} numbers where `{what}` are needed")));
        }
        Ok(found)
    }

    fn coordinate_entry(&mut self, banner: Banner) -> Result<(), MarketError> {
        let [row, column, value] = self.words("ROW COLUMN VALUE")?;
        let row = self.index("row", row, self.market.rows)?;
        let column = self.index("column", column, self.market.columns)?;
        let value = self.value(value, banner)?;
        if self.market.symmetric && row < column {
            return Err(self.error(format!(
                "entry ({}, {}) stands above the diagonal: a symmetric file holds the lower triangle; exchange the \
                 indices, or call it `general`",
                row + 1,
                column + 1
            )));
        }
        self.market.entries.push((row, column, value));
        Ok(())
    }

    /// Entry `k` of an array: column by column, of a symmetric one from the diagonal on.
    fn array_entry(&mut self, banner: Banner, k: usize) -> Result<(), MarketError> {
        let [value] = self.words("VALUE")?;
        let value = self.value(value, banner)?;
        let n = self.market.rows;
        let (row, column) = if self.market.symmetric {
            match self.market.entries.last() {
                Some(&(row, column, _)) if row + 1 < n => (row + 1, column),
                Some(&(_, column, _)) => (column + 1, column + 1),
                None => (0, 0),
            }
        } else {
            (k % n, k / n)
        };
        self.market.entries.push((row, column, value));
        Ok(())
    }

    fn index(&self, what: &str, word: &str, size: usize) -> Result<usize, MarketError> {
        match word.parse::<usize>() {
            Ok(i) if (1..=size).contains(&i) => Ok(i - 1),
            Ok(0) => Err(self.error(format!("the {what} is 0: they count from 1"))),
            Ok(i) => Err(self.error(format!(
                "the {what} is {i} of {size}: correct it, or the sizes"
            ))),
            Err(_) => Err(self.error(format!(
                "the {what} is `{word}`: it has to be a number from 1 to {size}"
            ))),
        }
    }

    fn value(&self, word: &str, banner: Banner) -> Result<f64, MarketError> {
        let bad = |why: &str| self.error(format!("the value is `{word}`: {why}"));
        if banner.integer {
            let large = "a double does not hold it, call the matrix `real` to have it rounded";
            let value: i128 = word.parse().map_err(|e: ParseIntError| match e.kind() {
                IntErrorKind::PosOverflow | IntErrorKind::NegOverflow => bad(large),
                _ => bad("the banner says `integer`"),
            })?;
            let digits = i128::BITS - value.unsigned_abs().leading_zeros();
            if digits.saturating_sub(value.trailing_zeros()) > f64::MANTISSA_DIGITS {
                return Err(bad(large));
            }
            return Ok(value as f64);
        }
        // Fortran writes exponents with a D.
        let parsed = word
            .parse()
            .or_else(|_| word.replace(['d', 'D'], "e").parse());
        match parsed {
            Ok(0.0) if has_digits(word) => Err(bad("it is too small for a double")),
            Ok(value) if f64::is_finite(value) => Ok(value),
            Ok(_) => Err(bad("it has to be finite and fit a double")),
            Err(_) => Err(bad("it has to be a number")),
        }
    }
}

/// True if the digits before an exponent are not all 0.
fn has_digits(word: &str) -> bool {
    let digits = word.split(['e', 'E', 'd', 'D']).next().unwrap_or(word);
    digits.contains(|c: char| ('1'..='9').contains(&c))
}

/// Appends the words where all of them make sense.
fn extend<T>(to: &mut Vec<T>, words: impl Iterator<Item = Option<T>>) {
    to.extend(words.collect::<Option<Vec<T>>>().unwrap_or_default());
}

#[cfg(test)]
mod tests;
