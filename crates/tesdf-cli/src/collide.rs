//! `tesdf collide A.tesdf B.tesdf`: the contacts between two bodies.
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::Arc;

use serde::Serialize;
use tesdf::collide::{
    CoarseContact, CollideError, CollideOptions, Contact, Contacts, ContactsPer, FaceOptions, HiddenOverlap,
    Instance, InstanceId, Mode, ModeChoices, ModeName, PairReduction, Pose, Reduction, Scene, Statistics,
    TouchingFeatures, coarse_contacts, detect,
};
use tesdf::{Length, TeSdf};

use tesdf_sim::newton::Detect as _;

use crate::terminal::asset_file::{Assets, check_units};
use crate::terminal::device::{self, Choice};
use crate::terminal::parse;
use crate::terminal::report::{self, Failure, Outcome, count};
use crate::why;

/// Two posed bodies. Several commands share these arguments.
#[derive(clap::Args, Debug)]
pub struct Bodies {
    /// The .tesdf file of instance 0
    #[arg(value_parser = parse::input())]
    pub a: PathBuf,
    /// The .tesdf file of instance 1
    #[arg(value_parser = parse::input())]
    pub b: PathBuf,
    /// Pose of A, body to world: translation, then the unit quaternion x y z w
    #[arg(long, value_name = "\"tx ty tz qx qy qz qw\"", value_parser = parse::pose, allow_hyphen_values = true, default_value = "0 0 0 0 0 0 1", hide_default_value = true)]
    pub pose_a: Pose,
    /// Pose of B
    #[arg(long, value_name = "\"tx ty tz qx qy qz qw\"", value_parser = parse::pose, allow_hyphen_values = true, default_value = "0 0 0 0 0 0 1", hide_default_value = true)]
    pub pose_b: Pose,
}

impl Bodies {
    /// A scene of the two bodies, and their ids.
    ///
    /// # Errors
    /// A file cannot be opened, the units differ, or a pose is out of range.
    pub fn scene(&self) -> Result<(Scene, [InstanceId; 2]), Failure> {
        let mut assets = Assets::default();
        let [a, b] = [assets.open(&self.a)?, assets.open(&self.b)?];
        check_units([(self.a.as_path(), &*a), (self.b.as_path(), &*b)])?;
        let mut scene = Scene::new();
        let mut add = |asset: Arc<TeSdf>, pose: Pose| {
            let shape = scene.add_shape(asset).map_err(Failure::new)?;
            scene.add(Instance::new(shape, pose)).map_err(Failure::new)
        };
        let ids = [add(a, self.pose_a)?, add(b, self.pose_b)?];
        Ok((scene, ids))
    }
}

/// Arguments of `tesdf collide`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The two bodies.
    #[command(flatten)]
    pub bodies: Bodies,
    /// Features that are tested against the distance field of the other body
    #[arg(long, value_parser = parse::named::<ModeName>(), default_value_t = ModeName::Exact)]
    pub mode: ModeName,
    /// In the modes `face` and `exact`: one contact for each cell of the other body that a face
    /// meets; or for each face, with the extremes of flat contact; or of these, only the local
    /// minima over the surface [default: face]
    #[arg(long, value_name = "cell|face|minimum")]
    pub contacts_per: Option<ContactsPer>,
    /// Report contacts up to this signed distance, in the meshes' unit
    #[arg(long, value_name = "D", value_parser = parse::length, default_value_t = 0.0, allow_hyphen_values = true)]
    pub contact_distance: f64,
    /// In the modes `face` and `exact`: drop a contact when the cosine between the face's normal
    /// and the field's gradient is below this, or `off`
    #[arg(long, value_name = "C|off", value_parser = cosine, default_value = "off", allow_hyphen_values = true)]
    pub cos_theta: Cosine,
    /// Number of Frank-Wolfe iterations in the mode `face` [default: 16]
    #[arg(long, value_name = "K")]
    pub iterations: Option<u32>,
    /// Maximum error in the mode `exact`, in the meshes' unit [default: 1e-7 of the
    /// diagonal of the body with the field]
    #[arg(long, value_name = "T", value_parser = parse::number, allow_hyphen_values = true)]
    pub tolerance: Option<f64>,
    /// Maximum number of contacts of the pair, or `none` to keep all
    #[arg(long, value_name = "N|none", value_parser = reduction, default_value = "none")]
    pub reduce: Reduction,
    /// Find at most K contacts of the pair only, spread over the places that touch. The time
    /// follows K. The deepest contact may be missing
    #[arg(long, value_name = "K", conflicts_with = "reduce")]
    pub spread: Option<u32>,
    /// Where contacts are found
    #[arg(long, value_name = "DEVICE", value_parser = Choice::parse, default_value_t = Choice::Processor, conflicts_with = "why", help = device::help("contacts are found"))]
    pub device: Choice,
    /// Print why contacts exist or not instead: what each stage did with all candidates, or with
    /// one face (in the mode `node`, one vertex) of instance 0, or of either instance as
    /// INSTANCE:FACE
    #[arg(long, value_name = "FACE", value_parser = parse::part, num_args = 0..=1)]
    pub why: Option<Option<(u32, u32)>>,
    /// Print the contacts as a JSON array; with --why, print the reports
    #[arg(long)]
    pub json: bool,
    /// With --json: print an object instead, with the contacts, the statistics, the effect of the
    /// reduction, and the pairs that overlap without a contact (`hidden`)
    #[arg(long, requires = "json", conflicts_with = "why")]
    pub report: bool,
}

/// A contact in the output of `--json`.
#[derive(Serialize)]
struct Named<'a> {
    #[serde(flatten)]
    contact: &'a Contact,
    touching_features: TouchingFeatures,
}

/// The contacts that a detection in this scene found, with the features that touch.
fn named<'a>(found: &'a Contacts, scene: &Scene) -> Result<Vec<Named<'a>>, Failure> {
    let of = |contact: &'a Contact| {
        Ok(Named { contact, touching_features: contact.touching_features(scene).map_err(Failure::new)? })
    };
    found.iter().map(of).collect()
}

/// The output of `--json --report`.
#[derive(Serialize)]
struct Report<'a> {
    contacts: Vec<Named<'a>>,
    statistics: &'a Statistics,
    reductions: &'a [PairReduction],
    hidden: &'a [HiddenOverlap],
}

/// The threshold of the cosine filter; `None` when the filter is off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cosine(pub Option<f64>);

fn cosine(text: &str) -> Result<Cosine, String> {
    match text {
        "off" => Ok(Cosine(None)),
        _ => parse::number(text)
            .map(|c| Cosine(Some(c)))
            .map_err(|e| format!("{e}; expected a cosine, or off")),
    }
}

fn reduction(text: &str) -> Result<Reduction, String> {
    match text {
        "none" => Ok(Reduction::None),
        _ => text
            .parse()
            .map(Reduction::PerPair)
            .map_err(|_| format!("{text}: expected a number of contacts, or none")),
    }
}

impl Args {
    fn options(&self) -> Result<CollideOptions, CollideError> {
        let choices = ModeChoices {
            mode: Some(self.mode),
            contacts_per: self.contacts_per,
            iterations: self.iterations,
            tolerance: self.tolerance.map(Length::Absolute),
            cos_theta: self.cos_theta.0,
        };
        let options = CollideOptions {
            contact_distance: self.contact_distance,
            reduction: self.spread.map_or(self.reduce, Reduction::Spread),
            ..CollideOptions::with_mode(choices.mode(FaceOptions::default())?)
        };
        options.validate()?;
        Ok(options)
    }
}

/// Prints the contacts of two bodies.
///
/// # Errors
/// A file cannot be opened, an option is out of range, or stdout cannot be written.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let options = args.options().map_err(Failure::new)?;
    let (scene, ids) = args.bodies.scene()?;
    if let Some(part) = args.why {
        return why::run(&scene, ids, &options, part, args.json);
    }
    let found = match args.device.open()? {
        Some(device) => device.into_detector().detect(&scene, &options),
        None => detect(&scene, &options),
    };
    let found = found.map_err(Failure::new)?;
    warn_of(&found.hidden, options.mode);
    if options.mode == Mode::Node {
        let coarse = coarse_contacts(&scene, &options).map_err(Failure::new)?;
        warn_of_coarse(&coarse, |id| format!("instance {id}"), "use --mode exact --contacts-per face");
    }
    if args.report {
        let Contacts { statistics, reductions, hidden, .. } = &found;
        report::json(&Report { contacts: named(&found, &scene)?, statistics, reductions, hidden })?;
    } else if args.json {
        report::json(&named(&found, &scene)?)?;
    } else {
        report::text(&text(&found))?;
    }
    Ok(Outcome::Good)
}

/// Warns of pairs that overlap without a contact, and prints a hint.
fn warn_of(hidden: &[HiddenOverlap], mode: Mode) {
    for HiddenOverlap { instance_a, instance_b, depth } in hidden {
        report::warning(&format!(
            "instances {instance_a} and {instance_b} overlap by {depth:.3e} or more, and no contact shows it"
        ));
    }
    if !hidden.is_empty() {
        report::hint(match mode {
            Mode::Node => "the mode `node` only tests vertices: use --mode face or --mode exact",
            Mode::Face { .. } | Mode::Exact(_) => {
                "their surfaces hardly enter each other, as when both bodies have the same pose: `tesdf clearance` measures the \
                 overlap; move the bodies apart"
            }
        });
    }
}

/// Warns of faces that touch where the mode `node` does not look. `name` names an instance,
/// `instead` is the advice.
pub fn warn_of_coarse(coarse: &[CoarseContact], name: impl Fn(InstanceId) -> String, instead: &str) {
    for CoarseContact { instance_a, instance_b, face_a, corner_reach, .. } in coarse {
        let (a, b) = (name(*instance_a), name(*instance_b));
        report::warning(&format!(
            "face {face_a} of {a} touches {b}, and has points {corner_reach:.3e} from its vertices: the mode `node` only tests \
             vertices, and can miss where they touch"
        ));
    }
    if !coarse.is_empty() {
        report::hint(&format!("{instead}, or mesh the bodies more finely"));
    }
}

/// Number of contacts in the text output.
const SHOWN: usize = 10;

fn text(found: &Contacts) -> String {
    let s = &found.statistics;
    let mut text = format!(
        "{} of {} against {}\n",
        count(found.len(), "contact"),
        count(s.candidates, "candidate"),
        count(s.polygons, "cell")
    );
    if s.filtered + s.reduced > 0 {
        let _ = writeln!(text, "{} dropped by the cosine filter, {} by the reduction", s.filtered, s.reduced);
    }
    for r in &found.reductions {
        if let Some(above) = r.left_out_above {
            let _ =
                writeln!(text, "{} kept; no other contact is below {above:.6e}", count(r.kept, "contact"));
        }
        let _ = writeln!(
            text,
            "wrench error {:.3e} of {} kept of {}: a unit force on any contact can be replaced by forces on the kept \
             contacts whose force and torque differ by at most this; torques around ({}), divided by {:.6e}",
            r.wrench_error,
            r.kept,
            count(r.contacts, "contact"),
            report::point(r.center),
            r.length
        );
    }
    if s.unconverged > 0 {
        let _ = writeln!(text, "{} not proved to be within the tolerance", count(s.unconverged, "contact"));
    }
    let mut deepest: Vec<&Contact> = found.iter().collect();
    deepest.sort_by(|x, y| x.distance.total_cmp(&y.distance));
    if !deepest.is_empty() {
        text += "deepest first: distance, face of a, face of b, point on a, normal from b to a\n";
    }
    for c in deepest.iter().take(SHOWN) {
        let _ = writeln!(
            text,
            "{:>13.6e}  {}:{:<7} {}:{:<7} ({})  ({:.4} {:.4} {:.4})",
            c.distance,
            c.instance_a,
            c.face_a,
            c.instance_b,
            c.face_b,
            report::point(c.point_a),
            c.normal.x,
            c.normal.y,
            c.normal.z
        );
    }
    if deepest.len() > SHOWN {
        let _ = writeln!(text, "and {} more; --json prints all", deepest.len() - SHOWN);
    }
    text
}
