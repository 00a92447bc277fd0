//! What the rows of a batch add to the matrix of an iteration.
use nalgebra::Matrix6;

use crate::newton::lanes::Lanes;
use crate::newton::line::Bundle;

/// The sum of `Jᵀ B J` over the rows of a batch, by columns.
#[derive(Default)]
pub struct Sum([[Lanes; 6]; 6]);

impl Sum {
    /// `push` is the decrease of the push with the gap, `follows` that of the friction with the gap
    /// that has the derivatives `of`, and `slip` that of the friction with the slip: xx, xy, yy.
    #[inline(always)]
    pub fn add(
        &mut self,
        bundle: &Bundle,
        push: Lanes,
        (of, follows): (&[Lanes; 6], [Lanes; 2]),
        slip: [Lanes; 3],
    ) {
        let normal = &bundle.normal;
        match &bundle.slip {
            None => {
                // All rows of a batch are of this kind, and their sum is symmetric.
                for (c, column) in self.0.iter_mut().enumerate() {
                    let product = push * normal[c];
                    for r in c..6 {
                        column[r] += normal[r] * product;
                    }
                }
            }
            Some(slips) => {
                let [x, y] = &slips.tangents;
                for (c, column) in self.0.iter_mut().enumerate() {
                    let products = [
                        push * normal[c],
                        follows[0] * of[c] + slip[0] * x[c] + slip[1] * y[c],
                        follows[1] * of[c] + slip[1] * x[c] + slip[2] * y[c],
                    ];
                    for r in 0..6 {
                        column[r] += normal[r] * products[0] + x[r] * products[1] + y[r] * products[2];
                    }
                }
            }
        }
    }

    #[inline(always)]
    pub fn total(&self, is_symmetric: bool) -> Matrix6<f64> {
        let mut total = Matrix6::zeros();
        for (c, column) in self.0.iter().enumerate() {
            for r in 0..6 {
                total[(r, c)] = if is_symmetric && r < c { total[(c, r)] } else { column[r].sum() };
            }
        }
        total
    }
}
