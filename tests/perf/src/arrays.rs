//! Named arrays in a file: what the peers read, and what a process of its own starts from.
//!
//! Layout: 8 bytes length of the header (little endian), the header as JSON (for each name its type, shape
//! and offset in bytes after the header), then the values, little endian, each array row by row.

use std::collections::BTreeMap;
use std::io::{Error, ErrorKind, Read, Result, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};

/// Arrays by name.
#[derive(Default)]
pub struct Arrays {
    header: BTreeMap<String, Entry>,
    values: Vec<u8>,
}

#[derive(Serialize, Deserialize)]
struct Entry {
    dtype: String,
    shape: Vec<usize>,
    offset: usize,
}

impl Arrays {
    /// Rows of this shape, as many as the values fill.
    pub fn put_f64(&mut self, name: &str, row: &[usize], values: impl IntoIterator<Item = f64>) {
        self.put(name, "<f8", row, values.into_iter().map(f64::to_le_bytes));
    }

    /// As [`Arrays::put_f64`].
    pub fn put_u32(&mut self, name: &str, row: &[usize], values: impl IntoIterator<Item = u32>) {
        self.put(name, "<u4", row, values.into_iter().map(u32::to_le_bytes));
    }

    fn put<const BYTES: usize>(
        &mut self,
        name: &str,
        dtype: &str,
        row: &[usize],
        values: impl Iterator<Item = [u8; BYTES]>,
    ) {
        self.values.resize(self.values.len().next_multiple_of(8), 0);
        let offset = self.values.len();
        values.for_each(|value| self.values.extend(value));
        let rows = (self.values.len() - offset) / (BYTES * row.iter().product::<usize>());
        let shape = [&[rows], row].concat();
        self.header.insert(name.to_string(), Entry { dtype: dtype.to_string(), shape, offset });
    }

    /// All values of an array, row by row.
    pub fn f64(&self, name: &str) -> Result<Vec<f64>> {
        Ok(self
            .bytes(name, "<f8")?
            .chunks_exact(8)
            .map(|b| f64::from_le_bytes(b.try_into().unwrap()))
            .collect())
    }

    /// As [`Arrays::f64`].
    pub fn u32(&self, name: &str) -> Result<Vec<u32>> {
        Ok(self
            .bytes(name, "<u4")?
            .chunks_exact(4)
            .map(|b| u32::from_le_bytes(b.try_into().unwrap()))
            .collect())
    }

    fn bytes(&self, name: &str, dtype: &str) -> Result<&[u8]> {
        let missing = || Error::new(ErrorKind::InvalidData, format!("no array {name} of type {dtype}"));
        let entry = self.header.get(name).filter(|entry| entry.dtype == dtype).ok_or_else(missing)?;
        let width = if dtype == "<f8" { 8 } else { 4 };
        let length = width * entry.shape.iter().product::<usize>();
        self.values.get(entry.offset..entry.offset + length).ok_or_else(missing)
    }

    pub fn write(&self, path: &Path) -> Result<()> {
        let header = serde_json::to_vec(&self.header)?;
        let mut file = std::fs::File::create(path)?;
        file.write_all(&(header.len() as u64).to_le_bytes())?;
        file.write_all(&header)?;
        file.write_all(&self.values)
    }

    pub fn read(path: &Path) -> Result<Arrays> {
        let mut file = std::fs::File::open(path)?;
        let mut length = [0; 8];
        file.read_exact(&mut length)?;
        let mut header = vec![0; u64::from_le_bytes(length) as usize];
        file.read_exact(&mut header)?;
        let mut values = Vec::new();
        file.read_to_end(&mut values)?;
        Ok(Arrays { header: serde_json::from_slice(&header)?, values })
    }
}
