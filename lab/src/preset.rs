//! The presets of the encoder that benchmarks compare.
use clap::ValueEnum;
use tesdf::encode::EncodeOptions;

/// The encoder's presets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Preset {
    /// Few faces per query
    Default,
    /// Fast to encode
    Fast,
    /// Small files
    Compact,
    /// Lists that fill the 32 threads of a GPU
    Gpu,
}

impl Preset {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::Fast => "fast",
            Self::Compact => "compact",
            Self::Gpu => "gpu",
        }
    }

    /// The options of the encoder.
    pub fn options(self) -> EncodeOptions {
        EncodeOptions::preset(match self {
            Self::Default => tesdf::encode::Preset::Default,
            Self::Fast => tesdf::encode::Preset::Fast,
            Self::Compact => tesdf::encode::Preset::Compact,
            Self::Gpu => tesdf::encode::Preset::Gpu,
        })
    }
}
