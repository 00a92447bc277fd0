//! Several `f64` at once, with the operations that the filter needs.
//!
//! Every operation is rounded as IEEE 754 says, and no operations are fused. So all widths give the
//! same bits: the width depends on the processor, the file does not.
//!
//! Code that uses this has no closures and no iterators over lanes. The compiler would build them
//! without the caller's instruction set, and each operation would become a call.

/// A vector of [`LANES`](Self::LANES) numbers.
pub trait Doubles: Copy {
    /// Number of lanes. It divides [`GROUP`].
    const LANES: usize;
    /// A mask: one bit for each lane.
    type Mask: Copy;
    /// The same number in all lanes.
    fn splat(x: f64) -> Self;
    /// Loads numbers of `row`, beginning at `at`.
    fn load(row: &[f64], at: usize) -> Self;
    /// Stores the numbers to `row`, beginning at `at`.
    fn store(self, row: &mut [f64], at: usize);
    /// Sum.
    fn add(self, o: Self) -> Self;
    /// Difference.
    fn sub(self, o: Self) -> Self;
    /// Product.
    fn mul(self, o: Self) -> Self;
    /// Quotient.
    fn div(self, o: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// The lesser number. Neither may be NaN.
    fn min(self, o: Self) -> Self;
    /// The greater number. Neither may be NaN.
    fn max(self, o: Self) -> Self;
    /// The mask of `self ≥ o`. It is false where either number is NaN.
    fn at_least(self, o: Self) -> Self::Mask;
    /// The mask of `self < o`. It is false where either number is NaN.
    fn less(self, o: Self) -> Self::Mask;
    /// The mask of the lanes in which both masks hold.
    fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// `yes` where the mask holds, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// The bits of the mask. Lane 0 is the lowest bit.
    fn bits(mask: Self::Mask) -> u8;
}

/// The length of a row is a multiple of this number.
pub const GROUP: usize = 8;

/// Visits the indices that are in one of two sets, ascending. `visit` is told whether the index is
/// in the first set. A set has one bit for each index.
pub(super) fn visit_members(first: &[u8], second: &[u8], mut visit: impl FnMut(usize, bool)) {
    for (group, (&a, &b)) in first.iter().zip(second).enumerate() {
        let mut open = a | b;
        while open != 0 {
            let lane = open.trailing_zeros() as usize;
            open &= open - 1;
            visit(group * GROUP + lane, a >> lane & 1 == 1);
        }
    }
}

/// Three coordinates.
#[derive(Clone, Copy)]
pub struct Vector<L>(pub [L; 3]);

impl<L: Doubles> Vector<L> {
    /// Loads three rows that follow each other, beginning at `at`.
    #[inline(always)]
    pub fn load(rows: &[f64], stride: usize, at: usize) -> Self {
        Self([L::load(rows, at), L::load(rows, stride + at), L::load(rows, 2 * stride + at)])
    }

    /// Stores to three rows that follow each other, beginning at `at`.
    #[inline(always)]
    pub fn store(self, rows: &mut [f64], stride: usize, at: usize) {
        self.0[0].store(rows, at);
        self.0[1].store(rows, stride + at);
        self.0[2].store(rows, 2 * stride + at);
    }

    /// The same vector in all lanes.
    #[inline(always)]
    pub fn splat(v: glam::DVec3) -> Self {
        Self([L::splat(v.x), L::splat(v.y), L::splat(v.z)])
    }

    /// Difference.
    #[inline(always)]
    pub fn minus(self, o: Self) -> Self {
        Self([self.0[0].sub(o.0[0]), self.0[1].sub(o.0[1]), self.0[2].sub(o.0[2])])
    }

    /// Sum.
    #[inline(always)]
    pub fn plus(self, o: Self) -> Self {
        Self([self.0[0].add(o.0[0]), self.0[1].add(o.0[1]), self.0[2].add(o.0[2])])
    }

    /// Product with a number.
    #[inline(always)]
    pub fn times(self, factor: L) -> Self {
        Self([factor.mul(self.0[0]), factor.mul(self.0[1]), factor.mul(self.0[2])])
    }

    /// Quotient by a number.
    #[inline(always)]
    pub fn over(self, divisor: L) -> Self {
        Self([self.0[0].div(divisor), self.0[1].div(divisor), self.0[2].div(divisor)])
    }

    /// Scalar product, summed in the order of `DVec3::dot`.
    #[inline(always)]
    pub fn dot(self, o: Self) -> L {
        self.0[0].mul(o.0[0]).add(self.0[1].mul(o.0[1])).add(self.0[2].mul(o.0[2]))
    }

    /// Vector product, rounded like `DVec3::cross`.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, o.0);
        Self([b.mul(z).sub(y.mul(c)), c.mul(x).sub(z.mul(a)), a.mul(y).sub(x.mul(b))])
    }

    /// `yes` where the mask holds, else `no`.
    #[inline(always)]
    pub fn select(mask: L::Mask, yes: Self, no: Self) -> Self {
        let (a, b) = (yes.0, no.0);
        Self([L::select(mask, a[0], b[0]), L::select(mask, a[1], b[1]), L::select(mask, a[2], b[2])])
    }
}

impl Doubles for f64 {
    const LANES: usize = 1;
    type Mask = bool;
    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn load(row: &[f64], at: usize) -> Self {
        row[at]
    }
    #[inline(always)]
    fn store(self, row: &mut [f64], at: usize) {
        row[at] = self;
    }
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        self + o
    }
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        self - o
    }
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        self * o
    }
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        self / o
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        if self < o { self } else { o }
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        if self > o { self } else { o }
    }
    #[inline(always)]
    fn at_least(self, o: Self) -> bool {
        self >= o
    }
    #[inline(always)]
    fn less(self, o: Self) -> bool {
        self < o
    }
    #[inline(always)]
    fn both(a: bool, b: bool) -> bool {
        a & b
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn bits(mask: bool) -> u8 {
        u8::from(mask)
    }
}

/// Implements [`Doubles`] for a vector type of `std::arch`, given the names of its intrinsics.
#[cfg(target_arch = "x86_64")]
macro_rules! doubles {
    ($vector:ty, $lanes:literal, $mask:ty, $set:ident $load:ident $store:ident $add:ident $sub:ident $mul:ident $div:ident
     $sqrt:ident $min:ident $max:ident, { $($rest:item)* }) => {
        // SAFETY of all blocks: the code is reached only from functions with the instruction set,
        // and slices are at least as long as what is read.
        impl Doubles for $vector {
            const LANES: usize = $lanes;
            type Mask = $mask;
            #[inline(always)]
            fn splat(x: f64) -> Self {
                unsafe { $set(x) }
            }
            #[inline(always)]
            fn load(row: &[f64], at: usize) -> Self {
                let from = &row[at..at + $lanes];
                unsafe { $load(from.as_ptr()) }
            }
            #[inline(always)]
            fn store(self, row: &mut [f64], at: usize) {
                let to = &mut row[at..at + $lanes];
                unsafe { $store(to.as_mut_ptr(), self) }
            }
            #[inline(always)]
            fn add(self, o: Self) -> Self {
                unsafe { $add(self, o) }
            }
            #[inline(always)]
            fn sub(self, o: Self) -> Self {
                unsafe { $sub(self, o) }
            }
            #[inline(always)]
            fn mul(self, o: Self) -> Self {
                unsafe { $mul(self, o) }
            }
            #[inline(always)]
            fn div(self, o: Self) -> Self {
                unsafe { $div(self, o) }
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                unsafe { $sqrt(self) }
            }
            #[inline(always)]
            fn min(self, o: Self) -> Self {
                unsafe { $min(self, o) }
            }
            #[inline(always)]
            fn max(self, o: Self) -> Self {
                unsafe { $max(self, o) }
            }
            $(#[inline(always)] $rest)*
        }
    };
}

#[cfg(target_arch = "x86_64")]
mod x86_64 {
    use super::Doubles;
    use std::arch::x86_64::*;

    doubles!(__m256d, 4, __m256d, _mm256_set1_pd _mm256_loadu_pd _mm256_storeu_pd _mm256_add_pd _mm256_sub_pd
        _mm256_mul_pd _mm256_div_pd _mm256_sqrt_pd _mm256_min_pd _mm256_max_pd, {
        fn abs(self) -> Self {
            unsafe { _mm256_andnot_pd(_mm256_set1_pd(-0.0), self) }
        }
        fn at_least(self, o: Self) -> __m256d {
            unsafe { _mm256_cmp_pd::<_CMP_GE_OQ>(self, o) }
        }
        fn less(self, o: Self) -> __m256d {
            unsafe { _mm256_cmp_pd::<_CMP_LT_OQ>(self, o) }
        }
        fn both(a: __m256d, b: __m256d) -> __m256d {
            unsafe { _mm256_and_pd(a, b) }
        }
        fn select(mask: __m256d, yes: Self, no: Self) -> Self {
            unsafe { _mm256_blendv_pd(no, yes, mask) }
        }
        fn bits(mask: __m256d) -> u8 {
            unsafe { _mm256_movemask_pd(mask) as u8 }
        }
    });

    doubles!(__m512d, 8, u8, _mm512_set1_pd _mm512_loadu_pd _mm512_storeu_pd _mm512_add_pd _mm512_sub_pd
        _mm512_mul_pd _mm512_div_pd _mm512_sqrt_pd _mm512_min_pd _mm512_max_pd, {
        fn abs(self) -> Self {
            unsafe { _mm512_abs_pd(self) }
        }
        fn at_least(self, o: Self) -> u8 {
            unsafe { _mm512_cmp_pd_mask::<_CMP_GE_OQ>(self, o) }
        }
        fn less(self, o: Self) -> u8 {
            unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self, o) }
        }
        fn both(a: u8, b: u8) -> u8 {
            a & b
        }
        fn select(mask: u8, yes: Self, no: Self) -> Self {
            unsafe { _mm512_mask_blend_pd(mask, no, yes) }
        }
        fn bits(mask: u8) -> u8 {
            mask
        }
    });
}

/// `dispatch! { fn name(a: A, …) -> R = generic }` makes the function `fn name(isa: Isa, a: A, …)
/// -> R`.
///
/// It calls `generic::<L>`, compiled for the instruction set, where `L` implements [`Doubles`].
/// `generic`, and all functions that it calls with an `L`, must be `#[inline(always)]`.
macro_rules! dispatch {
    ($(#[$doc:meta])* fn $name:ident($($arg:ident: $ty:ty),* $(,)?) $(-> $out:ty)? = $generic:ident) => {
        $(#[$doc])*
        fn $name(isa: crate::base::Isa, $($arg: $ty),*) $(-> $out)? {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma")]
            fn avx2($($arg: $ty),*) $(-> $out)? {
                $generic::<std::arch::x86_64::__m256d>($($arg),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
            fn avx512($($arg: $ty),*) $(-> $out)? {
                $generic::<std::arch::x86_64::__m512d>($($arg),*)
            }
            match isa {
                crate::base::Isa::Baseline => $generic::<f64>($($arg),*),
                // SAFETY: `Isa::detect` found the features.
                #[cfg(target_arch = "x86_64")]
                crate::base::Isa::Avx2 => unsafe { avx2($($arg),*) },
                // SAFETY: as above.
                #[cfg(target_arch = "x86_64")]
                crate::base::Isa::Avx512 => unsafe { avx512($($arg),*) },
            }
        }
    };
}
pub(super) use dispatch;
