use std::time::Instant;

use rapier3d_f64::geometry::{ContactData, ContactManifold, ContactManifoldData, Shape};
use rapier3d_f64::math::{Pose, Vector};
use rapier3d_f64::parry::query::details::{ContactManifoldsWorkspace, NormalConstraints, ShapeCastOptions};
use rapier3d_f64::parry::query::{
    ClosestPoints, Contact as ParryContact, DefaultQueryDispatcher, NonlinearRigidMotion,
    PersistentQueryDispatcher, QueryDispatcher, ShapeCastHit, ShapeDistance, ShapeIntersection, Unsupported,
};
use tesdf::collide::{self, CollideError, CollideOptions, Contacts, Instance, Placement, Scene};

use crate::known::{self, Known};
use crate::manifolds::{self, FIRST};
use crate::record::Record;

/// Finds the contacts of pairs of shapes with [`tesdf::collide::detect`], in both directions: the
/// faces of each shape against the distance field of the other.
///
/// It answers pairs of a [`TesdfShape`](crate::TesdfShape) with another `TesdfShape`, a half space,
/// a cuboid, a ball, a capsule or a cylinder. All other pairs are `Unsupported`; [`query_dispatcher`] passes
/// them to parry. Distances and sweeps are also `Unsupported`, and parry cannot compute them for
/// these shapes either. Rapier's continuous collision detection therefore has no effect on them;
/// speculative contacts take its place.
#[derive(Clone, Debug)]
pub struct TesdfDispatcher {
    options: CollideOptions,
    record: Option<Record>,
}

/// A [`TesdfDispatcher`] that passes the pairs that it does not answer to parry's default
/// dispatcher.
///
/// Rapier's prediction distance decides how far contacts reach, so the contact distance and the
/// speculative time of `options` have no effect. If an option is out of range, no contact is found.
pub fn query_dispatcher(
    options: CollideOptions,
) -> impl PersistentQueryDispatcher<ContactManifoldData, ContactData> + 'static {
    TesdfDispatcher::new(options).chain(DefaultQueryDispatcher)
}

impl TesdfDispatcher {
    /// A dispatcher with these options; [`query_dispatcher`] says which options have an effect.
    pub fn new(options: CollideOptions) -> Self {
        Self { options, record: None }
    }

    /// A dispatcher that records what it finds. It also answers pairs of simple shapes, so the
    /// record has all contacts.
    pub(crate) fn recording(options: CollideOptions, record: Record) -> Self {
        Self { options, record: Some(record) }
    }

    /// The two shapes, if this dispatcher answers the pair.
    fn pair(&self, g1: &dyn Shape, g2: &dyn Shape) -> Result<[Known; 2], Unsupported> {
        let pair = [Known::new(g1).ok_or(Unsupported)?, Known::new(g2).ok_or(Unsupported)?];
        let answered = self.record.is_some() || pair.iter().any(Known::is_mesh);
        answered.then_some(pair).ok_or(Unsupported)
    }

    /// Contacts up to `distance`, in the frame of the first shape, which is instance 0.
    fn contacts(&self, pos12: &Pose, pair: [Known; 2], distance: f64) -> Result<Contacts, CollideError> {
        let mut scene = Scene::new();
        let placed = |known: &Known, pose| Placement { pose, scale: known.scale };
        let [first, second] = pair;
        let placements = [placed(&first, first.pose), placed(&second, known::pose(pos12).after(second.pose))];
        for (known, Placement { pose, scale }) in [first, second].into_iter().zip(placements) {
            let shape = scene.add_shape(known.shape)?;
            scene.add(Instance { scale, ..Instance::new(shape, pose) })?;
        }
        let options = CollideOptions { contact_distance: distance, speculative_time: 0.0, ..self.options };
        collide::detect(&scene, &options)
    }
}

impl PersistentQueryDispatcher<ContactManifoldData, ContactData> for TesdfDispatcher {
    fn contact_manifolds(
        &self,
        pos12: &Pose,
        g1: &dyn Shape,
        g2: &dyn Shape,
        prediction: f64,
        manifolds: &mut Vec<ContactManifold>,
        workspace: &mut Option<ContactManifoldsWorkspace>,
    ) -> Result<(), Unsupported> {
        let begin = Instant::now();
        let pair = self.pair(g1, g2)?;
        let found = self.contacts(pos12, pair, prediction.max(0.0));
        let contacts = found.as_ref().map_or(&[][..], Contacts::as_slice);
        manifolds::replace(contacts, pos12, manifolds, workspace);
        if let Some(record) = &self.record {
            let mut record = record.lock();
            record.time += begin.elapsed();
            for (manifold, contact) in manifolds.iter_mut().zip(contacts) {
                manifold.data.user_data = record.contacts.len() as u32;
                record.contacts.push(*contact);
            }
            if let Err(error) = found {
                record.error.get_or_insert(error);
            }
        }
        Ok(())
    }

    fn contact_manifold_convex_convex(
        &self,
        _: &Pose,
        _: &dyn Shape,
        _: &dyn Shape,
        _: Option<&dyn NormalConstraints>,
        _: Option<&dyn NormalConstraints>,
        _: f64,
        _: &mut ContactManifold,
    ) -> Result<(), Unsupported> {
        Err(Unsupported)
    }
}

impl QueryDispatcher for TesdfDispatcher {
    fn intersection_test(
        &self,
        pos12: &Pose,
        g1: &dyn Shape,
        g2: &dyn Shape,
    ) -> Result<ShapeIntersection, Unsupported> {
        let pair = self.pair(g1, g2)?;
        let found = self.contacts(pos12, pair, 0.0).map_err(|_| Unsupported)?;
        Ok(ShapeIntersection::new(!(found.is_empty() && found.hidden.is_empty())))
    }

    /// The contact of the smallest signed distance.
    fn contact(
        &self,
        pos12: &Pose,
        g1: &dyn Shape,
        g2: &dyn Shape,
        prediction: f64,
    ) -> Result<Option<ParryContact>, Unsupported> {
        let pair = self.pair(g1, g2)?;
        let contacts = self.contacts(pos12, pair, prediction.max(0.0)).map_err(|_| Unsupported)?;
        let deepest = contacts.iter().min_by(|c, d| c.distance.total_cmp(&d.distance));
        Ok(deepest.map(|c| {
            let flipped = c.instance_a != FIRST;
            let (first, second) = if flipped { (c.point_b, c.point_a) } else { (c.point_a, c.point_b) };
            let normal = if flipped { c.normal } else { -c.normal };
            let second_normal = -(pos12.rotation.inverse() * normal);
            ParryContact::new(first, pos12.inverse_transform_point(second), normal, second_normal, c.distance)
        }))
    }

    fn distance(&self, _: &Pose, _: &dyn Shape, _: &dyn Shape) -> Result<ShapeDistance, Unsupported> {
        Err(Unsupported)
    }

    fn closest_points(
        &self,
        _: &Pose,
        _: &dyn Shape,
        _: &dyn Shape,
        _: f64,
    ) -> Result<ClosestPoints, Unsupported> {
        Err(Unsupported)
    }

    fn cast_shapes(
        &self,
        _: &Pose,
        _: Vector,
        _: &dyn Shape,
        _: &dyn Shape,
        _: ShapeCastOptions,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        Err(Unsupported)
    }

    fn cast_shapes_nonlinear(
        &self,
        _: &NonlinearRigidMotion,
        _: &dyn Shape,
        _: &NonlinearRigidMotion,
        _: &dyn Shape,
        _: f64,
        _: f64,
        _: bool,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        Err(Unsupported)
    }
}
