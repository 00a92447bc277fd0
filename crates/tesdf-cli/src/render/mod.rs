//! `tesdf render BODY... -o out.png` and `tesdf render --run RUN -o out.png`: a picture of a scene,
//! optionally cut open.
//!
//! [`render`] takes bodies with their poses ([`Drawn`]), the removed space ([`Cut`]), contacts and
//! a [`View`], and returns a picture. Rays find the surface in the encoded mesh, and its distances
//! give shadows and ambient occlusion.
mod body;
mod camera;
mod cut;
mod light;
mod overlay;
mod picture;
mod run_file;
mod stage;

use std::path::PathBuf;

use tesdf::collide::{Placement, Pose, Shape};
use tesdf::glam::DVec3;
use tesdf::save::Destination;

pub use body::{BodyName, body_name, open};
pub use camera::View;
pub use cut::{Cut, HalfSpace};
pub use overlay::ContactMark;
pub use picture::{Scenery, render};
pub use stage::{Drawn, Exposure};
pub use tesdf_playback::{Linear, linear, of_body};

use crate::terminal::output::{self, Consent};
use crate::terminal::parse;
use crate::terminal::report::{Failure, Outcome};

/// Why a picture cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The size of the picture is out of range.
    #[error("a picture of {}x{} pixels; expected {min} to {max} each", .0[0], .0[1], min = picture::SIZES.start(), max = picture::SIZES.end())]
    Size([u32; 2]),
    /// There is not enough memory to draw the picture.
    #[error("no memory is left for a picture of {}x{} pixels; draw a smaller one", .0[0], .0[1])]
    Memory([u32; 2]),
    /// The scene has only planes, or coordinates that overflow.
    #[error("nothing to fit the picture to; add a body that is not a plane")]
    Nothing,
    /// The PNG cannot be encoded.
    #[error("the picture cannot be encoded: {0}")]
    Encode(String),
}

/// Arguments of `tesdf render`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// A .tesdf file, or plane, box:HX,HY,HZ, sphere:R, capsule:HALF_HEIGHT,R,
    /// cylinder:HALF_HEIGHT,R
    #[arg(required_unless_present = "run", value_name = "BODY", value_parser = body_name)]
    pub bodies: Vec<BodyName>,
    /// Draw the bodies of this run, which `tesdf simulate` wrote
    #[arg(long, value_name = "RUN", value_parser = parse::input(), conflicts_with_all = ["bodies", "poses"])]
    pub run: Option<PathBuf>,
    /// Time in the run, s; the nearest step is drawn [default: the end of the run]
    #[arg(long, value_name = "SECONDS", value_parser = parse::number, allow_hyphen_values = true)]
    pub time: Option<f64>,
    /// Also draw the run's contacts, including gaps up to its contact distance, at the nearest step
    /// with recorded contacts
    #[arg(long)]
    pub contacts: bool,
    /// Replace the geometry of a body of the run by a .tesdf file, or by a mesh, which is encoded;
    /// may be given several times
    #[arg(long = "geometry", value_name = "BODY=FILE", value_parser = crate::simulate::geometry)]
    pub geometries: Vec<(String, PathBuf)>,
    /// Output PNG file; an existing file is replaced, a pipe or device is written to
    #[arg(short, long, value_name = "PNG", value_parser = parse::output())]
    pub output: PathBuf,
    /// Whether a read-only output is replaced.
    #[command(flatten)]
    pub consent: Consent,
    /// Translation and rotation of a body; one option per body, in their order [default: no body is
    /// moved]
    #[arg(long = "pose", value_name = "tx ty tz qx qy qz qw", value_parser = parse::pose, allow_hyphen_values = true)]
    pub poses: Vec<Pose>,
    /// Size of the picture, pixels
    #[arg(long, value_name = "WxH", value_parser = parse::size, default_value = "1200x800")]
    pub size: [u32; 2],
    /// Direction of the camera: degrees around the z axis, and degrees above the ground
    #[arg(long, value_name = "azimuth elevation", value_parser = parse::direction, default_value = "-60 25", allow_hyphen_values = true)]
    pub view: [f64; 2],
    /// Perspective with this field of view, in degrees [default: orthographic]
    #[arg(long, value_name = "DEGREES", value_parser = parse::field_of_view, allow_hyphen_values = true)]
    pub field_of_view: Option<f64>,
    /// Magnification relative to a picture that fits the scene
    #[arg(long, value_name = "FACTOR", value_parser = parse::factor, default_value = "1", allow_hyphen_values = true)]
    pub zoom: f64,
    /// The point in the middle of the picture [default: the middle of the scene]
    #[arg(long, value_name = "x y z", value_parser = parse::point, allow_hyphen_values = true)]
    pub target: Option<DVec3>,
    /// Remove the half space nx x + ny y + nz z > d and show the section; given twice, remove the
    /// intersection of both
    #[arg(long = "cut", value_name = "nx ny nz d", value_parser = half_space, allow_hyphen_values = true)]
    pub cuts: Vec<HalfSpace>,
    /// Bodies that are cut, by their index in the list, from 0 [default: all except planes]
    #[arg(long, value_name = "INDICES", value_delimiter = ',', requires = "cuts")]
    pub cut_bodies: Option<Vec<usize>>,
}

/// Parses a half space as `nx ny nz d`.
///
/// # Errors
/// The message names the number at fault.
fn half_space(text: &str) -> Result<HalfSpace, String> {
    let [x, y, z, offset] = parse::numbers(text, "four, \"nx ny nz d\"")?;
    HalfSpace::new(DVec3::new(x, y, z), offset)
        .ok_or_else(|| format!("the normal ({x}, {y}, {z}) has no direction"))
}

impl Args {
    /// The camera's position and projection.
    pub fn view(&self) -> View {
        let Self { view: [azimuth, elevation], field_of_view, zoom, target, .. } = *self;
        View { azimuth, elevation, field_of_view, zoom, target }
    }

    /// For each shape, whether the body is cut.
    fn exposures(&self, shapes: &[Shape]) -> Result<Vec<Exposure>, Failure> {
        if let Some(&place) = self.cut_bodies.iter().flatten().find(|&&place| place >= shapes.len()) {
            let last = shapes.len().saturating_sub(1);
            return Err(Failure::new(format!("--cut-bodies names {place}; the bodies are 0 to {last}")));
        }
        let is_cut = |(place, shape): (usize, &Shape)| match &self.cut_bodies {
            Some(places) => places.contains(&place),
            None => !matches!(shape, Shape::Plane),
        };
        let exposure = |cut| if cut { Exposure::Cut } else { Exposure::Whole };
        Ok(shapes.iter().enumerate().map(is_cut).map(exposure).collect())
    }
}

/// Draws the scene and saves it.
///
/// # Errors
/// A file cannot be opened, the options do not match each other, nothing can be drawn, or the file
/// cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let of_run = [
        ("--time", args.time.is_some()),
        ("--contacts", args.contacts),
        ("--geometry", !args.geometries.is_empty()),
    ];
    let (Posed { shapes, placements, contacts }, output) = match &args.run {
        Some(run) => run_file::posed(args, run)?,
        None => match of_run.iter().find(|(_, given)| *given) {
            Some((name, _)) => {
                return Err(Failure::new(format!("{name} only applies to a recorded run; add --run <RUN>")));
            }
            None => named(args)?,
        },
    };
    let exposures = args.exposures(&shapes)?;
    // Planes are grey and do not use up a colour of the palette.
    let mut colours = (0..).map(of_body);
    let bodies: Vec<Drawn> = shapes
        .iter()
        .zip(placements)
        .zip(exposures)
        .map(|((shape, placement), exposure)| Drawn {
            shape,
            placement,
            colour: match shape {
                Shape::Plane => linear([225; 3]),
                _ => colours.next().unwrap_or_default(),
            },
            exposure,
        })
        .collect();
    let cut = Cut(args.cuts.clone());
    let scenery = Scenery { bodies: &bodies, cut: &cut, contacts: &contacts };
    let map = render(&scenery, &args.view(), args.size).map_err(Failure::new)?;
    let png = map.encode_png().map_err(|e| Failure::new(RenderError::Encode(e.to_string())))?;
    output::write(&output, &png)?;
    Ok(Outcome::Good)
}

/// Bodies with their poses.
struct Posed {
    shapes: Vec<Shape>,
    /// The placement of each shape.
    placements: Vec<Placement>,
    contacts: Vec<ContactMark>,
}

/// The bodies on the command line, and the output file, which must not be one of them.
fn named(args: &Args) -> Result<(Posed, Destination), Failure> {
    if !args.poses.is_empty() && args.poses.len() != args.bodies.len() {
        let message = format!("--pose is given {} times for {} bodies", args.poses.len(), args.bodies.len());
        return Err(Failure::new(message).hint("give one for each body, in their order, or none"));
    }
    let files = args.bodies.iter().filter_map(|body| match body {
        BodyName::File(path) => Some(path.clone()),
        BodyName::Simple(_) => None,
    });
    let output = output::open(&args.output, &files.collect::<Vec<_>>(), args.consent)?;
    let shapes = open(&args.bodies)?;
    let poses = args.poses.iter().copied().chain(std::iter::repeat(Pose::IDENTITY));
    let placements = poses.take(shapes.len()).map(|pose| Placement { pose, scale: 1.0 }).collect();
    Ok((Posed { shapes, placements, contacts: Vec::new() }, output))
}
