//! Bolts and nuts.
use tesdf_parts::{PartError, Resolution, Size, Thread, ThreadRows};

use super::{Common, Made, Make, mm};
use crate::terminal::parse;

/// Arguments of `tesdf part bolt`.
#[derive(clap::Args, Debug)]
pub struct Bolt {
    /// Size, from M3 to M36
    #[arg(long, default_value = "M16")]
    pub size: Size,
    /// Pitch of a fine thread [default: the coarse pitch of ISO 261]
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres)]
    pub pitch: Option<f64>,
    /// From the tip to the head [default: the shortest length of ISO 4014]
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres)]
    pub length: Option<f64>,
    /// Length of the full thread [default: that of ISO 4014, at most what the length leaves]
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres)]
    pub thread_length: Option<f64>,
    /// Distance by which the thread is smaller in radius than the basic profile; the gap normal to
    /// the flanks is half of it
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "0mm")]
    pub clearance: f64,
    /// Width across flats [default: that of ISO 4014 and 4032]
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres)]
    pub across_flats: Option<f64>,
    /// Rows of faces of the thread
    #[arg(long, value_name = "ROWS", value_parser = parse::named::<ThreadRows>(), default_value_t)]
    pub thread_rows: ThreadRows,
    /// Output and resolution.
    #[command(flatten)]
    pub common: Common,
}

impl Make for Bolt {
    fn make(&self, resolution: Resolution) -> Result<Made, PartError> {
        let mut bolt = tesdf_parts::Bolt::iso_4014(self.size);
        bolt.thread.pitch = self.pitch.unwrap_or(bolt.thread.pitch);
        bolt.length = self.length.unwrap_or(bolt.length);
        let longest = tesdf_parts::Bolt::iso_thread_length(&bolt.thread, bolt.length);
        bolt.thread_length = self.thread_length.unwrap_or(longest);
        bolt.clearance = self.clearance;
        bolt.across_flats = self.across_flats.unwrap_or(bolt.across_flats);
        bolt.rows = self.thread_rows;
        let mut facts = thread(&bolt.thread, bolt.clearance);
        facts.push(("thread length", format!("{} mm", mm(bolt.thread_length))));
        Ok(Made { solid: bolt.mesh(resolution)?, facts })
    }
}

/// Arguments of `tesdf part nut`.
#[derive(clap::Args, Debug)]
pub struct Nut {
    /// Size, from M3 to M36
    #[arg(long, default_value = "M16")]
    pub size: Size,
    /// Pitch of a fine thread [default: the coarse pitch of ISO 261]
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres)]
    pub pitch: Option<f64>,
    /// Height [default: the largest of ISO 4032]
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres)]
    pub height: Option<f64>,
    /// Distance by which the thread is larger in radius than the basic profile; the gap normal to
    /// the flanks is half of it [default: 1/40 of the pitch]
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres)]
    pub clearance: Option<f64>,
    /// Width across flats [default: that of ISO 4014 and 4032]
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres)]
    pub across_flats: Option<f64>,
    /// Rows of faces of the thread
    #[arg(long, value_name = "ROWS", value_parser = parse::named::<ThreadRows>(), default_value_t)]
    pub thread_rows: ThreadRows,
    /// Output and resolution.
    #[command(flatten)]
    pub common: Common,
}

impl Make for Nut {
    fn make(&self, resolution: Resolution) -> Result<Made, PartError> {
        let mut nut = tesdf_parts::Nut::iso_4032(self.size);
        nut.thread.pitch = self.pitch.unwrap_or(nut.thread.pitch);
        nut.height = self.height.unwrap_or(nut.height);
        nut.across_flats = self.across_flats.unwrap_or(nut.across_flats);
        nut.rows = self.thread_rows;
        nut.clearance = self.clearance.unwrap_or(nut.thread.pitch / 40.0);
        let facts = thread(&nut.thread, nut.clearance);
        Ok(Made { solid: nut.mesh(resolution)?, facts })
    }
}

fn thread(thread: &Thread, clearance: f64) -> Vec<(&'static str, String)> {
    vec![
        ("thread", format!("M{} × {}, right-handed", mm(thread.diameter), mm(thread.pitch))),
        (
            "clearance",
            format!("{} mm in radius, {} mm normal to the flanks", mm(clearance), mm(clearance / 2.0)),
        ),
    ]
}
