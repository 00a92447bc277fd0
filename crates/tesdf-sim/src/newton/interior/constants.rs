//! The numbers of the interior point method, which devices share.

/// Rows without bounds are at least as soft in the matrix, in the units of rows (the proximal
/// method of multipliers: Rockafellar, *Augmented Lagrangians and applications of the proximal
/// point algorithm*, Math. Oper. Res. 1976). What they leave is the same. With the 1e-13 of rigid
/// rows in the matrix, rounding was as great as the numbers: the iterations for three joints from
/// 10 kg to 10 g, a linear problem, grew to 1e23 m/s, or took up to 100. A step of that scene took
/// 631 of them, with 1e-12 63, and from 1e-9 to 1e-7 47.
pub const PROXIMAL: f64 = 1e-9;
/// Lagged limits stay once the root of ν is below this gap, m.
pub const FREEZE: f64 = 1e-5;
/// An iterate is the solution when the last iteration leaves no more of a gap, m.
pub const CLOSED: f64 = 1e-10;
/// With friction, the forces are off by less than this way, and this share of the way without rows.
pub const BALANCED: [f64; 2] = [1e-8, 1e-6];
/// ν ends at the square of this gap, m, ...
pub const LEAST_GAP: f64 = 1e-11;
/// ... or below this multiple of it, 0.1 nm squared. A box at rest is 1e-16 m above its rigid place
/// then, and nothing pushes it across a gap of nanometres.
pub const FEW: f64 = 1e2;
/// ν begins with the square of this multiple of the greatest gap that is to be closed.
pub const FIRST: f64 = 3.0;
/// Most iterations with the second one of [`WIDTHS`].
pub const FINE: u32 = 4;
/// The least share of ν that an iteration aims at.
pub const LEAST_CENTRING: f64 = 1e-6;
/// A step that goes all the way to a bound is shortened by this share, and less where the predictor
/// is nearly free of bounds.
pub const SHORTER: f64 = 0.01;
/// Steps below are short, and above long.
pub const SHORT: f64 = 0.3;
/// See [`SHORT`].
pub const LONG: f64 = 0.7;
/// Gondzio's correction is taken where it lengthens the step by this factor.
pub const LENGTHENS: f64 = 1.05;

/// An iterate is the solution when the last iteration moved no body by more than this, m.
pub const SETTLED: f64 = 1e-10;
/// The same for one that begins near the solution, where its first iterations are as short. With
/// 0.1 nm, the friction of a stack did not end its creeping, which grew by 60 nm/s in a second.
pub const SETTLED_WARM: f64 = 1e-12;

/// The least `a`, m: that with which the method converges, and that of the solution. The way by
/// which a contact creeps in a step before it sticks.
pub const WIDTHS: [f64; 2] = [1e-10, 1e-12];

/// How long a run tries.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Most iterations.
    pub iterations: u32,
    /// It ends after so many short steps in a row.
    pub short_steps: u32,
    /// The first of [`WIDTHS`].
    pub width: usize,
    /// It ends after an iteration that moves no body by more than this, m.
    pub settled: f64,
}

/// From forces that may be nearly right.
pub const WARM: Effort = Effort { iterations: 24, short_steps: 2, width: 1, settled: SETTLED_WARM };
/// From no forces.
pub const COLD: Effort = Effort { iterations: 30, short_steps: 3, width: 0, settled: SETTLED };
/// The same without friction: convex, so short steps pass.
pub const CONVEX: Effort = Effort { iterations: 100, short_steps: u32::MAX, width: 0, settled: SETTLED };
/// With lagged limits.
pub const LAGGED: Effort = Effort { iterations: 50, short_steps: u32::MAX, width: 0, settled: SETTLED };
