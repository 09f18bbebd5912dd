//! `schemas/journal.md`.

use super::head;
use pdn_schemas::record::{
    Bounds, CommandTaken, Configured, DecisionTaken, JOURNAL_FORMAT, Kind, Reopened, UnreadEvent,
};
use pdn_schemas::registry::kind_layout_hash;
use schemars::{Schema, schema_for};
use std::fmt::Write;

const FILE: &str = "\
`<state-dir>/<vehicle>/<number>-<mission>.redb`, one file a mission; the number counts the missions of the
vehicle, and the greatest is the current one. It is a [redb](https://docs.rs/redb) file with three tables:

| table | key | value |
|---|---|---|
| `header` | `format`, `identity`, `vehicle`, `mission`, `software` | text: the format's version, \
  a number drawn when the journal was made (hexadecimal), ids, what made it |
| `layouts` | name of a message or record | hash of its layout when the journal was made: those of one \
  generation |
| `records` | number of the record, from 0 without gaps | a frame |

A frame, little-endian:

| bytes | what |
|---|---|
| 0 to 3 | `PDJ1` |
| 4 to 11 | the journal's identity |
| 12 to 19 | number of the record |
| 20 to 23 | how often the journal has been opened for writing |
| 24 to 27 | kind |
| 28 to 31 | length n of the payload |
| 32 to 35 | CRC-32 of the layouts by which this payload was written: of each kind's hash, as eight bytes, \
  in the order of numbers |
| 36 to 39 | CRC of the record before, 0 for the first |
| 40 to 39 + n | payload: the message in bincode, as on the wire |
| 4 more | CRC-32 (IEEE) of everything before |

So a record is found and judged without the tables around it, and each holds fast the one before it.
";

const RULES: &str = "\
- A command, a configuration and a decision are synced before they are answered; events after `sync_events` of
  them or `sync_ms` (settings of pdnd), and `durable_seq` follows the last sync. A sync is a two-phase commit:
  what is valid was whole before.
- The state of a mission is the fold of its records, bit for bit. `refused` and `turned_away` follow from the
  others or change nothing; the first are compared when a journal is read, by event and code, and a
  difference is told.
- At its start pdnd recovers every journal; a mission that was under way is `held` until someone resumes.
  Records that a crash left written but not committed are taken over if they are whole and follow on the last.
- What earlier versions wrote is read as any other, and gone on with: the layouts of each generation stand in
  `schemas/history`, each frame names those by which it was written, and what is appended has the present
  ones. A field that has come since has its default, or what was so before it came.
- A journal that is damaged, of another format or with layouts of no generation is left as it is and told,
  with the number of the record; nothing of it is guessed. `pdnd recover FILE` writes what is whole up to
  the damage to a new file.
- Beside a journal may lie `<number>-<mission>.checkpoint`: what has been solved for, so that a restart need
  not solve again. It names the journal, the record and the CRC before it, the version and its layouts; one
  that does not fit is passed over, with the same outcome. It may be removed.
- `pdnd journal FILE` tells what a journal says, `--json` record by record; `pdnd replay FILE` takes its
  decisions again. Neither changes the file. While a daemon has it open only a copy can be read.
";

pub(super) fn journal() -> String {
    let mut text = head("The journal");
    let _ = write!(
        text,
        "What a mission was told, what it refused and what it decided, in order; format {JOURNAL_FORMAT}.\n\n\
         ## The file\n\n{FILE}\n\
         ## What holds\n\n{RULES}\n## Kinds\n\n\
         | number | kind | payload | layout | what it says |\n|---|---|---|---|---|\n"
    );
    for kind in Kind::ALL {
        let _ = writeln!(
            text,
            "| {} | `{}` | {} | `{:016x}` | {} |",
            kind.number(),
            kind.name(),
            kind.schema(),
            kind_layout_hash(*kind),
            kind.meaning()
        );
    }
    text += "\n## Records that do not travel\n\nThe others are in [messages.md](messages.md).\n";
    let records = [
        schema_for!(Configured),
        schema_for!(Bounds),
        schema_for!(UnreadEvent),
        schema_for!(CommandTaken),
        schema_for!(DecisionTaken),
        schema_for!(Reopened),
    ];
    records.iter().for_each(|schema| record(schema, &mut text));
    text
}

fn record(schema: &Schema, text: &mut String) {
    let said =
        |value: &serde_json::Value| value["description"].as_str().unwrap_or_default().replace('\n', " ");
    let schema = schema.as_value();
    let title = schema["title"].as_str().unwrap_or_default();
    let _ = write!(text, "\n### {title}\n\n{}\n\n| field | meaning |\n|---|---|\n", said(schema));
    for (name, field) in schema["properties"].as_object().into_iter().flatten() {
        let _ = writeln!(text, "| `{name}` | {} |", said(field));
    }
}
