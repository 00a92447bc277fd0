//! Arguments of `tesdf-lab collide`.
use std::path::PathBuf;

use clap::ValueEnum;
use serde::Serialize;
use tesdf::collide::{CollideError, ContactsPer, Mode, ModeChoices, ModeName};
use tesdf_cli::terminal::device::{self, Choice};
use tesdf_cli::terminal::parse;

use tesdf::encode::Preset;

/// Arguments of `tesdf-lab collide`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Scene (.toml), run (.tesrun) whose poses are replayed, or file of poses (.json)
    #[arg(value_name = "SCENE|RUN|POSES")]
    pub source: PathBuf,
    /// Where contacts are found
    #[arg(long, value_name = "DEVICE", value_parser = Choice::parse, default_value_t = Choice::Best, help = device::help("contacts are found"))]
    pub device: Choice,
    /// Features that are tested against the distance field of the other body
    #[arg(long, value_parser = parse::named::<ModeName>(), default_value_t = ModeName::Face)]
    pub mode: ModeName,
    /// In the modes `face` and `exact`: one contact for each cell of the other body that a face
    /// meets; or for each face, with the extremes of flat contact; or of these, only the local
    /// minima over the surface [default: cell]
    #[arg(long, value_name = "cell|face|minimum")]
    pub contacts_per: Option<ContactsPer>,
    /// Number of Frank-Wolfe iterations in the mode `face` [default: 16]
    #[arg(long, value_name = "K")]
    pub iterations: Option<u32>,
    /// Threshold of the cosine filter in the modes `face` and `exact` [default: 0.3]
    #[arg(long, value_name = "C", value_parser = parse::number, allow_hyphen_values = true)]
    pub cos_theta: Option<f64>,
    /// Contacts are detected up to this signed distance [default: the distance in the file,
    /// otherwise 0]
    #[arg(long, value_name = "D", value_parser = parse::length)]
    pub contact_distance: Option<f64>,
    /// Preset of the encoder for the meshes of a file of poses
    #[arg(long, value_parser = parse::named::<Preset>(), default_value_t = Preset::Default)]
    pub preset: Preset,
    /// Maximum list length of meshes that are encoded for a file of poses [default: not truncated]
    #[arg(long, value_name = "E")]
    pub e_max: Option<u32>,
    /// Keep at most N contacts per pair of bodies
    #[arg(long, value_name = "N")]
    pub reduce: Option<u32>,
    /// Find at most K contacts per pair of bodies only, spread over the places that touch
    #[arg(long, value_name = "K", conflicts_with = "reduce")]
    pub spread: Option<u32>,
    /// Number of copies of the scene, each in its own world
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub worlds: u32,
    /// Maximum number of frames of a run or of a file of poses
    #[arg(long, value_name = "N", default_value_t = 16)]
    pub frames: usize,
    /// Number of measurements per frame
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub repeat: u32,
    /// Threads that process a polygon
    #[arg(long, value_enum, default_value_t = LanesName::Group)]
    pub lanes: LanesName,
    /// Exchange values through shared memory, even where subgroups of 32 threads are available
    #[arg(long)]
    pub shared: bool,
    /// Also detect on the processor, and print the ratio of the times
    #[arg(long)]
    pub against_cpu: bool,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

impl Args {
    /// The mode, by default with the options of the paper.
    ///
    /// # Errors
    /// An option of another mode.
    pub fn mode(&self) -> Result<Mode, CollideError> {
        let choices = ModeChoices {
            mode: Some(self.mode),
            contacts_per: self.contacts_per,
            iterations: self.iterations,
            cos_theta: self.cos_theta,
            ..ModeChoices::default()
        };
        choices.mode(Mode::PAPER.faces().copied().unwrap_or_default())
    }
}

/// Threads that process a polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LanesName {
    /// 32 threads, which divide the faces of the list among them
    Group,
    /// One thread
    Single,
}
