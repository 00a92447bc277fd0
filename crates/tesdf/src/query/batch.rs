use glam::DVec3;
use rayon::prelude::*;

use super::locate::Place;
use super::{Answer, Precision};
use crate::TeSdf;

/// Points that one task takes.
const TASK: usize = 1 << 12;
/// Points in flight: enough to hide the way to memory, few enough that what was fetched is still in cache.
const FLIGHT: usize = 16;

impl TeSdf {
    /// Answers for many points, in order, on all threads of the current rayon pool.
    ///
    /// The same answers as one query at a time, but quicker: a few points go through the stages together
    /// (cell, list, faces), and what the next stage needs is fetched ahead for all of them.
    pub fn query_batch(&self, points: &[DVec3], precision: Precision) -> Vec<Answer> {
        let mut answers = vec![Answer::NONE; points.len()];
        answers.par_chunks_mut(TASK).zip(points.par_chunks(TASK)).for_each(|(answers, points)| {
            for (answers, points) in answers.chunks_mut(FLIGHT).zip(points.chunks(FLIGHT)) {
                self.query_flight(points, precision, answers);
            }
        });
        answers
    }

    fn query_flight(&self, points: &[DVec3], precision: Precision, answers: &mut [Answer]) {
        let mut places = [Place::NotOfDomain; FLIGHT];
        for (place, &point) in places.iter_mut().zip(points) {
            *place = self.place(self.frame.to_local(point));
            if let Place::Listed { offset, .. } = *place {
                fetch(&self.lists[offset as usize..]);
            }
        }
        for place in &places[..points.len()] {
            if let Place::Listed { offset, .. } = *place {
                self.list_faces(offset).for_each(|face| fetch(&self.records[face as usize..]));
            }
        }
        for ((answer, &point), &place) in answers.iter_mut().zip(points).zip(&places) {
            if point.is_finite() {
                *answer = self.answer(self.frame.to_local(point), place, precision);
            }
        }
    }
}

/// Asks for the cache line of the first element; says nothing about whether it comes.
#[inline(always)]
fn fetch<T>(slice: &[T]) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a prefetch reads nothing that the program sees, and the instruction is part of x86-64.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(slice.as_ptr().cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = slice;
}
