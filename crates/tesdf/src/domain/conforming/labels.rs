//! Winding numbers of tetrahedra. Tetrahedra that are connected without passing the surface have
//! the same number, which is computed once for each such part.
use glam::DVec3;

use super::{
    ConformingError,
    triangles::{BEHIND, FRONT, Triangle},
    weld::Welded,
};
use crate::{
    geometry::{orientation, tetrahedron_volume},
    mesh::{SolidMesh, WindingNumber},
};

/// The winding number of each tetrahedron.
///
/// # Errors
/// The winding numbers do not fit across a face, or a place with a winding number other than 0 has
/// no tetrahedron.
pub(super) fn windings(
    solid: &SolidMesh,
    welded: &Welded,
    triangles: &[Triangle],
) -> Result<Vec<i32>, ConformingError> {
    let mut parts = Parts::new(welded.tetrahedra.len());
    for triangle in triangles.iter().filter(|t| t.face.is_none()) {
        if let [Some(a), Some(b)] = triangle.sides {
            parts.join(a, b);
        }
    }
    let part: Vec<u32> = (0..welded.tetrahedra.len() as u32).map(|t| parts.root(t)).collect();

    // The largest tetrahedron whose rounded centroid lies inside of it. No face passes through a
    // tetrahedron, so this point is not on the surface and its winding number is exact.
    let mut seeds: Vec<Option<(f64, DVec3)>> = vec![None; part.len()];
    for (t, &part) in part.iter().enumerate() {
        let corners = welded.corners(t);
        let centroid = 0.25 * corners.iter().sum::<DVec3>();
        let volume = tetrahedron_volume(&corners);
        let best = &mut seeds[part as usize];
        if best.is_none_or(|(most, _)| volume > most) && is_strictly_inside(&corners, centroid) {
            *best = Some((volume, centroid));
        }
    }
    let winding = WindingNumber::new(solid.mesh());
    let mut of_part = vec![0; part.len()];
    for (t, _) in part.iter().enumerate().filter(|&(t, &p)| t == p as usize) {
        let (_, seed) = seeds[t].ok_or(ConformingError::NoSeed { tetrahedron: t })?;
        of_part[t] = winding.at(seed);
    }
    let windings: Vec<i32> = part.iter().map(|&p| of_part[p as usize]).collect();
    fit(&windings, triangles, &welded.vertices)?;
    Ok(windings)
}

fn is_strictly_inside(&[a, b, c, d]: &[DVec3; 4], p: DVec3) -> bool {
    [[p, b, c, d], [a, p, c, d], [a, b, p, d], [a, b, c, p]]
        .iter()
        .all(|&[a, b, c, d]| orientation(a, b, c, d) < 0)
}

/// Whether the winding numbers change at each face by the number of the face, and are 0 where there
/// is no tetrahedron.
fn fit(windings: &[i32], triangles: &[Triangle], vertices: &[DVec3]) -> Result<(), ConformingError> {
    for triangle in triangles {
        let of = |side: usize| triangle.sides[side].map(|t| (t, windings[t as usize]));
        let face = triangle.face.map_or(0, |f| f as usize);
        let (there, empty) = match (of(FRONT), of(BEHIND)) {
            (Some((front, in_front)), Some((back, behind))) => {
                if behind - in_front != triangle.jump {
                    let (tetrahedra, windings) = ([front, back], [in_front, behind]);
                    return Err(ConformingError::Labels { face, tetrahedra, windings });
                }
                continue;
            }
            (Some((t, winding)), None) => (t, winding + triangle.jump),
            (None, Some((t, winding))) => (t, winding - triangle.jump),
            (None, None) => continue,
        };
        match (empty, triangle.face) {
            (0, _) => {}
            (_, None) => {
                let position = triangle.centroid(vertices);
                return Err(ConformingError::InsideOpen { tetrahedron: there as usize, position });
            }
            (winding, Some(_)) => return Err(ConformingError::InsideEmpty { face, winding }),
        }
    }
    Ok(())
}

/// Disjoint sets of tetrahedra. The least id stands for its set.
struct Parts {
    parent: Vec<u32>,
}

impl Parts {
    fn new(count: usize) -> Self {
        Self { parent: (0..count as u32).collect() }
    }

    fn root(&mut self, mut t: u32) -> u32 {
        while self.parent[t as usize] != t {
            let above = self.parent[self.parent[t as usize] as usize];
            self.parent[t as usize] = above;
            t = above;
        }
        t
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}
