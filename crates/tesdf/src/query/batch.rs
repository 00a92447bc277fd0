use std::cell::RefCell;

use crate::parallel::*;
use glam::DVec3;

use super::far_points::is_near;
use super::locate::{FLIGHT, Faces, Place};
use super::{Answer, LocalAnswer, Precision};
use crate::TeSdf;

/// Number of points per task.
const TASK: usize = 1 << 12;

/// Number of points whose faces are on their way from memory.
const AHEAD: usize = 8;

/// The points that a batch answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// All finite points.
    Everywhere,
    /// Points of the domain, as [`TeSdf::query_in_domain`] defines it. Other points get NaN and
    /// [`Answer::NO_FACE`].
    Domain,
}

/// Output arrays of a batch, one for each field of [`Answer`], as numpy and GPUs expect them. Each
/// needs one row per point.
#[derive(Debug)]
pub struct AnswerColumns<'a> {
    /// Distances to the nearest face, negative inside; in the mesh's unit.
    pub signed_distance: &'a mut [f64],
    /// Unit gradients.
    pub gradient: &'a mut [[f64; 3]],
    /// Nearest points of the surface, in the mesh's unit.
    pub closest_point: &'a mut [[f64; 3]],
    /// Nearest faces, by their ids in the source mesh.
    pub face: &'a mut [u32],
}

/// Why a batch is not answered.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{column} has {found} rows for {expected} points; expected one for each point")]
pub struct BatchError {
    /// Name of the array.
    pub column: &'static str,
    /// Its number of rows.
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
    /// Answers many points exactly, in order, on all threads of the current rayon pool.
    ///
    /// The answers equal those of [`query`](Self::query), but take less time: a few points pass the
    /// stages (cell, list, faces) together, and the data of the next stage are prefetched for all
    /// of them.
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::glam::DVec3;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # use tesdf::{Encoder, SolidMesh, mesh::MeshFormat, mesh::read_bytes};
    /// # let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    /// # let solid = SolidMesh::new(read_bytes(obj.as_bytes(), MeshFormat::Obj)?.mesh)?;
    /// # let asset = Encoder::new().encode(&solid)?;
    /// let points = [DVec3::new(0.1, 0.3, 0.3), DVec3::new(-2.0, 0.3, 0.3)];
    /// let answers = asset.query_batch(&points);
    /// assert_eq!(answers[1], asset.query(points[1]));
    /// # Ok(())
    /// # }
    /// ```
    pub fn query_batch(&self, points: &[DVec3]) -> Vec<Answer> {
        self.query_batch_with(points, Precision::F64)
    }

    /// As [`query_batch`](Self::query_batch), in `f32`: the answers of
    /// [`query_f32`](Self::query_f32).
    pub fn query_batch_f32(&self, points: &[DVec3]) -> Vec<Answer> {
        self.query_batch_with(points, Precision::F32)
    }

    /// As [`query_batch`](Self::query_batch) or [`query_batch_f32`](Self::query_batch_f32), chosen
    /// at run time.
    pub fn query_batch_with(&self, points: &[DVec3], precision: Precision) -> Vec<Answer> {
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

    /// As [`query_batch_with`](Self::query_batch_with), but writes into arrays of the caller, one
    /// row for each point.
    ///
    /// # Errors
    /// [`BatchError`]: the number of rows of an array differs from the number of points. Then no
    /// row is changed.
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::glam::DVec3;
    /// use tesdf::query::{AnswerColumns, Extent, Precision};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # use tesdf::{Encoder, SolidMesh, mesh::MeshFormat, mesh::read_bytes};
    /// # let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    /// # let solid = SolidMesh::new(read_bytes(obj.as_bytes(), MeshFormat::Obj)?.mesh)?;
    /// # let asset = Encoder::new().encode(&solid)?;
    /// let points = [DVec3::new(0.1, 0.3, 0.3), DVec3::new(-2.0, 0.3, 0.3)];
    /// let (mut distance, mut face) = ([0.0; 2], [0; 2]);
    /// let (mut gradient, mut closest) = ([[0.0; 3]; 2], [[0.0; 3]; 2]);
    /// let columns = AnswerColumns {
    ///     signed_distance: &mut distance,
    ///     gradient: &mut gradient,
    ///     closest_point: &mut closest,
    ///     face: &mut face,
    /// };
    /// asset.query_batch_into(&points, Precision::F64, Extent::Everywhere, columns)?;
    /// assert_eq!(face[0], asset.query(points[0]).face);
    /// # Ok(())
    /// # }
    /// ```
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

    /// Writes only the signed distances, into an array of the caller, one for each point.
    ///
    /// # Errors
    /// [`BatchError`]: the number of distances differs from the number of points. Then none is
    /// changed.
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

    /// Answers flight by flight. Each item of `tasks` holds the output of [`TASK`] points. `put`
    /// receives the item, the index of the flight's first point in the task, and the answers.
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
        self.pass_flight(&locals[..points.len()], faces, |i, place, faces| {
            // Each case writes its own fields: a copy of a whole answer would wait for them.
            if extent == Extent::Domain && matches!(place, Place::NotOfDomain) {
                answers[i] = Answer::NONE;
            } else if is_near(locals[i]) {
                answers[i] = self.to_answer(self.find(locals[i], place, faces, precision));
            } else {
                answers[i] = self.answer_far(points[i]);
            }
        });
    }

    /// Passes up to [`FLIGHT`] points of the local frame through the stages. `answer` receives the
    /// number of each point, its place and the faces of its list.
    #[inline(always)]
    fn pass_flight(
        &self,
        locals: &[DVec3],
        faces: &mut [Faces; FLIGHT],
        mut answer: impl FnMut(usize, Place, &Faces),
    ) {
        let mut places = [Place::NotOfDomain; FLIGHT];
        self.locate_all(locals, &mut places);
        for place in &places {
            if let Place::Listed { offset, .. } = *place {
                fetch(self.lists.as_ptr().wrapping_add(offset as usize));
            }
        }
        // The faces of the next points are fetched while distances to those of this point are
        // computed.
        for next in 0..locals.len() + AHEAD {
            if let (Some(&Place::Listed { offset, .. }), Some(faces)) =
                (places.get(next), faces.get_mut(next))
            {
                self.read_list(offset, faces);
                self.fetch_faces(faces);
            }
            if let Some(i) = next.checked_sub(AHEAD) {
                answer(i, places[i], &faces[i]);
            }
        }
    }

    /// As [`found_exactly`](Self::found_exactly) for several points, in order. `put` receives the
    /// answers.
    pub(crate) fn found_exactly_all(&self, locals: &[DVec3], mut put: impl FnMut(LocalAnswer)) {
        thread_local! {
            static FACES: RefCell<[Faces; FLIGHT]> = RefCell::default();
        }
        if !self.has_exact_lists() {
            return locals.iter().for_each(|&local| put(self.found_exactly(local)));
        }
        // `put` may ask for other points.
        let mut faces = FACES.take();
        for locals in locals.chunks(FLIGHT) {
            self.pass_flight(locals, &mut faces, |i, place, faces| {
                put(self.find(locals[i], place, faces, Precision::F32));
            });
        }
        FACES.set(faces);
    }

    /// Prefetches the faces of a list.
    #[inline(always)]
    pub(super) fn fetch_faces(&self, faces: &Faces) {
        for &face in faces.chunks().as_flattened() {
            fetch(self.records.as_ptr().wrapping_add(face as usize));
        }
    }
}

/// Prefetches the cache line at an address. It is only a hint, so any address will do.
#[inline(always)]
fn fetch<T>(address: *const T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a prefetch has no visible effect, and the instruction is part of x86-64.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(address.cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}
