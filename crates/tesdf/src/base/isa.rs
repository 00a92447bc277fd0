/// Instruction set that the kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

impl Isa {
    /// The widest instruction set of this processor.
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::is_x86_feature_detected as has;
            if has!("avx2") && has!("fma") {
                return if has!("avx512f") && has!("avx512vl") { Self::Avx512 } else { Self::Avx2 };
            }
        }
        Self::Baseline
    }

    /// All instruction sets of this processor, for tests of each.
    #[cfg(test)]
    pub(crate) fn all_here() -> Vec<Self> {
        let mut all = vec![Self::Baseline];
        #[cfg(target_arch = "x86_64")]
        if Self::detect() != Self::Baseline {
            all.extend([Self::Avx2, Self::detect()]);
        }
        all
    }
}
