//! Contacts per face: what holds for them on every device.
use std::collections::BTreeMap;
use std::sync::Arc;

use tesdf::collide::{
    CollideOptions, Contact, Contacts, ContactsPer, Instance, Mode, Placement, Pose, Scene, Shape, detect,
};
use tesdf::geometry::Triangle;
use tesdf::glam::{DQuat, DVec3};

use super::bodies::{Body, Placed, of_direction, scene};
use super::shapes;

/// A detection on a device, and its error.
pub struct Detection<'a> {
    pub detect: &'a dyn Fn(&Scene, &CollideOptions) -> Contacts,
    /// Largest error of a least distance, relative to the larger diagonal.
    pub distance: f64,
    /// Largest error of a point, likewise.
    pub point: f64,
    /// Largest error of a distance or a point of bodies that stand on each other: of a side of 0.1.
    pub level: f64,
    /// A normal is vertical when the cosine of its angle is within this of 1.
    pub cosine: f64,
}

/// The faces of a comparison.
#[derive(Clone, Copy, Debug, Default)]
pub struct Kept {
    pub faces: usize,
    /// Faces whose search has not converged, on either side.
    pub unconverged: usize,
}

impl Detection<'_> {
    fn found(&self, scene: &Scene, contact_distance: f64) -> Contacts {
        (self.detect)(scene, &CollideOptions { contact_distance, ..CollideOptions::default() })
    }

    /// Checks that each face with a contact per cell has its least distance among the contacts per
    /// face: its own, or that of one of its vertices.
    pub fn keeps_least_distances(&self, bodies: &[Placed; 2], contact_distance: f64) -> Kept {
        let scene = scene(bodies);
        let by_cell = CollideOptions {
            contact_distance,
            ..CollideOptions::with_mode(Mode::exact().per(ContactsPer::Cell))
        };
        let by_cell = detect(&scene, &by_cell).expect("a good scene");
        let by_face = self.found(&scene, contact_distance);
        let pairs =
            |found: &Contacts| found.hidden.iter().map(|h| (h.instance_a, h.instance_b)).collect::<Vec<_>>();
        assert_eq!(pairs(&by_cell), pairs(&by_face));
        let size = bodies[0].diagonal().max(bodies[1].diagonal());
        let (tolerance, near) = (self.distance * size, self.point * size);
        let mut kept = Kept::default();
        for [a, b] in [[0, 1], [1, 0]] {
            let (cells, own) = (least(&by_cell, a, b), least(&by_face, a, b));
            for (&face, &(distance, converged)) in &cells {
                let corners = bodies[a].body.face(face, bodies[a].at);
                let at_corner = of_direction(by_face.as_slice(), a as u32, b as u32)
                    .filter(|c| corners.iter().any(|p| p.distance(c.point_a) <= near))
                    .map(|c| c.distance);
                let own = own.get(&face).copied();
                let least = at_corner.chain(own.map(|o| o.0)).fold(f64::INFINITY, f64::min);
                kept.faces += 1;
                if !converged || own.is_some_and(|o| !o.1) {
                    kept.unconverged += 1;
                    continue;
                }
                let is_border = least == f64::INFINITY && distance > contact_distance - tolerance;
                assert!(
                    is_border || (least - distance).abs() <= tolerance,
                    "face {face} of {a}: {distance} per cell, {least} per face"
                );
            }
            for (face, (distance, _)) in own {
                let known = cells.get(&face);
                // A minimum at the contact distance itself may be found by one of the two alone.
                let is_border = distance > contact_distance - tolerance;
                assert!(
                    is_border || known.is_some_and(|(d, converged)| !converged || distance >= d - tolerance),
                    "face {face} of {a}: {distance} per face, {known:?} per cell"
                );
            }
        }
        kept
    }

    /// Checks that contacts per minimum are those per face, without some beside which a sampled point
    /// of the surface is lower. Returns how many there are, and how many were dropped.
    pub fn minima_are_followed_by_no_lower_point(
        &self,
        bodies: &[Placed; 2],
        contact_distance: f64,
        mode: Mode,
    ) -> [usize; 2] {
        let scene = scene(bodies);
        let options = CollideOptions { contact_distance, ..CollideOptions::with_mode(mode) };
        let [all, minima] = [ContactsPer::Face, ContactsPer::Minimum].map(|contacts_per| {
            (self.detect)(&scene, &CollideOptions { mode: options.mode.per(contacts_per), ..options })
        });
        let size = bodies[0].diagonal().max(bodies[1].diagonal());
        let mut counts = [minima.len(), 0];
        for [a, b] in [[0, 1], [1, 0]] {
            let of = |contacts| of_direction(contacts, a as u32, b as u32);
            // On a device, the contacts of two faces at one vertex differ by rounding.
            let is_among = |others: &[Contact], c: &Contact| {
                others.iter().any(|other| other.point_a.distance(c.point_a) <= self.point * size)
            };
            let places: Vec<_> = of(all.as_slice()).copied().collect();
            let mut kept: Vec<_> = of(minima.as_slice()).copied().collect();
            assert!(kept.iter().all(|c| is_among(&places, c)), "a contact that no face has");
            // One contact stands for two of both orders at one place with one normal.
            let other = of_direction(minima.as_slice(), b as u32, a as u32);
            kept.extend(other.map(|c| Contact { point_a: c.point_b, point_b: c.point_a, ..*c }));
            let least =
                |contacts: &[Contact]| contacts.iter().map(|c| c.distance).fold(f64::INFINITY, f64::min);
            let [deepest, of_minima] = [least(&places), least(&kept)];
            let is_kept = of_minima == deepest || of_minima <= deepest + self.distance * size;
            assert!(is_kept, "{mode:?}: {of_minima} instead of {deepest}");
            let near = (1e-3 * size).max(self.point * size);
            let dropped: Vec<_> = places.iter().filter(|c| !is_among(&kept, c)).collect();
            counts[1] += dropped.len();
            for c in dropped.iter().step_by(1 + dropped.len() / 24) {
                let lower = self.lowest_sample(&bodies[a], &bodies[b], c.point_a, near);
                assert!(lower < c.distance, "{lower} is the least beside {c:?}");
            }
        }
        counts
    }

    /// The least signed distance in `field` of samples on the faces of `surface` at a point, up to
    /// `near` away from it.
    fn lowest_sample(&self, surface: &Placed, field: &Placed, p: DVec3, near: f64) -> f64 {
        let mesh = surface.body.solid.mesh();
        let mut lowest = f64::INFINITY;
        for face in 0..mesh.faces().len() {
            let [a, b, c] = surface.body.face(face as u32, surface.at);
            let triangle = Triangle::new([a, b, c]);
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            if triangle.closest(p).distance > 1.01e-4 * longest + self.point * surface.diagonal() {
                continue;
            }
            for k in 0..32 {
                let angle = std::f64::consts::TAU * f64::from(k) / 32.0;
                let along = (b - a).normalize_or_zero();
                let way = angle.cos() * along + angle.sin() * triangle.normal.cross(along);
                for exponent in 0..8 {
                    let step = near.max(longest / 32.0) * 0.25f64.powi(exponent);
                    lowest = lowest.min(field.distance_by_tree(triangle.closest(p + step * way).point));
                }
            }
        }
        lowest
    }

    /// A peg in front of a wall of two storeys, whose border lies just below the end of the peg: the
    /// border is no contact, because the wall beside the peg is nearer.
    pub fn border_ahead_of_a_peg_is_no_minimum(&self) {
        let wall =
            shapes::Shape::default().add_box(DVec3::new(0.0, -0.5, -1.0), DVec3::new(0.2, 0.5, 1.0), 8);
        let wall = Placed {
            body: Arc::new(Body::new(wall.solid())),
            at: Placement { pose: Pose::IDENTITY, scale: 1.0 },
        };
        let (clearance, above) = (0.01, 0.02);
        let end = DVec3::new(-0.3 - clearance, -0.1, above);
        let peg = block(end, end + DVec3::new(0.3, 0.2, 0.6), 1);
        let scene = scene(&[wall, peg]);
        for (contacts_per, is_there) in [(ContactsPer::Face, true), (ContactsPer::Minimum, false)] {
            let options = CollideOptions {
                contact_distance: 0.05,
                ..CollideOptions::with_mode(Mode::exact().per(contacts_per))
            };
            let found = (self.detect)(&scene, &options);
            let oblique = of_direction(found.as_slice(), 0, 1).any(|c| c.normal.z.abs() > 0.3);
            assert_eq!(oblique, is_there, "{contacts_per:?}");
            let beside = of_direction(found.as_slice(), 0, 1).any(|c| {
                c.normal.x > 1.0 - self.cosine && (c.distance - clearance).abs() < self.level + 1e-9
            });
            assert!(beside, "{contacts_per:?}");
        }
    }

    /// Two links of a chain lie in the bends of each other. The faces beside the nearest one are no
    /// minima, but each link would have to go through them to slip sideways, so they have contacts.
    pub fn sides_of_a_bend_are_walls(&self) {
        let quarter = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
        // Short of tight, and off the middle.
        let next = Pose::new(DVec3::new(0.028_9, 3.7e-4, 2.3e-4), quarter).expect("a unit quaternion");
        let links =
            [Pose::IDENTITY, next].map(|pose| Placed::new("chain_link", Placement { pose, scale: 1.0 }));
        let scene = scene(&links);
        let options = CollideOptions {
            contact_distance: 2e-4,
            ..CollideOptions::with_mode(Mode::exact().per(ContactsPer::Minimum))
        };
        let found = (self.detect)(&scene, &options);
        for side in [DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z] {
            let holds = |(a, b, sign): (u32, u32, f64)| {
                of_direction(found.as_slice(), a, b).any(|c| sign * c.normal.dot(side) > 0.15)
            };
            assert!(
                [(0, 1, 1.0), (1, 0, -1.0)].into_iter().any(holds),
                "no contact pushes the first link along {side}"
            );
        }
    }

    /// The contacts hold the upper body up: the normals of the nearest contacts are vertical, and each
    /// corner of the patch has a contact nearby. Beside the patch, faces are farther away, with other
    /// normals.
    fn stands(&self, contacts: &[Contact], corners: &[DVec3], near: f64, what: &str) {
        let least = contacts.iter().map(|c| c.distance).fold(f64::INFINITY, f64::min);
        let nearest: Vec<&Contact> = contacts.iter().filter(|c| c.distance < least + self.level).collect();
        for c in &nearest {
            assert!(c.normal.z.abs() > 1.0 - self.cosine, "{what}: {c:?}");
        }
        for corner in corners {
            let away = nearest.iter().map(|c| c.point_a.distance(*corner)).fold(f64::INFINITY, f64::min);
            assert!(
                away <= near.max(self.level),
                "{what}: no contact within {near} of {corner}, but at {away}"
            );
        }
    }

    /// Boxes of side 0.1 on a lower one with n × n squares a side. Returns the number of contacts
    /// whose search has not converged.
    pub fn box_stands_on_the_corners_of_the_patch(&self, contacts_per: ContactsPer) -> usize {
        // A small face reports the flat part of itself within the tolerance, a large one everything
        // within the contact distance.
        let near = 1.5e-5;
        self.box_stands(contacts_per, (0.0, DVec3::ZERO), near)
            + self.shifted_or_turned_box_stands_on_the_corners_of_the_patch(
                contacts_per,
                DVec3::new(0.03, 0.02, 0.0),
                near,
            )
    }

    /// The same for a box that is shifted, and turned ones, with contacts up to `near` from the
    /// corners.
    pub fn shifted_or_turned_box_stands_on_the_corners_of_the_patch(
        &self,
        contacts_per: ContactsPer,
        shift: DVec3,
        near: f64,
    ) -> usize {
        [
            (0.0, shift),
            (std::f64::consts::FRAC_PI_6, DVec3::ZERO),
            (std::f64::consts::FRAC_PI_6, DVec3::new(0.04, 0.0, 0.0)),
        ]
        .into_iter()
        .map(|place| self.box_stands(contacts_per, place, near))
        .sum()
    }

    /// The same for one angle and shift.
    fn box_stands(&self, contacts_per: ContactsPer, (turn, shift): (f64, DVec3), near: f64) -> usize {
        let half = DVec3::splat(0.05);
        let options = CollideOptions {
            contact_distance: 2e-4,
            ..CollideOptions::with_mode(Mode::exact().per(contacts_per).filtered(0.5))
        };
        let mut unconverged = 0;
        for [n_lower, n_upper] in [[1, 1], [1, 8], [8, 1], [8, 8], [3, 5]] {
            let lower = block(-half, half, n_lower);
            let upper = block(-half, half, n_upper);
            for gap in [-1e-6, 0.0, 5e-5] {
                let rotation = DQuat::from_rotation_z(turn);
                let translation = shift + DVec3::new(0.0, 0.0, 0.1 + gap);
                let mut placed = upper.clone();
                placed.at.pose = Pose { translation, rotation };
                let found = (self.detect)(&scene(&[lower.clone(), placed.clone()]), &options);
                let corners = overlap(&rotation, shift);
                let what = format!(
                    "{n_lower} and {n_upper} squares, turned by {turn}, shifted by {shift}, gap {gap}"
                );
                self.stands(found.as_slice(), &corners, near, &what);
                unconverged += found.statistics.unconverged;
            }
        }
        unconverged
    }

    pub fn box_stands_on_a_plane_and_on_four_pegs(&self, contacts_per: ContactsPer) {
        let options = CollideOptions {
            contact_distance: 2e-4,
            ..CollideOptions::with_mode(Mode::exact().per(contacts_per).filtered(0.5))
        };
        let plate = block(DVec3::new(-0.05, -0.05, 0.0), DVec3::new(0.05, 0.05, 0.01), 1);
        let corners =
            [[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]].map(|[x, y]| DVec3::new(x, y, 0.0));
        let mut on_plane = Scene::new();
        for shape in [Shape::Plane, Shape::Mesh(plate.body.asset.clone())] {
            let id = on_plane.add_shape(shape).expect("a shape");
            on_plane.add(Instance::new(id, Pose::IDENTITY)).expect("an instance");
        }
        self.stands((self.detect)(&on_plane, &options).as_slice(), &corners, 1e-12, "on a plane");

        let mut pegs = shapes::Shape::default();
        let mut tips = Vec::new();
        for [x, y] in [[-0.04, -0.04], [0.04, -0.04], [0.04, 0.04], [-0.04, 0.04]] {
            let half = DVec3::new(0.005, 0.005, 0.0);
            let center = DVec3::new(x, y, 0.0);
            pegs = pegs.add_box(center - half - 0.02 * DVec3::Z, center + half, 1);
            tips.extend([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[u, v]| {
                let outward = DVec3::new(u, v, 0.0);
                // Only the outer corners carry.
                (center + 0.005 * outward, outward.dot(center) > 0.07)
            }));
        }
        let pegs = Placed { body: Arc::new(Body::new(pegs.solid())), at: plate.at };
        let found = (self.detect)(&scene(&[pegs, plate]), &options);
        let outer: Vec<DVec3> = tips.iter().filter(|t| t.1).map(|t| t.0).collect();
        assert_eq!(outer.len(), 4);
        self.stands(found.as_slice(), &outer, 1e-9, "on pegs");
    }

    pub fn vertex_of_several_faces_has_one_contact(&self, modes: &[Mode]) {
        // A corner of the cube points down onto a plane.
        let cube = block(DVec3::splat(-0.5), DVec3::splat(0.5), 1);
        let down = DQuat::from_rotation_arc(DVec3::ONE.normalize(), DVec3::NEG_Z);
        let mut scene = Scene::new();
        let (floor, mesh) = (Shape::Plane, Shape::Mesh(cube.body.asset.clone()));
        for (shape, pose) in [
            (floor, Pose::IDENTITY),
            (mesh, Pose { translation: DVec3::new(0.0, 0.0, 0.75f64.sqrt() - 1e-3), rotation: down }),
        ] {
            let id = scene.add_shape(shape).expect("a shape");
            scene.add(Instance::new(id, pose)).expect("an instance");
        }
        let own = |found: &Contacts| {
            of_direction(found.as_slice(), 1, 0).map(|c| (c.face_a, c.distance)).collect::<Vec<_>>()
        };
        for &mode in modes {
            let by_cell = CollideOptions::with_mode(mode.per(ContactsPer::Cell));
            let all = own(&detect(&scene, &by_cell).expect("a good scene"));
            assert!(all.len() >= 3, "{all:?}");
            let by_face = CollideOptions { mode: by_cell.mode.per(ContactsPer::Face), ..by_cell };
            let one = own(&(self.detect)(&scene, &by_face));
            assert_eq!(one.len(), 1, "{one:?}");
            let lowest = all.iter().map(|c| c.0).min().expect("a face");
            assert!(one[0].0 == lowest && (one[0].1 + 1e-3).abs() < self.level.max(1e-9), "{one:?}");
        }
    }
}

/// A box with n × n squares a side.
pub fn block(min: DVec3, max: DVec3, n: u32) -> Placed {
    let body = Arc::new(Body::new(shapes::Shape::default().add_box(min, max, n).solid()));
    Placed { body, at: Placement { pose: Pose::IDENTITY, scale: 1.0 } }
}

/// Corners of the square of side 0.1 around the origin, intersected with itself, turned and
/// shifted, at the height 0.05.
fn overlap(rotation: &DQuat, shift: DVec3) -> Vec<DVec3> {
    let square = [[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]];
    let mut polygon: Vec<DVec3> = square.map(|[x, y]| *rotation * DVec3::new(x, y, 0.0) + shift).to_vec();
    for axis in [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y] {
        let inside = |p: DVec3| 0.05 - p.dot(axis);
        let mut cut = Vec::new();
        for i in 0..polygon.len() {
            let (p, q) = (polygon[i], polygon[(i + 1) % polygon.len()]);
            let (at_p, at_q) = (inside(p), inside(q));
            if at_p >= -1e-12 {
                cut.push(p);
            }
            if at_p * at_q < -1e-24 {
                cut.push(p + at_p / (at_p - at_q) * (q - p));
            }
        }
        polygon = cut;
    }
    polygon.into_iter().map(|p| p.with_z(0.05)).collect()
}

/// The least distance of each face of `a` in the field of `b`, and whether its search has converged.
fn least(contacts: &Contacts, a: usize, b: usize) -> BTreeMap<u32, (f64, bool)> {
    let mut least: BTreeMap<u32, (f64, bool)> = BTreeMap::new();
    let of_pair = |c: &&Contact| (c.instance_a.0 as usize, c.instance_b.0 as usize) == (a, b);
    for c in contacts.iter().filter(of_pair) {
        let known = least.entry(c.face_a).or_insert((f64::INFINITY, true));
        if c.distance < known.0 {
            *known = (c.distance, c.converged);
        }
    }
    least
}
