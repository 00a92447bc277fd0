//! Gears, sleeves and shafts.
use tesdf_parts::{Bore, Hub, Keyway, PartError, Profile, Resolution, Section, Spline, Teeth};

use super::{Common, Made, Make, mm};
use crate::terminal::parse;

/// The dog teeth of gears and sleeves.
#[derive(clap::Args, Debug)]
pub struct DogTeeth {
    /// Radius of the inner ends of the dog teeth
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "15mm")]
    pub dog_inner: f64,
    /// Radius of the outer ends of the dog teeth
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "20mm")]
    pub dog_outer: f64,
    /// Height of the dog teeth
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "3mm")]
    pub dog_height: f64,
    /// Gap between the sides of engaged dog teeth, along their mean circle
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "0.5mm")]
    pub dog_clearance: f64,
}

impl DogTeeth {
    fn dogs(&self, count: usize) -> tesdf_parts::Dogs {
        tesdf_parts::Dogs {
            count,
            inner_radius: self.dog_inner,
            outer_radius: self.dog_outer,
            height: self.dog_height,
            clearance: self.dog_clearance,
        }
    }
}

/// Arguments of `tesdf part gear`.
#[derive(clap::Args, Debug)]
pub struct Gear {
    /// Pitch diameter per tooth
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "2mm")]
    pub module: f64,
    /// Number of teeth
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub teeth: usize,
    /// Profile shift, in modules; with fewer than 18 teeth it must be above 0
    #[arg(long, value_name = "X", value_parser = parse::number, allow_hyphen_values = true, default_value_t = 0.0)]
    pub profile_shift: f64,
    /// Length by which each tooth is thinner along the pitch circle; a pair has the sum of both
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "50um")]
    pub backlash: f64,
    /// Width of the teeth
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "12mm")]
    pub width: f64,
    /// Diameter of the bore; 0 for none
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "10mm")]
    pub bore: f64,
    /// Splined bore instead of a round one, for a shaft with this many teeth, minor diameter, major
    /// diameter and width of its teeth, such as "6 23mm 26mm 6mm"
    #[arg(long, value_name = "\"N MINOR MAJOR WIDTH\"", value_parser = spline, conflicts_with = "bore")]
    pub spline: Option<Spline>,
    /// Gap between splined bore and shaft
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "50um")]
    pub spline_clearance: f64,
    /// Diameter and height of a hub on the upper face, such as "44mm 4mm"
    #[arg(long, value_name = "\"DIAMETER HEIGHT\"", value_parser = hub)]
    pub hub: Option<Hub>,
    /// Number of dog teeth on the hub or on the upper face
    #[arg(long, value_name = "N")]
    pub dogs: Option<usize>,
    /// The dog teeth.
    #[command(flatten)]
    pub dog_teeth: DogTeeth,
    /// Output and resolution.
    #[command(flatten)]
    pub common: Common,
}

impl Make for Gear {
    fn make(&self, resolution: Resolution) -> Result<Made, PartError> {
        let teeth = Teeth {
            module: self.module,
            count: self.teeth,
            profile_shift: self.profile_shift,
            backlash: self.backlash,
        };
        let round = (self.bore != 0.0).then_some(Bore::Round { diameter: self.bore });
        let splined = self.spline.map(|spline| Bore::Splined { spline, clearance: self.spline_clearance });
        let gear = tesdf_parts::Gear {
            teeth,
            width: self.width,
            bore: splined.or(round),
            hub: self.hub,
            dogs: self.dogs.map(|count| self.dog_teeth.dogs(count)),
        };
        let [root, pitch, tip] =
            [teeth.root_radius(), teeth.pitch_radius(), teeth.tip_radius()].map(|radius| mm(2.0 * radius));
        let facts = vec![("diameters", format!("root {root}, pitch {pitch}, tip {tip} mm"))];
        Ok(Made { solid: gear.mesh(resolution)?, facts })
    }
}

/// Arguments of `tesdf part sleeve`.
#[derive(clap::Args, Debug)]
pub struct Sleeve {
    /// Diameter of the body
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "44mm")]
    pub diameter: f64,
    /// Length of the body without dog teeth
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "16mm")]
    pub width: f64,
    /// Splined bore, for a shaft with this many teeth, minor diameter, major diameter and width of
    /// its teeth (ISO 14)
    #[arg(long, value_name = "\"N MINOR MAJOR WIDTH\"", value_parser = spline, default_value = "6 23mm 26mm 6mm")]
    pub spline: Spline,
    /// Gap between bore and shaft
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "50um")]
    pub spline_clearance: f64,
    /// Width of the groove for the fork
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "6mm")]
    pub groove_width: f64,
    /// Depth of the groove
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "4mm")]
    pub groove_depth: f64,
    /// Number of dog teeth on each end
    #[arg(long, value_name = "N", default_value_t = 6)]
    pub dogs: usize,
    /// The dog teeth.
    #[command(flatten)]
    pub dog_teeth: DogTeeth,
    /// Output and resolution.
    #[command(flatten)]
    pub common: Common,
}

impl Make for Sleeve {
    fn make(&self, resolution: Resolution) -> Result<Made, PartError> {
        let sleeve = tesdf_parts::Sleeve {
            diameter: self.diameter,
            width: self.width,
            bore: Bore::Splined { spline: self.spline, clearance: self.spline_clearance },
            groove_width: self.groove_width,
            groove_depth: self.groove_depth,
            dogs: self.dog_teeth.dogs(self.dogs),
        };
        Ok(Made { solid: sleeve.mesh(resolution)?, facts: Vec::new() })
    }
}

/// Arguments of `tesdf part shaft`.
#[derive(clap::Args, Debug)]
pub struct Shaft {
    /// A section, from below: "20mm 30mm" is a cylinder of this diameter and length, and "6 23mm
    /// 26mm 6mm 30mm" a spline (number of teeth, minor diameter, major diameter, width of the
    /// teeth) of this length; may be given several times [default: five sections, the last one with
    /// a keyway]
    #[arg(long = "section", value_name = "\"DIAMETER LENGTH\"", value_parser = section)]
    pub sections: Vec<Section>,
    /// A keyway with round ends: number of its section (from 0), width, depth, length, and distance
    /// from the beginning of the section; may be given several times
    #[arg(long = "keyway", value_name = "\"SECTION WIDTH DEPTH LENGTH START\"", value_parser = keyway)]
    pub keyways: Vec<(usize, Keyway)>,
    /// Width of the chamfers at both ends
    #[arg(long, value_name = "LENGTH", value_parser = parse::metres, default_value = "1mm")]
    pub chamfer: f64,
    /// Output and resolution.
    #[command(flatten)]
    pub common: Common,
}

impl Make for Shaft {
    fn make(&self, resolution: Resolution) -> Result<Made, PartError> {
        let mut sections = match self.sections.is_empty() {
            true if self.keyways.is_empty() => tesdf_parts::Shaft::example().sections,
            _ => self.sections.clone(),
        };
        let last = sections.len().saturating_sub(1);
        for &(number, keyway) in &self.keyways {
            let wrong = |expected: String| PartError::Parameter {
                name: "section of a keyway",
                found: number.to_string(),
                expected,
            };
            match sections.get_mut(number) {
                Some(section @ Section { profile: Profile::Round { .. }, .. }) => {
                    *section = section.with_keyway(keyway);
                }
                Some(_) => return Err(wrong("a cylinder without a keyway".into())),
                None => return Err(wrong(format!("0 to {last}, the number of a --section"))),
            }
        }
        let length: f64 = sections.iter().map(|section| section.length).sum();
        let facts = vec![("sections", format!("{} over {} mm", sections.len(), mm(length)))];
        let shaft = tesdf_parts::Shaft { sections, chamfer: self.chamfer };
        Ok(Made { solid: shaft.mesh(resolution)?, facts })
    }
}

/// Parses a spline as number of teeth, minor diameter, major diameter and width.
fn spline(text: &str) -> Result<Spline, String> {
    let expected = "a number of teeth and three lengths, such as \"6 23mm 26mm 6mm\"";
    let words = parse::words(text);
    let (count, lengths) = words.split_first().ok_or(format!("nothing; expected {expected}"))?;
    let count = count.parse().map_err(|_| format!("{count}: not a number of teeth; expected {expected}"))?;
    let [minor_diameter, major_diameter, width] = parse::all_metres(lengths, expected)?;
    Ok(Spline { count, minor_diameter, major_diameter, width })
}

fn hub(text: &str) -> Result<Hub, String> {
    let [diameter, height] = parse::all_metres(&parse::words(text), "two, \"DIAMETER HEIGHT\"")?;
    Ok(Hub { diameter, height })
}

fn section(text: &str) -> Result<Section, String> {
    let words = parse::words(text);
    if let [teeth @ .., length] = words.as_slice()
        && teeth.len() == 4
    {
        let length = parse::metres(length).map_err(|e| format!("{length}: {e}"))?;
        return Ok(Section::splined(spline(&teeth.join(" "))?, length));
    }
    let expected = "two, \"DIAMETER LENGTH\", or \"N MINOR MAJOR WIDTH LENGTH\"";
    let [diameter, length] = parse::all_metres(&words, expected)?;
    Ok(Section::round(diameter, length))
}

fn keyway(text: &str) -> Result<(usize, Keyway), String> {
    let expected = "the number of a section and four lengths, such as \"4 5mm 3mm 19mm 5mm\"";
    let words = parse::words(text);
    let (number, lengths) = words.split_first().ok_or(format!("nothing; expected {expected}"))?;
    let number = number.parse().map_err(|_| format!("{number}: not a number; expected {expected}"))?;
    let [width, depth, length, start] = parse::all_metres(lengths, expected)?;
    Ok((number, Keyway { width, depth, length, start }))
}
