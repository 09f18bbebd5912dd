//! Four layers of settings, laid over each other and checked as a whole.

use super::{SETTINGS, Settings, environment_name};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// What was given besides the defaults, from the weakest layer to the strongest.
#[derive(Debug, Default)]
pub struct Layers {
    file: Option<(PathBuf, Table)>,
    environment: Table,
    flags: Table,
    unknown_variables: Vec<String>,
}

/// What is wrong with the settings, and where. Each is repaired by the person who gave them.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum SettingsError {
    #[error(
        "cannot read the settings file {path}: {cause}. Name an existing file with --config or PDN_CONFIG.",
        path = .path.display()
    )]
    Unreadable { path: PathBuf, cause: std::io::Error },
    #[error("{path} is not TOML: {cause}", path = .path.display())]
    NotToml { path: PathBuf, cause: toml::de::Error },
    #[error("{place}: there is no setting `{name}`{hint}. `pdnd config` lists every setting.")]
    Unknown { place: String, name: String, hint: String },
    #[error("{place}: `{name}` must be {expected}, but it is {found}.")]
    WrongType { place: String, name: String, expected: String, found: String },
    #[error("{place}: `{name}` is {value}, outside its range {least} to {greatest}.")]
    OutOfRange { place: String, name: String, value: i64, least: u64, greatest: u64 },
}

impl Layers {
    /// Adds the file, if there is one.
    pub fn with_file(mut self, path: Option<&Path>) -> Result<Self, SettingsError> {
        let Some(path) = path else { return Ok(self) };
        let text = std::fs::read_to_string(path)
            .map_err(|cause| SettingsError::Unreadable { path: path.to_owned(), cause })?;
        let table = text.parse().map_err(|cause| SettingsError::NotToml { path: path.to_owned(), cause })?;
        self.file = Some((path.to_owned(), table));
        Ok(self)
    }

    /// Adds the variables `PDN_*`. Lists are separated by commas.
    pub fn with_environment(
        mut self,
        variables: impl Iterator<Item = (String, String)>,
    ) -> Result<Self, SettingsError> {
        for (variable, text) in variables {
            if !variable.starts_with("PDN_") || variable == "PDN_CONFIG" {
                continue;
            }
            let Some(setting) = SETTINGS.iter().find(|setting| environment_name(setting.name) == variable)
            else {
                self.unknown_variables.push(variable);
                continue;
            };
            let value = read(&variable, setting.name, &text)?;
            self.environment.insert(setting.name.to_owned(), value);
        }
        Ok(self)
    }

    /// Adds a flag of the form `name=value`. Lists are separated by commas.
    pub fn with_assignment(self, assignment: &str) -> Result<Self, SettingsError> {
        let (name, text) = assignment.split_once('=').unwrap_or((assignment, ""));
        if !SETTINGS.iter().any(|setting| setting.name == name) {
            return Err(unknown("--set", name));
        }
        let value = read("--set", name, text)?;
        Ok(self.with_flag(name, Some(value)))
    }

    /// Adds a flag; the strongest layer.
    pub fn with_flag(mut self, name: &str, value: Option<Value>) -> Self {
        if let Some(value) = value {
            self.flags.insert(name.to_owned(), value);
        }
        self
    }

    /// Variables that look like settings but are none, for a warning: other programs use such names too.
    pub fn unknown_variables(&self) -> &[String] {
        &self.unknown_variables
    }

    /// Lays the layers over each other and checks names, types and ranges.
    pub fn resolve(&self) -> Result<Settings, SettingsError> {
        let mut all = defaults();
        let file = self.file.iter().map(|(path, table)| (path.display().to_string(), table));
        let layers = file.chain([
            ("the environment".to_owned(), &self.environment),
            ("the command line".to_owned(), &self.flags),
        ]);
        for (place, table) in layers {
            for (name, value) in table {
                check(&place, name, value, &all)?;
                all.insert(name.clone(), value.clone());
            }
        }
        Settings::deserialize(all).map_err(|cause| SettingsError::WrongType {
            place: "settings".to_owned(),
            name: "value".to_owned(),
            expected: "as the list says".to_owned(),
            found: cause.to_string(),
        })
    }
}

fn defaults() -> Table {
    Table::try_from(Settings::default()).expect("the defaults are plain values")
}

/// A value written as plain text, of the type that the setting has.
fn read(place: &str, name: &str, text: &str) -> Result<Value, SettingsError> {
    Ok(match &defaults()[name] {
        Value::Integer(_) => Value::Integer(text.trim().parse().map_err(|_| SettingsError::WrongType {
            place: place.to_owned(),
            name: name.to_owned(),
            expected: "a whole number".to_owned(),
            found: format!("{text:?}"),
        })?),
        Value::Array(_) => {
            let parts = text.split(',').map(str::trim).filter(|part| !part.is_empty());
            Value::Array(parts.map(Value::from).collect())
        }
        _ => Value::String(text.to_owned()),
    })
}

fn unknown(place: &str, name: &str) -> SettingsError {
    let near = SETTINGS
        .iter()
        .find(|setting| !name.is_empty() && (setting.name.contains(name) || name.contains(setting.name)));
    let hint = near.map_or_else(String::new, |near| format!(" (did you mean `{}`?)", near.name));
    SettingsError::Unknown { place: place.to_owned(), name: name.to_owned(), hint }
}

fn check(place: &str, name: &str, value: &Value, known: &Table) -> Result<(), SettingsError> {
    let place = place.to_owned();
    let Some(setting) = SETTINGS.iter().find(|setting| setting.name == name) else {
        return Err(unknown(&place, name));
    };
    let wrong = |expected: &str| SettingsError::WrongType {
        place: place.clone(),
        name: name.to_owned(),
        expected: expected.to_owned(),
        found: value.to_string(),
    };
    match (&known[name], value) {
        (Value::Integer(_), &Value::Integer(value)) => {
            let (least, greatest) = setting.range.unwrap_or((0, u64::MAX));
            if u64::try_from(value).is_ok_and(|value| (least..=greatest).contains(&value)) {
                return Ok(());
            }
            Err(SettingsError::OutOfRange { place, name: name.to_owned(), value, least, greatest })
        }
        (Value::Integer(_), _) => Err(wrong("a whole number")),
        (Value::Array(_), Value::Array(items)) if items.iter().all(Value::is_str) => Ok(()),
        (Value::Array(_), _) => Err(wrong("a list of strings")),
        (Value::String(_), Value::String(text)) => match (name, text.as_str()) {
            ("log_format", "human" | "json") => Ok(()),
            ("log_format", _) => Err(wrong("\"human\" or \"json\"")),
            ("log_level", text) if tracing_subscriber::EnvFilter::try_new(text).is_err() => {
                Err(wrong("a level or a filter such as \"info,pdnd=debug\""))
            }
            _ => Ok(()),
        },
        _ => Err(wrong("a string")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn variables(pairs: &[(&str, &str)]) -> impl Iterator<Item = (String, String)> {
        pairs.iter().map(|&(name, value)| (name.to_owned(), value.to_owned())).collect::<Vec<_>>().into_iter()
    }

    fn file(text: &str) -> Layers {
        Layers { file: Some((PathBuf::from("pdnd.toml"), text.parse().unwrap())), ..Layers::default() }
    }

    #[test]
    fn the_later_layer_wins() {
        let layers = file("max_vehicles = 2\nwait_ms = 20\ndrain_ms = 200")
            .with_environment(variables(&[("PDN_WAIT_MS", "30"), ("PDN_DRAIN_MS", "300"), ("HOME", "/")]))
            .unwrap()
            .with_flag("drain_ms", Some(Value::Integer(400)))
            .with_flag("incoming_messages", None);
        let settings = layers.resolve().unwrap();
        assert_eq!((settings.max_vehicles, settings.wait_ms, settings.drain_ms), (2, 30, 400));
        assert_eq!(settings.incoming_messages, Settings::default().incoming_messages);
    }

    #[test]
    fn a_list_in_the_environment_is_separated_by_commas() {
        let layers = Layers::default();
        let layers = layers.with_environment(variables(&[("PDN_LISTEN", "tcp/a:1, tcp/b:2")])).unwrap();
        assert_eq!(layers.resolve().unwrap().listen, ["tcp/a:1", "tcp/b:2"]);
    }

    #[test]
    fn what_is_wrong_is_named_with_its_place() {
        for (text, words) in [
            ("max_vehicle = 2", vec!["pdnd.toml", "no setting `max_vehicle`", "did you mean `max_vehicles`"]),
            ("max_vehicles = 0", vec!["`max_vehicles` is 0", "1 to 256"]),
            ("max_vehicles = -1", vec!["`max_vehicles` is -1"]),
            ("max_vehicles = \"two\"", vec!["`max_vehicles` must be a whole number", "two"]),
            ("listen = \"tcp/a:1\"", vec!["`listen` must be a list of strings"]),
            ("sync_ms = 0", vec!["`sync_ms` is 0", "1 to 10000"]),
            ("log_level = \"a=b=c\"", vec!["`log_level` must be a level"]),
            ("log_format = 3", vec!["`log_format` must be a string"]),
        ] {
            let message = file(text).resolve().unwrap_err().to_string();
            assert!(words.iter().all(|word| message.contains(word)), "{text}: {message}");
        }
        let error =
            Layers::default().with_environment(variables(&[("PDN_MAX_VEHICLES", "two")])).unwrap_err();
        assert!(error.to_string().contains("PDN_MAX_VEHICLES"), "{error}");
    }

    #[test]
    fn a_variable_that_is_no_setting_is_told() {
        let layers = Layers::default().with_environment(variables(&[("PDN_MAX_VEHICLE", "2")])).unwrap();
        assert_eq!(layers.unknown_variables(), ["PDN_MAX_VEHICLE"]);
    }
}
