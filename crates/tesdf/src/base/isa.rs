use std::sync::atomic::{AtomicU8, Ordering};

/// Instruction set that the kernels are compiled for, from the narrowest to the widest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Isa {
    /// The instruction set that the build targets.
    Baseline,
    /// AVX2 and FMA, with eight lanes.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// The same eight lanes with the 32 registers of AVX-512. The kernel needs them to avoid
    /// spilling.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

/// The number of the widest instruction set that [`Isa::detect`] returns.
static LIMIT: AtomicU8 = AtomicU8::new(u8::MAX);

impl Isa {
    /// The widest instruction set of this processor, within [`limit_to`](Self::limit_to).
    pub fn detect() -> Self {
        let limit = LIMIT.load(Ordering::Relaxed);
        let within = |isa: &&Self| **isa as u8 <= limit;
        Self::of_processor().iter().rfind(within).copied().unwrap_or(Self::Baseline)
    }

    /// Makes this process use this instruction set or a narrower one, for benchmarks of the
    /// narrower ones. It holds for assets that are opened, and meshes that are encoded, from now
    /// on.
    #[doc(hidden)]
    pub fn limit_to(self) {
        LIMIT.store(self as u8, Ordering::Relaxed);
    }

    /// All instruction sets of this processor, the widest last.
    #[doc(hidden)]
    pub fn of_processor() -> &'static [Self] {
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::is_x86_feature_detected as has;
            if has!("avx2") && has!("fma") {
                return if has!("avx512f") && has!("avx512vl") {
                    &[Self::Baseline, Self::Avx2, Self::Avx512]
                } else {
                    &[Self::Baseline, Self::Avx2]
                };
            }
        }
        &[Self::Baseline]
    }
}
