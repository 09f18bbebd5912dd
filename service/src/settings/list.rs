//! What is said of each setting, and the file that says it all.

use super::Settings;
use pdn_schemas::limits;

/// What is said of a setting where settings are listed.
pub struct Setting {
    /// Its name in the file; in the environment `PDN_` and the name in capitals.
    pub name: &'static str,
    /// Meaning and unit.
    pub meaning: &'static str,
    /// Least and greatest value; none for what is not a number.
    pub range: Option<(u64, u64)>,
}

/// Every setting, in the order of `deploy/pdnd.toml`.
pub const SETTINGS: &[Setting] = &[
    Setting {
        name: "listen",
        meaning: "Zenoh endpoints to serve on; empty: those of the Zenoh configuration, tcp/127.0.0.1:7447 \
                  unless changed there.",
        range: None,
    },
    Setting {
        name: "connect",
        meaning: "Zenoh endpoints of other routers to connect to; tried again for ever; empty: those of the \
                  Zenoh configuration, none unless changed there.",
        range: None,
    },
    Setting {
        name: "zenoh_config",
        meaning: "Zenoh configuration file (JSON5) laid over the built-in one, which is deploy/zenoh.json5; \
                  empty: none.",
        range: None,
    },
    Setting {
        name: "open_timeout_ms",
        meaning: "Time within which the Zenoh session must be open, ms.",
        range: Some((100, 600_000)),
    },
    Setting {
        name: "max_vehicles",
        meaning: "Vehicles that may have configured a mission since the start; each has two threads of its \
                  own.",
        range: Some((1, 256)),
    },
    Setting {
        name: "incoming_messages",
        meaning: "Events of a vehicle that wait for its thread; a client has at most 512 under way.",
        range: Some((16, 65_536)),
    },
    Setting {
        name: "incoming_bytes",
        meaning: "Bytes of payload that wait for a vehicle's thread.",
        range: Some((4 * 1024 * 1024, 1024 * 1024 * 1024)),
    },
    Setting {
        name: "ahead_bytes",
        meaning: "Bytes of a vehicle's events that wait for a missing one; beyond it they are refused as \
                  `overloaded` and sent again.",
        range: Some((4 * 1024 * 1024, 1024 * 1024 * 1024)),
    },
    Setting {
        name: "outgoing_messages",
        meaning: "Publications of a vehicle that wait for a client that does not read; beyond it they are \
                  left out, and counted in the log.",
        range: Some((64, 65_536)),
    },
    Setting {
        name: "max_questions_in_flight",
        meaning: "Questions of a vehicle, but for `rpc/mission` and `rpc/ingest`, that wait, are being \
                  computed or whose answer is being sent; beyond it they are answered `overloaded` at once.",
        range: Some((1, 1024)),
    },
    Setting {
        name: "max_status_questions",
        meaning: "The same for `rpc/mission` and `rpc/ingest`.",
        range: Some((1, 1024)),
    },
    Setting { name: "max_commands", meaning: "The same for commands.", range: Some((1, 1024)) },
    Setting {
        name: "wait_ms",
        meaning: "Time that a question with `after=` and no `deadline_ms` waits for its event, ms.",
        range: Some((1, 600_000)),
    },
    Setting {
        name: "planner_threads",
        meaning: "Threads that evaluate questions, for all vehicles; 0: the cores less one, at least one.",
        range: Some((0, 256)),
    },
    Setting {
        name: "max_missions",
        meaning: "Missions that a vehicle keeps, the current one included; beyond it the one that ended \
                  first is forgotten.",
        range: Some((1, 1024)),
    },
    Setting {
        name: "max_events",
        meaning: "Events of a mission, applied and refused.",
        range: Some((1, 1_000_000_000)),
    },
    Setting {
        name: "max_keyframes",
        meaning: "Keyframes of a mission; the contract allows no more than its default.",
        range: Some((1, limits::MAX_KEYFRAMES)),
    },
    Setting {
        name: "max_factors",
        meaning: "Factors of a mission; the contract allows no more than its default.",
        range: Some((1, limits::MAX_FACTORS)),
    },
    Setting {
        name: "max_factors_per_keyframe",
        meaning: "Factors that name one keyframe; they bound the cost of a single elimination step.",
        range: Some((8, 65_536)),
    },
    Setting {
        name: "max_cells",
        meaning: "Cells of the coverage rasters of a mission; the contract allows no more than its default.",
        range: Some((1, limits::MAX_COVERAGE_CELLS)),
    },
    Setting {
        name: "drain_ms",
        meaning: "Time that a shutdown takes at most; three quarters of it are for finishing what has been \
                  accepted, ms.",
        range: Some((100, 60_000)),
    },
    Setting {
        name: "state_dir",
        meaning: "Directory of the journals, one file a mission, from which missions come back after any end \
                  of pdnd; made if need be, and locked against a second daemon. Empty: nothing is kept, and \
                  an acknowledged event is one that was applied.",
        range: None,
    },
    Setting {
        name: "sync_events",
        meaning: "Events of a vehicle after which the journal is synced; commands and decisions are synced \
                  at once.",
        range: Some((1, 8192)),
    },
    Setting {
        name: "sync_ms",
        meaning: "Time after which an event is synced at the latest, ms.",
        range: Some((1, 10_000)),
    },
    Setting {
        name: "log_format",
        meaning: "Log lines on standard error: \"human\" or \"json\".",
        range: None,
    },
    Setting {
        name: "log_level",
        meaning: "Least level that is logged: \"error\", \"warn\", \"info\", \"debug\", \"trace\", or a \
                  filter such as \"info,pdnd=debug\".",
        range: None,
    },
];

/// The text of `deploy/pdnd.toml`: every setting with its meaning, range and default.
pub fn document() -> String {
    let defaults = toml::Table::try_from(Settings::default()).expect("the defaults are plain values");
    let mut text = String::from(
        "# Every setting of pdnd with its default. The later wins: default, this file (pdnd --config FILE), \
         the\n# environment (PDN_ and the name in capitals, such as PDN_MAX_VEHICLES=4), flags.\n\
         # Check an edited file with: pdnd check-config FILE\n",
    );
    for setting in SETTINGS {
        let value = &defaults[setting.name];
        text.push('\n');
        for line in wrapped(setting.meaning) {
            text.push_str(&format!("# {line}\n"));
        }
        if let Some((least, greatest)) = setting.range {
            text.push_str(&format!("# Range: {least} to {greatest}.\n"));
        }
        text.push_str(&format!("{} = {value}\n", setting.name));
    }
    text
}

fn wrapped(text: &str) -> Vec<String> {
    const WIDTH: usize = 100;
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let line = lines.last_mut().expect("there is always a line");
        if !line.is_empty() && line.len() + 1 + word.len() > WIDTH {
            lines.push(word.to_owned());
        } else {
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    /// `deploy/pdnd.toml` is what a person edits: it must list every setting, once, with its default, meaning
    /// and range.
    #[test]
    fn the_file_lists_every_setting_with_its_default() {
        let text = include_str!("../../../deploy/pdnd.toml");
        let table: toml::Table = text.parse().unwrap();
        let names: Vec<_> = SETTINGS.iter().map(|setting| setting.name).collect();
        assert_eq!(table.keys().map(String::as_str).collect::<Vec<_>>(), {
            let mut sorted = names.clone();
            sorted.sort_unstable();
            sorted
        });
        assert_eq!(Settings::deserialize(table).unwrap(), Settings::default());
        assert_eq!(text, document(), "write it anew: pdnd config > deploy/pdnd.toml");
    }

    #[test]
    fn every_field_is_listed() {
        let table = toml::Table::try_from(Settings::default()).unwrap();
        let mut listed: Vec<_> = SETTINGS.iter().map(|setting| setting.name).collect();
        listed.sort_unstable();
        assert_eq!(table.keys().map(String::as_str).collect::<Vec<_>>(), listed);
    }
}
