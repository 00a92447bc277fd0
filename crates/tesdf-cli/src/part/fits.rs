//! Pegs and holes, chain links and spools.
use tesdf_parts::{ChainLink, Groove, LobedHole, LobedPeg, Lobes, PartError, Resolution};

use super::{Common, Made, Make, mm};
use crate::terminal::parse;

/// The cross-section of peg and hole.
#[derive(clap::Args, Debug)]
pub struct CrossSection {
    /// Mean radius of the peg
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "8mm")]
    pub radius: f64,
    /// Height of the lobes above the mean radius
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "0.6mm")]
    pub amplitude: f64,
    /// Number of lobes
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub lobes: usize,
    /// Width of the chamfers
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "1mm")]
    pub chamfer: f64,
}

impl CrossSection {
    fn lobes(&self) -> Lobes {
        Lobes { radius: self.radius, amplitude: self.amplitude, count: self.lobes }
    }
}

/// Arguments of `tesdf part peg`.
#[derive(clap::Args, Debug)]
pub struct Peg {
    /// The cross-section.
    #[command(flatten)]
    pub section: CrossSection,
    /// Length
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "40mm")]
    pub length: f64,
    /// Output and resolution.
    #[command(flatten)]
    pub common: Common,
}

impl Make for Peg {
    fn make(&self, resolution: Resolution) -> Result<Made, PartError> {
        let peg =
            LobedPeg { lobes: self.section.lobes(), length: self.length, chamfer: self.section.chamfer };
        Ok(Made { solid: peg.mesh(resolution)?, facts: Vec::new() })
    }
}

/// Arguments of `tesdf part hole`.
#[derive(clap::Args, Debug)]
pub struct Hole {
    /// The cross-section.
    #[command(flatten)]
    pub section: CrossSection,
    /// Distance of the hole from the peg
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "0.1mm")]
    pub clearance: f64,
    /// Depth of the hole
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "25mm")]
    pub depth: f64,
    /// Thickness below the hole
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "5mm")]
    pub floor: f64,
    /// Radius of the block
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "16mm")]
    pub outer_radius: f64,
    /// Output and resolution.
    #[command(flatten)]
    pub common: Common,
}

impl Make for Hole {
    fn make(&self, resolution: Resolution) -> Result<Made, PartError> {
        let hole = LobedHole {
            lobes: self.section.lobes(),
            clearance: self.clearance,
            depth: self.depth,
            floor: self.floor,
            outer_radius: self.outer_radius,
            chamfer: self.section.chamfer,
        };
        let facts = vec![("clearance", format!("{} mm", mm(self.clearance)))];
        Ok(Made { solid: hole.mesh(resolution)?, facts })
    }
}

/// The dimensions of a chain link.
#[derive(clap::Args, Debug)]
pub struct Wire {
    /// Diameter of the wire of a link
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "5mm")]
    pub wire: f64,
    /// Length of the straight parts of a link
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "20mm")]
    pub straight: f64,
    /// Radius of the half circles of a link, to the middle of the wire
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "7mm")]
    pub bend_radius: f64,
}

impl Wire {
    fn link(&self) -> ChainLink {
        ChainLink { wire_diameter: self.wire, straight: self.straight, bend_radius: self.bend_radius }
    }
}

/// Arguments of `tesdf part link`.
#[derive(clap::Args, Debug)]
pub struct Link {
    /// The dimensions.
    #[command(flatten)]
    pub wire: Wire,
    /// Output and resolution.
    #[command(flatten)]
    pub common: Common,
}

impl Make for Link {
    fn make(&self, resolution: Resolution) -> Result<Made, PartError> {
        let link = self.wire.link();
        let facts = vec![("pitch", format!("{} mm from link to link of a tight chain", mm(link.pitch())))];
        Ok(Made { solid: link.mesh(resolution)?, facts })
    }
}

/// Arguments of `tesdf part spool`.
#[derive(clap::Args, Debug)]
pub struct Spool {
    /// Diameter of the drum
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "60mm")]
    pub drum: f64,
    /// Length of the drum between the flanges
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "50mm")]
    pub length: f64,
    /// Diameter of the flanges
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "90mm")]
    pub flange: f64,
    /// Thickness of each flange
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "5mm")]
    pub flange_thickness: f64,
    /// Diameter of the bore
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "12mm")]
    pub bore: f64,
    /// Cut a helical groove for a chain of --wire, --straight and --bend-radius, with this gap on
    /// each side of the links that stand in it
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres)]
    pub groove: Option<f64>,
    /// The chain of the groove.
    #[command(flatten)]
    pub wire: Wire,
    /// Output and resolution.
    #[command(flatten)]
    pub common: Common,
}

impl Make for Spool {
    fn make(&self, resolution: Resolution) -> Result<Made, PartError> {
        let groove = self.groove.map(|clearance| Groove::of_chain(&self.wire.link(), clearance));
        let spool = tesdf_parts::Spool {
            drum_diameter: self.drum,
            drum_length: self.length,
            flange_diameter: self.flange,
            flange_thickness: self.flange_thickness,
            bore_diameter: self.bore,
            groove,
        };
        let of_groove = |groove: Groove| {
            let [width, depth, pitch] = [groove.width, groove.depth, groove.pitch].map(mm);
            ("groove", format!("{width} mm wide, {depth} mm deep, {pitch} mm from turn to turn"))
        };
        Ok(Made { solid: spool.mesh(resolution)?, facts: groove.map(of_groove).into_iter().collect() })
    }
}
