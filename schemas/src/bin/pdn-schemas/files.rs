//! A set of files below the repository's root that are written, or compared with what is there, as one.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The command that mends a difference.
pub const MEND: &str = "cargo run --release -p pdn-schemas -- generate";

/// Files by their path from the root.
pub struct Files {
    contents: BTreeMap<PathBuf, Vec<u8>>,
    owned_folders: Vec<&'static str>,
}

impl Files {
    /// No files yet. Whatever else stands in the owned folders does not belong there.
    pub fn new(owned_folders: &[&'static str]) -> Files {
        Files { contents: BTreeMap::new(), owned_folders: owned_folders.to_vec() }
    }

    /// Adds a file.
    pub fn add(&mut self, path: impl Into<PathBuf>, content: impl Into<Vec<u8>>) {
        let path = path.into();
        let twice = self.contents.insert(path.clone(), content.into());
        assert!(twice.is_none(), "{} is generated twice", path.display());
    }

    /// Writes what differs and removes what does not belong.
    pub fn write(&self) -> Result<String, String> {
        let mut written = 0;
        for (path, content) in &self.contents {
            let full = root().join(path);
            if std::fs::read(&full).is_ok_and(|present| present == *content) {
                continue;
            }
            let folder = full.parent().expect("a generated file stands in a folder");
            std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
            std::fs::write(&full, content).map_err(|error| format!("{}: {error}", full.display()))?;
            written += 1;
        }
        let strays = self.strays()?;
        for path in &strays {
            std::fs::remove_file(root().join(path))
                .map_err(|error| format!("{}: {error}", path.display()))?;
        }
        let total = self.contents.len();
        Ok(format!("{total} files generated, {written} of them new or changed, {} removed", strays.len()))
    }

    /// Fails with the list of files that [`Files::write`] would touch.
    pub fn check(&self) -> Result<String, String> {
        let differs = |(path, content): &(&PathBuf, &Vec<u8>)| {
            !std::fs::read(root().join(path)).is_ok_and(|present| present == **content)
        };
        let mut stale: Vec<PathBuf> =
            self.contents.iter().filter(differs).map(|(path, _)| path.clone()).collect();
        stale.extend(self.strays()?);
        if stale.is_empty() {
            return Ok(format!("{} generated files are up to date", self.contents.len()));
        }
        let list: Vec<String> = stale.iter().map(|path| format!("  {}", path.display())).collect();
        Err(format!("not as generated from the contract's types:\n{}\nto mend it: {MEND}", list.join("\n")))
    }

    fn strays(&self) -> Result<Vec<PathBuf>, String> {
        let mut strays = Vec::new();
        for folder in &self.owned_folders {
            let Ok(entries) = std::fs::read_dir(root().join(folder)) else { continue };
            for entry in entries {
                let entry = entry.map_err(|error| format!("{folder}: {error}"))?;
                let path = Path::new(folder).join(entry.file_name());
                if !self.contents.contains_key(&path) {
                    strays.push(path);
                }
            }
        }
        strays.sort();
        Ok(strays)
    }
}

/// The repository's root.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the crate stands in the repository")
}
