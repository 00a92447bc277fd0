//! Encoded meshes as collision shapes of [Rapier](https://rapier.rs), and Rapier as an engine for
//! [`tesdf_sim`](tesdf_sim::Dynamics).
//!
//! ```text
//! TesdfShape ─┐
//! Ball, …     ├─TesdfDispatcher (tesdf::collide::detect)─▶ manifold per contact ─▶ Rapier's solver
//! HalfSpace ──┘                          (with the impulses of the previous step)
//! ```
//!
//! - [`TesdfShape`]: an encoded mesh as a shape. Use it in a collider as
//!   `SharedShape::new(TesdfShape::new(asset))`.
//! - [`TesdfDispatcher`]: finds the contacts of pairs with such a shape. [`query_dispatcher`]
//!   passes all other pairs to parry.
//! - [`RapierEngine`]: moves the bodies of a [`tesdf_sim::System`] with Rapier.
//!
//! Everything is in `f64` (`rapier3d-f64`), so no conversion rounds. In `f32` a position 1 m from
//! the origin would be off by up to 0.06 µm after every substep, while clearances are 25 µm.
//! Lengths are in metres with the default options.
//!
//! ```
//! use std::sync::Arc;
//! use rapier3d_f64::prelude::*;
//! use tesdf::mesh::{MeshFormat, read_bytes};
//! use tesdf::{CollideOptions, Encoder, Mode, SolidMesh};
//! use tesdf_rapier::{RapierOptions, TesdfShape, query_dispatcher};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
//! let solid = SolidMesh::new(read_bytes(obj.as_bytes(), MeshFormat::Obj)?.mesh)?;
//! let asset = Arc::new(Encoder::new().encode(&solid)?);
//!
//! let gravity = Vector::new(0.0, 0.0, -9.81);
//! let mut world = PhysicsWorld { gravity, ..PhysicsWorld::default() };
//! let dispatcher = query_dispatcher(CollideOptions::with_mode(Mode::exact()));
//! world.narrow_phase.set_query_dispatcher(dispatcher);
//! world.integration_parameters = RapierOptions::default().parameters(1e-3, 1e-3); // s, m
//! world.insert_collider(ColliderBuilder::new(SharedShape::new(HalfSpace::new(Vector::Z))), None);
//! let start = Vector::new(0.0, 0.0, 1e-3);
//! let body = world.insert_body(RigidBodyBuilder::dynamic().translation(start));
//! let tetra = SharedShape::new(TesdfShape::new(asset));
//! world.insert_collider(ColliderBuilder::new(tetra).density(1000.0), Some(body));
//! for _ in 0..100 {
//!     world.step();
//! }
//! assert!(world.bodies[body].translation().z.abs() < 1e-4); // it fell 1 mm and lies on the plane
//! # Ok(())
//! # }
//! ```
#![warn(missing_docs)]

mod dispatcher;
mod engine;
mod known;
mod manifolds;
mod options;
mod record;
mod shape;
mod world;

pub use dispatcher::{TesdfDispatcher, query_dispatcher};
pub use engine::RapierEngine;
pub use options::RapierOptions;
pub use rapier3d_f64;
pub use shape::TesdfShape;
