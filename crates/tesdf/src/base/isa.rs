/// Instruction set that the kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Isa {
    /// Whatever the build targets.
    Baseline,
    /// AVX2 and FMA: eight lanes.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// The same eight lanes with the 32 registers of AVX-512, which the kernel needs not to spill.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Isa {
    /// The widest that this processor has.
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

    /// All that this processor has, for tests of each.
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
