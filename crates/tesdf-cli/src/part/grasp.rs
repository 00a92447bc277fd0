//! Gripper fingers and spoons.
use tesdf_parts::{PartError, Resolution};

use super::{Common, Made, Make};
use crate::terminal::parse;

/// Arguments of `tesdf part finger`.
#[derive(clap::Args, Debug)]
pub struct Finger {
    /// Length
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "60mm")]
    pub length: f64,
    /// Width
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "15mm")]
    pub width: f64,
    /// Thickness of the bar at its root, without the pad
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "12mm")]
    pub root_thickness: f64,
    /// Thickness of the bar at its tip, without the pad
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "7mm")]
    pub tip_thickness: f64,
    /// Length of the pad, from the tip on
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "20mm")]
    pub pad_length: f64,
    /// Height of the pad above the bar
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "2mm")]
    pub pad_height: f64,
    /// Depth of a groove of 90° across the pad; 0 for none
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "3mm")]
    pub groove_depth: f64,
    /// Diameter of two holes through the root; 0 for none
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "4mm")]
    pub hole: f64,
    /// Output and resolution.
    #[command(flatten)]
    pub common: Common,
}

impl Make for Finger {
    fn make(&self, resolution: Resolution) -> Result<Made, PartError> {
        let finger = tesdf_parts::Finger {
            length: self.length,
            width: self.width,
            root_thickness: self.root_thickness,
            tip_thickness: self.tip_thickness,
            pad_length: self.pad_length,
            pad_height: self.pad_height,
            groove_depth: self.groove_depth,
            hole_diameter: self.hole,
        };
        Ok(Made { solid: finger.mesh(resolution)?, facts: Vec::new() })
    }
}

/// Arguments of `tesdf part spoon`.
#[derive(clap::Args, Debug)]
pub struct Spoon {
    /// Length
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "160mm")]
    pub length: f64,
    /// Width of the bowl
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "40mm")]
    pub bowl_width: f64,
    /// Depth of the bowl
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "11mm")]
    pub bowl_depth: f64,
    /// Width of the handle at its thinnest
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "7mm")]
    pub handle_width: f64,
    /// Thickness of the bowl at its tip; the end of the handle is 2.75 times as thick
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "1.6mm")]
    pub thickness: f64,
    /// Output and resolution.
    #[command(flatten)]
    pub common: Common,
}

impl Make for Spoon {
    fn make(&self, resolution: Resolution) -> Result<Made, PartError> {
        let spoon = tesdf_parts::Spoon {
            length: self.length,
            bowl_width: self.bowl_width,
            bowl_depth: self.bowl_depth,
            handle_width: self.handle_width,
            thickness: self.thickness,
        };
        Ok(Made { solid: spoon.mesh(resolution)?, facts: Vec::new() })
    }
}
