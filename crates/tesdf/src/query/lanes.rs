//! Several `f32` at once, with the operations that the distance kernel needs.
//!
//! No operations are fused: which faces are nearest, and so contacts, would depend on the processor.

/// `N` numbers.
pub trait Lanes<const N: usize>: Copy {
    /// The same number in all lanes.
    fn splat(x: f32) -> Self;
    /// Numbers with the given bits.
    fn from_bits(bits: [u32; N]) -> Self;
    /// Element `c` of the result has the `c`-th number of each of the `N` records.
    fn load(records: [&[f32; 16]; N]) -> [Self; 16];
    /// Difference.
    fn sub(self, o: Self) -> Self;
    /// Product.
    fn mul(self, o: Self) -> Self;
    /// Sum.
    fn add(self, o: Self) -> Self;
    /// The smaller number; `o` where either is NaN.
    fn min(self, o: Self) -> Self;
    /// The larger number; `o` where either is NaN.
    fn max(self, o: Self) -> Self;
    /// Mask of the lanes where `self ≥ o`; false where either is NaN.
    fn at_least(self, o: Self) -> Self;
    /// Mask of the lanes where `self < o`; false where either is NaN.
    fn less(self, o: Self) -> Self;
    /// Bitwise and.
    fn and(self, o: Self) -> Self;
    /// Bitwise or.
    fn or(self, o: Self) -> Self;
    /// `yes` in the lanes that this mask sets, `no` in the others.
    fn select(self, yes: Self, no: Self) -> Self;
    /// The lanes as an array.
    fn to_array(self) -> [f32; N];
    /// The bits of a mask. Lane 0 is the lowest bit.
    fn bits(self) -> u32;
    /// The least number in all lanes, where no lane is NaN.
    fn least(self) -> Self;
}

impl Lanes<8> for [f32; 8] {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        [x; 8]
    }
    #[inline(always)]
    fn from_bits(bits: [u32; 8]) -> Self {
        bits.map(f32::from_bits)
    }
    #[inline(always)]
    fn load(records: [&[f32; 16]; 8]) -> [Self; 16] {
        std::array::from_fn(|c| records.map(|r| r[c]))
    }
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        std::array::from_fn(|l| self[l] - o[l])
    }
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        std::array::from_fn(|l| self[l] * o[l])
    }
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        std::array::from_fn(|l| self[l] + o[l])
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        std::array::from_fn(|l| if self[l] < o[l] { self[l] } else { o[l] })
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        std::array::from_fn(|l| if self[l] > o[l] { self[l] } else { o[l] })
    }
    #[inline(always)]
    fn at_least(self, o: Self) -> Self {
        std::array::from_fn(|l| f32::from_bits(if self[l] >= o[l] { u32::MAX } else { 0 }))
    }
    #[inline(always)]
    fn less(self, o: Self) -> Self {
        std::array::from_fn(|l| f32::from_bits(if self[l] < o[l] { u32::MAX } else { 0 }))
    }
    #[inline(always)]
    fn and(self, o: Self) -> Self {
        std::array::from_fn(|l| f32::from_bits(self[l].to_bits() & o[l].to_bits()))
    }
    #[inline(always)]
    fn or(self, o: Self) -> Self {
        std::array::from_fn(|l| f32::from_bits(self[l].to_bits() | o[l].to_bits()))
    }
    #[inline(always)]
    fn select(self, yes: Self, no: Self) -> Self {
        std::array::from_fn(|l| if self[l].to_bits() != 0 { yes[l] } else { no[l] })
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 8] {
        self
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        let mut bits = 0;
        for (l, lane) in self.into_iter().enumerate() {
            bits |= lane.to_bits() >> 31 << l;
        }
        bits
    }
    #[inline(always)]
    fn least(self) -> Self {
        let mut least = self[0];
        for lane in self {
            least = if lane < least { lane } else { least };
        }
        [least; 8]
    }
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    // SAFETY of all blocks: reached only from functions with the features `avx2` and `fma`.
    use std::arch::x86_64::*;

    /// Numbers `4k..4k + 4` of two records.
    #[inline(always)]
    fn pair(low: &[f32; 16], high: &[f32; 16], k: usize) -> __m256 {
        let (low, high) = (&low[4 * k..4 * k + 4], &high[4 * k..4 * k + 4]);
        unsafe {
            let low = _mm256_castps128_ps256(_mm_loadu_ps(low.as_ptr()));
            _mm256_insertf128_ps::<1>(low, _mm_loadu_ps(high.as_ptr()))
        }
    }

    impl super::Lanes<8> for __m256 {
        #[inline(always)]
        fn splat(x: f32) -> Self {
            unsafe { _mm256_set1_ps(x) }
        }
        #[inline(always)]
        fn from_bits(bits: [u32; 8]) -> Self {
            unsafe { _mm256_loadu_ps(bits.as_ptr().cast()) }
        }
        #[inline(always)]
        fn load(records: [&[f32; 16]; 8]) -> [Self; 16] {
            let mut out = [Self::splat(0.0); 16];
            for k in 0..4 {
                // Places rows l and l + 4 side by side, then does two 4 × 4 transpositions at once.
                let r0 = pair(records[0], records[4], k);
                let r1 = pair(records[1], records[5], k);
                let r2 = pair(records[2], records[6], k);
                let r3 = pair(records[3], records[7], k);
                unsafe {
                    let (a, b) = (_mm256_unpacklo_ps(r0, r1), _mm256_unpackhi_ps(r0, r1));
                    let (c, d) = (_mm256_unpacklo_ps(r2, r3), _mm256_unpackhi_ps(r2, r3));
                    out[4 * k] = _mm256_shuffle_ps::<0b01_00_01_00>(a, c);
                    out[4 * k + 1] = _mm256_shuffle_ps::<0b11_10_11_10>(a, c);
                    out[4 * k + 2] = _mm256_shuffle_ps::<0b01_00_01_00>(b, d);
                    out[4 * k + 3] = _mm256_shuffle_ps::<0b11_10_11_10>(b, d);
                }
            }
            out
        }
        #[inline(always)]
        fn sub(self, o: Self) -> Self {
            unsafe { _mm256_sub_ps(self, o) }
        }
        #[inline(always)]
        fn mul(self, o: Self) -> Self {
            unsafe { _mm256_mul_ps(self, o) }
        }
        #[inline(always)]
        fn add(self, o: Self) -> Self {
            unsafe { _mm256_add_ps(self, o) }
        }
        #[inline(always)]
        fn min(self, o: Self) -> Self {
            unsafe { _mm256_min_ps(self, o) }
        }
        #[inline(always)]
        fn max(self, o: Self) -> Self {
            unsafe { _mm256_max_ps(self, o) }
        }
        #[inline(always)]
        fn at_least(self, o: Self) -> Self {
            unsafe { _mm256_cmp_ps::<_CMP_GE_OQ>(self, o) }
        }
        #[inline(always)]
        fn less(self, o: Self) -> Self {
            unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self, o) }
        }
        #[inline(always)]
        fn and(self, o: Self) -> Self {
            unsafe { _mm256_and_ps(self, o) }
        }
        #[inline(always)]
        fn or(self, o: Self) -> Self {
            unsafe { _mm256_or_ps(self, o) }
        }
        #[inline(always)]
        fn select(self, yes: Self, no: Self) -> Self {
            unsafe { _mm256_blendv_ps(no, yes, self) }
        }
        #[inline(always)]
        fn to_array(self) -> [f32; 8] {
            let mut out = [0.0; 8];
            unsafe { _mm256_storeu_ps(out.as_mut_ptr(), self) };
            out
        }
        #[inline(always)]
        fn bits(self) -> u32 {
            unsafe { _mm256_movemask_ps(self) as u32 }
        }
        #[inline(always)]
        fn least(self) -> Self {
            unsafe {
                let halves = _mm256_min_ps(self, _mm256_permute2f128_ps::<1>(self, self));
                let quarters = _mm256_min_ps(halves, _mm256_permute_ps::<0b01_00_11_10>(halves));
                _mm256_min_ps(quarters, _mm256_permute_ps::<0b10_11_00_01>(quarters))
            }
        }
    }
}
