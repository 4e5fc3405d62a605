//! Results that take long, kept in files under `target/taut/reference`.
//!
//! A file is named after a hash of its key and holds the key as well, so that neither a changed definition nor a
//! collision is taken for a hit. What cannot be read is computed anew, and what cannot be written is not an error.

use crate::files;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// Where the files are, from the directory that the program runs in.
const DIRECTORY: &str = "target/taut/reference";

#[derive(Serialize, Deserialize)]
struct Entry<T> {
    key: String,
    value: T,
}

/// The value kept under `key`, which has to name everything that defines it, a version of the computation included; else
/// that of `compute`, which is then kept.
pub fn cached<T: Serialize + DeserializeOwned, E>(
    key: &str,
    compute: impl FnOnce() -> Result<T, E>,
) -> Result<T, E> {
    cached_in(Path::new(DIRECTORY), key, compute)
}

fn cached_in<T: Serialize + DeserializeOwned, E>(
    directory: &Path,
    key: &str,
    compute: impl FnOnce() -> Result<T, E>,
) -> Result<T, E> {
    let path = file(directory, key);
    let text = std::fs::read_to_string(&path).ok();
    let entry: Option<Entry<T>> = text.and_then(|t| serde_json::from_str(&t).ok());
    if let Some(entry) = entry.filter(|e| e.key == key) {
        return Ok(entry.value);
    }
    let entry = Entry {
        key: key.to_owned(),
        value: compute()?,
    };
    let _ = files::write_json(&path, &entry);
    Ok(entry.value)
}

fn file(directory: &Path, key: &str) -> PathBuf {
    let mut hasher = DefaultHasher::new();
    key.hash(&mut hasher);
    directory.join(format!("{:016x}.json", hasher.finish()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    #[test]
    fn values_are_kept_and_bad_files_are_not_believed() {
        let directory = std::env::temp_dir().join(format!("taut-cache-{}", std::process::id()));
        let get = |key: &str, value: f64| {
            cached_in::<f64, Infallible>(&directory, key, || Ok(value)).unwrap()
        };
        assert_eq!(get("a", 0.1 + 0.2), 0.1 + 0.2);
        assert_eq!(get("a", 5.0), 0.1 + 0.2);
        assert_eq!(get("b", 5.0), 5.0);
        // Another key's entry under this name, then no JSON at all.
        std::fs::copy(file(&directory, "b"), file(&directory, "a")).unwrap();
        assert_eq!(get("a", 7.0), 7.0);
        std::fs::write(file(&directory, "a"), "{").unwrap();
        assert_eq!(get("a", 8.0), 8.0);
        std::fs::remove_dir_all(&directory).unwrap();
        let nowhere = Path::new("/dev/null/nowhere");
        assert_eq!(
            cached_in::<f64, Infallible>(nowhere, "a", || Ok(9.0)),
            Ok(9.0)
        );
    }
}
