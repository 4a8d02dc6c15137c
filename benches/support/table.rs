//! A table of what was measured so far, to which each row is added as soon as it is known: a run of hours may be stopped, and goes on.

use serde::Serialize;
use serde::de::DeserializeOwned;
use std::error::Error;
use std::fs::OpenOptions;
use std::path::{Path, PathBuf};

/// The table with its file.
#[derive(Debug)]
pub(crate) struct Table<Row> {
    path: PathBuf,
    /// All rows.
    pub(crate) rows: Vec<Row>,
}

impl<Row: Serialize + DeserializeOwned> Table<Row> {
    /// Of a file that may not be there yet.
    ///
    /// # Errors
    /// Of the file system, and where a row cannot be read.
    pub(crate) fn open(path: &Path) -> Result<Self, Box<dyn Error>> {
        let rows = match path.exists() {
            true => csv::Reader::from_path(path)?.deserialize().collect::<Result<_, _>>()?,
            false => Vec::new(),
        };
        Ok(Self { path: path.to_owned(), rows })
    }

    /// Adds a row, on disk first.
    ///
    /// # Errors
    /// Of the file system.
    pub(crate) fn add(&mut self, row: Row) -> Result<(), Box<dyn Error>> {
        let begun = self.path.exists();
        let file = OpenOptions::new().create(true).append(true).open(&self.path)?;
        let mut writer = csv::WriterBuilder::new().has_headers(!begun).from_writer(file);
        writer.serialize(&row)?;
        writer.flush()?;
        self.rows.push(row);
        Ok(())
    }
}
