//! The files of all shards as one.

use super::{CasesError, Header, Known, Shard, Written};

/// A study whose cases are all known.
#[derive(Debug, Clone, PartialEq)]
pub struct Joined {
    /// Header of the whole study.
    pub header: Header,
    /// The machines that they ran on.
    pub machine: String,
    /// Its cases.
    pub known: Known,
}

impl Joined {
    /// Joins the files of all shards.
    ///
    /// # Errors
    /// [`CasesError`]: files of different commands, versions or inputs, a shard that is absent, unfinished or there twice.
    pub fn of(files: Vec<Written>) -> Result<Self, CasesError> {
        let Some(first) = files.first() else {
            return Err(CasesError::Absent {
                numbers: vec![1],
                of: 1,
                command: "taut study NAME".to_owned(),
            });
        };
        let name = format!("`{}`", first.path.display());
        for file in &files[1..] {
            file.header.check(&file.path, &first.header, &name)?;
        }
        every_shard_once(&files)?;
        if let Some(file) = files.iter().find(|file| file.all.is_none()) {
            let kept = file.path.display().to_string();
            let command = file.header.call(&["--resume", "--cases", &kept]);
            return Err(CasesError::Unfinished(file.path.clone(), command));
        }
        let found: usize = files.iter().map(|file| file.known.len()).sum();
        let other = |file: &&Written| file.all != Some(found);
        if let Some(wanted) = files.iter().find(other).and_then(|file| file.all) {
            return Err(CasesError::Count { found, wanted });
        }
        Ok(Self {
            header: Header {
                shard: Shard::WHOLE,
                ..first.header.clone()
            },
            machine: machines(&files),
            known: files.into_iter().flat_map(|file| file.known).collect(),
        })
    }
}

fn every_shard_once(files: &[Written]) -> Result<(), CasesError> {
    let of = files[0].header.shard.of;
    let mut shards: Vec<Option<&Written>> = vec![None; of];
    for file in files {
        let shard = file.header.shard;
        if let Some(other) = shards[shard.number - 1].replace(file) {
            let paths = [other, file].map(|file| file.path.clone());
            return Err(CasesError::Twice(shard, paths));
        }
    }
    let absent = (1..=of).filter(|number| shards[number - 1].is_none());
    let absent: Vec<usize> = absent.collect();
    let Some(&number) = absent.first() else {
        return Ok(());
    };
    let first = Header {
        shard: Shard { number, of },
        ..files[0].header.clone()
    };
    Err(CasesError::Absent {
        numbers: absent,
        of,
        command: first.call(&[]),
    })
}

/// The machines of these files; where they differ with the shards of each, if there are several.
#[must_use]
pub fn machines(files: &[Written]) -> String {
    let mut known: Vec<(&str, Vec<String>)> = Vec::new();
    for file in files {
        for machine in &file.machines {
            let shard = file.header.shard.to_string();
            match known.iter_mut().find(|(name, _)| name == machine) {
                Some((_, shards)) => shards.push(shard),
                None => known.push((machine, vec![shard])),
            }
        }
    }
    let alone = known.len() == 1 || files.len() == 1;
    let text = |(machine, shards): &(&str, Vec<String>)| match alone {
        true => (*machine).to_owned(),
        false => format!("shards {}: {machine}", shards.join(", ")),
    };
    known.iter().map(text).collect::<Vec<_>>().join("; ")
}
