//! Assets, distances, contacts and runs have the bytes of a table that is the same for all platforms:
//! every x86-64 processor here, 64-bit ARM in `.ci/arm.sh`, WebAssembly in `.ci/web.sh`.
//!
//! `GOLDEN=write` writes the table anew.
#[path = "golden/cases.rs"]
mod cases;

use tesdf::base::Isa;

const TABLE: &str = include_str!("golden/hashes.txt");

/// One test, because the instruction set holds for the whole program.
#[test]
fn every_instruction_set_gives_the_bytes_of_the_table() {
    if std::env::var("GOLDEN").is_ok_and(|value| value == "write") {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/hashes.txt");
        std::fs::write(path, cases::table()).expect("the table can be written");
        return;
    }
    for isa in Isa::of_processor() {
        isa.limit_to();
        let found = cases::table();
        let lines = found.lines().zip(TABLE.lines());
        let other: Vec<_> = lines.filter(|(found, expected)| found != expected).collect();
        assert!(other.is_empty() && found.lines().count() == TABLE.lines().count(), "{isa:?}: {other:#?}");
    }
}
