//! Opens arbitrary bytes as a run file. A run that opens can be read to its last step.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tesdf_sim::RunRecord;

fuzz_target!(|data: &[u8]| {
    let Ok(record) = RunRecord::from_bytes(data) else { return };
    for step in 0..record.times().len().min(64) {
        for body in 0..4 {
            record.pose(step, body);
            record.velocity(step, body);
        }
    }
    record.contacts().take(64).for_each(drop);
    assert!(record.warnings().iter().all(|warning| warning.count > 0));
    record.nearest_step(0.5);
    record.nearest_contacts(0.5);
});
