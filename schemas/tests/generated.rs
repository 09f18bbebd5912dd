//! What is checked in is what the types give.

use std::process::Command;

#[test]
fn generated_files_are_up_to_date() {
    let check = Command::new(env!("CARGO_BIN_EXE_pdn-schemas")).args(["generate", "--check"]).output();
    let check = check.expect("the generator starts");
    assert!(check.status.success(), "{}", String::from_utf8_lossy(&check.stderr));
}
