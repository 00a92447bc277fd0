//! The list of `tesdf devices`.
use crate::terminal::report::{self, Failure, Outcome};
use serde::Serialize;
use tesdf_gpu::{DeviceInfo, GpuError, devices};

use super::Args;

#[derive(Serialize)]
struct Row {
    number: usize,
    name: String,
    kind: String,
    plane: (u32, u32),
    plane_operations: bool,
    most_buffer_bytes: u64,
    timestamps: bool,
}

impl Row {
    fn new((number, info): (usize, DeviceInfo)) -> Self {
        Self {
            number,
            name: info.name,
            kind: info.kind.to_string(),
            plane: info.subgroup_size,
            plane_operations: info.has_subgroup_operations,
            most_buffer_bytes: info.max_buffer_bytes,
            timestamps: info.has_timestamps,
        }
    }
}

/// Prints the devices.
///
/// # Errors
/// There is no device, or stdout cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let rows: Vec<Row> = devices().into_iter().enumerate().map(Row::new).collect();
    if args.json {
        report::json(&rows)?;
    } else if rows.is_empty() {
        return Err(Failure::new(GpuError::NoDevice));
    } else {
        let mut text = String::new();
        for row in &rows {
            let (least, most) = row.plane;
            let plane = if least == most { least.to_string() } else { format!("{least} to {most}") };
            text += &format!(
                "{}  {}, {}, {plane} threads in lockstep, buffers of up to {} MiB\n",
                row.number,
                row.name,
                row.kind,
                row.most_buffer_bytes >> 20
            );
        }
        report::text(&text)?;
    }
    Ok(Outcome::Good)
}
