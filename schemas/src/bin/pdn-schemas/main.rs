//! Writes what is generated from the contract's types, or checks that it is up to date.
//!
//! ```text
//! pdn-schemas generate           write schemas/generated, schemas/*.md and the Python modules
//! pdn-schemas generate --check   write nothing; fail if a file would change or the layouts have changed
//! pdn-schemas release            keep the present layouts as a generation of schemas/history
//! ```

mod contract;
mod documents;
mod files;
mod golden;
mod python;

use contract::Contract;
use files::Files;
use std::process::ExitCode;

const USAGE: &str = "usage: pdn-schemas generate [--check] | pdn-schemas release";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["generate"] => generated().write(),
        ["generate", "--check"] => check(),
        ["release"] => released().write(),
        _ => Err(USAGE.to_owned()),
    };
    match outcome {
        Ok(summary) => {
            println!("{summary}");
            ExitCode::SUCCESS
        }
        Err(reason) => {
            eprintln!("{reason}");
            ExitCode::FAILURE
        }
    }
}

/// Every generated file.
fn generated() -> Files {
    let contract = Contract::extract();
    let mut files = Files::new(&["schemas/generated/golden", "schemas/generated/json-schema"]);
    files.add("schemas/generated/registry.json", contract.registry_json());
    for (message, schema) in contract.json_schemas() {
        if message == "Decision" {
            // What `pdn export` writes beside the decisions.
            files.add("client-py/src/pdn/wire/Decision.json", schema.clone());
        }
        files.add(format!("schemas/generated/json-schema/{message}.json"), schema);
    }
    golden::add_vectors(&mut files);
    documents::add(&contract, &mut files);
    python::add(&contract, &mut files);
    files
}

/// The present layouts, as a generation.
fn released() -> Files {
    let mut files = Files::new(&[]);
    let (path, layouts) = Contract::generation();
    files.add(path, layouts);
    files
}

fn check() -> Result<String, String> {
    let summary = generated().check()?;
    Contract::check_history()?;
    Ok(summary)
}
