use crate::parallel::*;
use glam::DVec3;

use super::locate::{FLIGHT, Faces, Place};
use super::{Answer, Precision};
use crate::TeSdf;

/// Points that one task takes.
const TASK: usize = 1 << 12;

/// Which points a batch answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// All finite points.
    Everywhere,
    /// Points of the domain, as [`TeSdf::query_in_domain`] has it; others get NaN and [`Answer::NO_FACE`].
    Domain,
}

/// Where a batch puts its answers, one array per field of [`Answer`], as numpy and GPUs want them.
#[derive(Debug)]
pub struct AnswerColumns<'a> {
    /// Distances to the nearest face, negative inside.
    pub signed_distance: &'a mut [f64],
    /// Unit gradients.
    pub gradient: &'a mut [[f64; 3]],
    /// Nearest points of the surface.
    pub closest_point: &'a mut [[f64; 3]],
    /// Nearest faces, by their ids in the source mesh.
    pub face: &'a mut [u32],
}

/// Why a batch is not answered.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{column} has {found} rows for {expected} points; expected one for each point")]
pub struct BatchError {
    /// The array.
    pub column: &'static str,
    /// Its rows.
    pub found: usize,
    /// Number of points.
    pub expected: usize,
}

impl BatchError {
    fn unless_equal(column: &'static str, found: usize, expected: usize) -> Result<(), Self> {
        if found == expected { Ok(()) } else { Err(Self { column, found, expected }) }
    }
}

impl TeSdf {
    /// Answers for many points, in order, on all threads of the current rayon pool.
    ///
    /// The same answers as one query at a time, but quicker: a few points go through the stages together
    /// (cell, list, faces), and what the next stage needs is fetched ahead for all of them.
    pub fn query_batch(&self, points: &[DVec3], precision: Precision) -> Vec<Answer> {
        let mut answers = vec![Answer::NONE; points.len()];
        self.each_flight(
            points,
            precision,
            Extent::Everywhere,
            answers.par_chunks_mut(TASK),
            |answers, at, flight| {
                answers[at..at + flight.len()].copy_from_slice(flight);
            },
        );
        answers
    }

    /// As [`query_batch`](Self::query_batch), into arrays that are there.
    ///
    /// # Errors
    /// [`BatchError`]: a column has not as many rows as there are points. No row was changed then.
    pub fn query_batch_into(
        &self,
        points: &[DVec3],
        precision: Precision,
        extent: Extent,
        columns: AnswerColumns<'_>,
    ) -> Result<(), BatchError> {
        let AnswerColumns { signed_distance, gradient, closest_point, face } = columns;
        for (column, rows) in [
            ("signed_distance", signed_distance.len()),
            ("gradient", gradient.len()),
            ("closest_point", closest_point.len()),
            ("face", face.len()),
        ] {
            BatchError::unless_equal(column, rows, points.len())?;
        }
        let tasks = signed_distance
            .par_chunks_mut(TASK)
            .zip(gradient.par_chunks_mut(TASK))
            .zip(closest_point.par_chunks_mut(TASK))
            .zip(face.par_chunks_mut(TASK));
        self.each_flight(points, precision, extent, tasks, |(((d, g), c), f), at, flight| {
            for (i, answer) in flight.iter().enumerate() {
                d[at + i] = answer.signed_distance;
                g[at + i] = answer.gradient.to_array();
                c[at + i] = answer.closest_point.to_array();
                f[at + i] = answer.face;
            }
        });
        Ok(())
    }

    /// As [`query_batch_into`](Self::query_batch_into), signed distances alone.
    ///
    /// # Errors
    /// As [`query_batch_into`](Self::query_batch_into).
    pub fn signed_distances_into(
        &self,
        points: &[DVec3],
        precision: Precision,
        distances: &mut [f64],
    ) -> Result<(), BatchError> {
        BatchError::unless_equal("distances", distances.len(), points.len())?;
        let tasks = distances.par_chunks_mut(TASK);
        self.each_flight(points, precision, Extent::Everywhere, tasks, |distances, at, flight| {
            let distances = distances[at..].iter_mut();
            distances.zip(flight).for_each(|(distance, answer)| *distance = answer.signed_distance);
        });
        Ok(())
    }

    /// Answers flight by flight; `tasks` are the places of [`TASK`] answers each, and `put` has the place, the number of
    /// answers of the task before the flight, and the flight.
    fn each_flight<T: Send>(
        &self,
        points: &[DVec3],
        precision: Precision,
        extent: Extent,
        tasks: impl IndexedParallelIterator<Item = T>,
        put: impl Fn(&mut T, usize, &[Answer]) + Sync,
    ) {
        tasks.zip(points.par_chunks(TASK)).for_each(|(mut task, points)| {
            let mut faces: [Faces; FLIGHT] = std::array::from_fn(|_| Faces::default());
            let mut answers = [Answer::NONE; FLIGHT];
            for (flight, points) in points.chunks(FLIGHT).enumerate() {
                let answers = &mut answers[..points.len()];
                self.query_flight(points, precision, extent, &mut faces, answers);
                put(&mut task, flight * FLIGHT, answers);
            }
        });
    }

    fn query_flight(
        &self,
        points: &[DVec3],
        precision: Precision,
        extent: Extent,
        faces: &mut [Faces; FLIGHT],
        answers: &mut [Answer],
    ) {
        let mut locals = [DVec3::NAN; FLIGHT];
        locals.iter_mut().zip(points).for_each(|(local, &p)| *local = self.frame.to_local(p));
        let mut places = [Place::NotOfDomain; FLIGHT];
        self.locate_all(&locals, &mut places);
        for place in &places {
            if let Place::Listed { offset, .. } = *place {
                fetch(&self.lists[offset as usize..]);
            }
        }
        for (place, faces) in places.iter().zip(faces.iter_mut()) {
            if let Place::Listed { offset, .. } = *place {
                self.read_list(offset, faces);
                faces.ids().iter().for_each(|&face| fetch(&self.records[face as usize..]));
            }
        }
        for (i, answer) in answers.iter_mut().enumerate() {
            *answer = match (extent, places[i]) {
                (Extent::Domain, Place::NotOfDomain) => Answer::NONE,
                (_, place) => self.answer(points[i], locals[i], place, &faces[i], precision),
            };
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
