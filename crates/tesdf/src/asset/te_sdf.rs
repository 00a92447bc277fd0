use std::path::Path;
use std::sync::OnceLock;

use glam::DVec3;

use super::about::{About, Signs};
use super::cell_bounds::CellBounds;
use super::conforming::Conforming;
use super::entries::Entries;
use super::face_record::FaceRecord;
#[cfg(feature = "collide")]
use super::faces_at::FacesAt;
use super::inner_ball::InnerBall;
use super::layout::{self, List, Node, PALETTE_SIZE, SignHints, TreeChild};
use super::motion::Motion;
use super::{AssetError, Container, FORMAT_VERSION, Section, SharedSection};
use crate::base::{Inside, Isa};
use crate::domain::{DomainCube, MAX_DEPTH};
use crate::geometry::{Aabb, AabbTree, LocalFrame, SignRule, Triangle};

/// A Tetra-Encoded Signed Distance Field: an encoded mesh, immutable, shared by all its users.
///
/// The space around a solid is cut into tetrahedra. Each tetrahedron `t` has a list `E_t` of the
/// faces that can be closest to a point in it. So a signed distance is the least of a few exact
/// point–triangle distances, and its sign is that of the tetrahedron:
///
/// ```text
///              ╱╲                 x lies in t              φ(x) = ± min  d(x, f)      Eq. (4)
///       ______╱  ╲______          E_t = {f3, f4, f5}               f ∈ E_t
///     f1 f2  f3   f4  f5 f6
///             · x                 − inside, + outside; where the surface passes
///         ___╱ ╲___ t             through t, the closest feature tells
/// ```
///
/// The tetrahedra are the leaves of a bisection forest over a cube ([`Cell`](crate::domain::Cell)).
/// The geometry of a cell follows from its path, so only its list is stored. A list names each of
/// its faces by one byte: a slot in a palette of up to 256 faces, which a subtree shares.
///
/// All lengths are in the unit of the mesh. The type is `Send + Sync`, and cheap to share by `Arc`.
#[derive(Clone, Debug)]
pub struct TeSdf {
    container: Container,
    about: About,
    pub(crate) frame: LocalFrame,
    pub(crate) cube: DomainCube,
    /// The tetrahedra that the forest grows from. `None` when they are those of the cube.
    pub(crate) conforming: Option<Conforming>,
    pub(crate) vertices: SharedSection<[f64; 3]>,
    pub(crate) faces: SharedSection<[u32; 3]>,
    pub(crate) face_ids: SharedSection<u32>,
    pub(crate) sign_hints: SharedSection<u16>,
    /// Faces that count for the sign only.
    pub(crate) sign_faces: Option<SharedSection<[u32; 3]>>,
    /// Whether a rule tells the side of points without a list.
    pub(crate) is_by_rule: bool,
    /// Half of the thickness of a sheet, in the local frame; otherwise 0.
    pub(crate) half_thickness: f64,
    /// Decides the side where cells do not; made on first use.
    sign_rule: OnceLock<SignRule>,
    pub(crate) nodes: SharedSection<u32>,
    pub(crate) lists: SharedSection<u8>,
    pub(crate) palette_starts: SharedSection<u32>,
    pub(crate) palettes: SharedSection<u16>,
    pub(crate) palettes_high: Option<SharedSection<u8>>,
    pub(crate) tree_boxes: SharedSection<[f32; 12]>,
    pub(crate) tree_children: SharedSection<[u32; 2]>,
    /// Faces in `f32`, made on opening.
    pub(crate) records: Vec<FaceRecord>,
    /// The words at which locating a point begins, made on opening.
    pub(crate) entries: Entries,
    pub(crate) isa: Isa,
    /// Bounds of the corners of the faces, in the unit of the mesh. Made on opening.
    bounds: Aabb,
    pub(crate) cell_bounds: OnceLock<CellBounds>,
    /// What has moved since the asset was opened. `None` when nothing has.
    pub(crate) motion: Option<Motion>,
    lowest_faces: OnceLock<Vec<u32>>,
    #[cfg(feature = "collide")]
    pub(super) faces_by_id: OnceLock<Vec<u32>>,
    #[cfg(feature = "collide")]
    faces_at: OnceLock<FacesAt>,
    #[cfg(feature = "collide")]
    pub(super) corner_cones: OnceLock<Vec<f32>>,
    pub(crate) inner_ball: OnceLock<InnerBall>,
    pub(crate) corner_reaches: OnceLock<Vec<f32>>,
    face_normals: OnceLock<Vec<(DVec3, bool)>>,
}

impl TeSdf {
    /// Maps the file at `path` and checks all that a query relies on. Checksums are left to
    /// [`verify_checksums`](Self::verify_checksums).
    ///
    /// The file must not be changed in place while it is open; see [`Container::open`].
    ///
    /// # Errors
    /// [`AssetError`] names the section at fault.
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::TeSdf;
    /// use tesdf::glam::DVec3;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let folder = tempfile::tempdir()?;
    /// # let path = folder.path().join("part.obj");
    /// # std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")?;
    /// TeSdf::encode_file(&path)?.save(path.with_extension("tesdf"))?;
    /// let asset = TeSdf::open(path.with_extension("tesdf"))?;
    /// asset.verify_checksums()?; // for a file that may be damaged
    /// assert!(asset.is_inside(DVec3::splat(0.1)));
    /// # Ok(())
    /// # }
    /// ```
    pub fn open(path: impl AsRef<Path>) -> Result<Self, AssetError> {
        Self::from_container(Container::open(path, &layout::SECTIONS)?)
    }

    /// The same as [`open`](Self::open), with a copy of `bytes`.
    ///
    /// # Errors
    /// The same as for [`open`](Self::open).
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, AssetError> {
        Self::from_container(Container::from_bytes(bytes, &layout::SECTIONS)?)
    }

    /// The same as [`open`](Self::open), for a container that was opened with [`layout::SECTIONS`].
    ///
    /// # Errors
    /// The same as for [`open`](Self::open).
    pub fn from_container(container: Container) -> Result<Self, AssetError> {
        let about = About::from_metadata(container.metadata())?;
        let placed: SharedSection<f64> = container.shared_section(layout::FRAME.name)?;
        let (frame, cube) = frame_and_cube(&placed)?;
        let palettes_high = container
            .section::<u8>(layout::PALETTES_HIGH.name)?
            .is_some()
            .then(|| container.shared_section(layout::PALETTES_HIGH.name))
            .transpose()?;
        let sign_faces = container
            .section::<[u32; 3]>(layout::SIGN_FACES.name)?
            .is_some()
            .then(|| container.shared_section(layout::SIGN_FACES.name))
            .transpose()?;
        let mut asset = Self {
            sign_faces,
            is_by_rule: about.signs.are_by_rule(),
            half_thickness: about.certificate().inside().rule.half_thickness() * frame.scale,
            sign_rule: OnceLock::new(),
            about,
            frame,
            cube,
            conforming: None,
            vertices: container.shared_section(layout::VERTICES.name)?,
            faces: container.shared_section(layout::FACES.name)?,
            face_ids: container.shared_section(layout::FACE_IDS.name)?,
            sign_hints: container.shared_section(layout::SIGN_HINTS.name)?,
            nodes: container.shared_section(layout::NODES.name)?,
            lists: container.shared_section(layout::LISTS.name)?,
            palette_starts: container.shared_section(layout::PALETTE_STARTS.name)?,
            palettes: container.shared_section(layout::PALETTES.name)?,
            palettes_high,
            tree_boxes: container.shared_section(layout::TREE_BOXES.name)?,
            tree_children: container.shared_section(layout::TREE_CHILDREN.name)?,
            container,
            records: Vec::new(),
            entries: Entries::new(&[]),
            isa: Isa::detect(),
            bounds: Aabb::EMPTY,
            cell_bounds: OnceLock::new(),
            motion: None,
            lowest_faces: OnceLock::new(),
            #[cfg(feature = "collide")]
            faces_by_id: OnceLock::new(),
            #[cfg(feature = "collide")]
            faces_at: OnceLock::new(),
            #[cfg(feature = "collide")]
            corner_cones: OnceLock::new(),
            inner_ball: OnceLock::new(),
            corner_reaches: OnceLock::new(),
            face_normals: OnceLock::new(),
        };
        asset.check_mesh()?;
        asset.conforming = Conforming::open(&asset.container, asset.placed())?;
        asset.check_signs()?;
        asset.check_lists()?;
        asset.check_tree()?;
        let middle = asset.cube.middle();
        asset.bounds = asset.bounds_of_faces();
        if asset.conforming.is_none() {
            asset.entries = Entries::new(&asset.nodes);
        }
        let count = asset.faces.len();
        let bytes = count * size_of::<FaceRecord>();
        asset.records.try_reserve_exact(count).map_err(|_| AssetError::Memory { bytes })?;
        for f in 0..count {
            let hints = SignHints(asset.sign_hints[f]);
            asset.records.push(FaceRecord::new(&asset.local_triangle(f), middle, hints));
        }
        Ok(asset)
    }

    /// What the asset says about itself: its source, the options, the certificate, the counts.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// Name of the unit of the mesh, if it was recorded; see [`unit`](crate::base::unit).
    pub fn unit(&self) -> Option<&str> {
        self.about.options.unit.as_deref().map(str::trim).filter(|unit| !unit.is_empty())
    }

    /// What is inside of the asset, and which faces of its mesh are the surface.
    pub fn inside(&self) -> &Inside {
        self.about.certificate().inside()
    }

    /// The rule that decides the side where cells do not; `None` when the winding number does.
    pub(crate) fn sign_rule(&self) -> Option<&SignRule> {
        self.is_by_rule.then(|| {
            self.sign_rule.get_or_init(|| {
                let sign_faces = self.sign_faces.as_deref().unwrap_or(&[]);
                let faces = [&*self.faces, sign_faces].concat();
                let position = |v: u32| self.frame.to_local(DVec3::from_array(self.vertices[v as usize]));
                SignRule::new(self.inside().rule, &faces, position)
            })
        })
    }

    /// Whether kernels on other devices find contacts of the asset: its field does not jump, and no
    /// face has the inside in front of it.
    #[doc(hidden)]
    pub fn is_detected_on_devices(&self) -> bool {
        self.jump().is_none() && self.faces_look_outward()
    }

    /// Bounds of the solid, in the unit of the mesh: those of the mesh, with half of the thickness
    /// of a sheet around them. The inside of an open mesh can extend farther beyond them.
    pub(crate) fn bounds_of_solid(&self) -> Aabb {
        self.bounds.grown(self.reach_beyond() * self.frame.inverse_scale())
    }

    /// Whether the faces stand for their winding number: inside is where it is 1 or more, so they
    /// enclose the solid.
    #[doc(hidden)]
    pub fn faces_enclose_the_solid(&self) -> bool {
        self.about.signs == Signs::Cells
    }

    /// Whether no face has the inside in front of it. Otherwise the rule tells at each point of a
    /// face on which side of it the inside is.
    pub(crate) fn faces_look_outward(&self) -> bool {
        self.about.signs != Signs::RuleUnoriented
    }

    pub(crate) fn about_mut(&mut self) -> &mut About {
        &mut self.about
    }

    /// Forgets the stored normals, which vertices that move make wrong.
    pub(crate) fn forget_normals(&mut self) {
        self.face_normals = OnceLock::new();
    }

    /// Forgets all data that depends on the positions of vertices, except data that is refitted.
    pub(crate) fn shape_changed(&mut self) {
        self.bounds = self.bounds_of_faces();
        self.cell_bounds = OnceLock::from(CellBounds::none());
        self.inner_ball = OnceLock::new();
        self.corner_reaches = OnceLock::new();
        #[cfg(feature = "collide")]
        {
            self.corner_cones = OnceLock::new();
        }
        self.forget_normals();
    }

    fn bounds_of_faces(&self) -> Aabb {
        (0..self.faces.len()).map(|f| Aabb::of(&self.face_corners(f))).fold(Aabb::EMPTY, Aabb::union)
    }

    /// Whether every list is proved to be exact for the current positions of the vertices.
    pub(crate) fn has_exact_lists(&self) -> bool {
        let certificate = &self.about.certificate;
        certificate.delta().is_some() && certificate.exactness_distance().is_none()
    }

    /// The whole file as it was opened, even if vertices have moved since.
    pub fn as_bytes(&self) -> &[u8] {
        self.container.as_bytes()
    }

    /// The container, for its sections and their sizes.
    pub fn container(&self) -> &Container {
        &self.container
    }

    /// The current sections, in the order of the file. They stay at the same place in memory until
    /// vertices move or lists are made anew.
    pub fn sections(&self) -> impl Iterator<Item = Section<'_>> {
        self.container.sections().map(|Section { spec, bytes }| {
            let bytes: &[u8] = match spec {
                layout::VERTICES => bytemuck::cast_slice(&self.vertices),
                layout::SIGN_HINTS => bytemuck::cast_slice(&self.sign_hints),
                layout::NODES => bytemuck::cast_slice(&self.nodes),
                layout::LISTS => &self.lists,
                layout::TREE_BOXES => bytemuck::cast_slice(&self.tree_boxes),
                layout::DOMAIN_VERTICES => {
                    bytemuck::cast_slice(self.conforming.as_ref().map_or(&[], Conforming::vertices))
                }
                _ => bytes,
            };
            Section { spec, bytes }
        })
    }

    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.faces.len()
    }

    /// Bounds of the mesh, in its unit.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Bounds of the mesh, in the local frame.
    pub(crate) fn local_bounds(&self) -> Aabb {
        Aabb { min: self.frame.to_local(self.bounds.min), max: self.frame.to_local(self.bounds.max) }
    }

    /// For each vertex the lowest id of a face that has it, and [`u32::MAX`] for a vertex without a
    /// face. Made on first use.
    pub(crate) fn lowest_faces(&self) -> &[u32] {
        self.lowest_faces.get_or_init(|| {
            let mut lowest = vec![u32::MAX; self.vertices.len()];
            for (corners, &id) in self.faces.iter().zip(self.face_ids.iter()) {
                corners.iter().for_each(|&v| lowest[v as usize] = lowest[v as usize].min(id));
            }
            lowest
        })
    }

    /// The faces that have a vertex, by their places in the file, in ascending order.
    #[cfg(feature = "collide")]
    #[doc(hidden)]
    pub fn faces_at(&self, vertex: u32) -> &[u32] {
        self.faces_at.get_or_init(|| FacesAt::new(&self.faces, self.vertices.len())).of(vertex)
    }

    /// How far around the solid the domain reaches for certain (local frame): the width of the
    /// outer band.
    pub(crate) fn band(&self) -> f64 {
        if self.conforming.is_some() {
            return 0.0;
        }
        let diagonal = self.bounds.extent().length();
        self.about.options.band.resolve(diagonal) * self.frame.scale
    }

    /// Corners of the face at `position`, its place in the file, in the unit of the mesh.
    pub fn face_corners(&self, position: usize) -> [DVec3; 3] {
        self.faces[position].map(|v| DVec3::from_array(self.vertices[v as usize]))
    }

    /// Vertices of the face at `position`, its place in the file. They are 0-based ids of the
    /// encoded mesh.
    pub fn face_vertices(&self, position: usize) -> [u32; 3] {
        self.faces[position]
    }

    /// Id, in the source mesh, of the face at `position`, its place in the file. It may be
    /// [`face_count`](Self::face_count) or more where faces of the source are no surface.
    pub fn face_id(&self, position: usize) -> u32 {
        self.face_ids[position]
    }

    /// Sizes in bytes of the data that opening makes in addition to the file: the faces in `f32`,
    /// and the words at which locating a point begins.
    pub fn derived_bytes(&self) -> (usize, usize) {
        let entries = self.conforming.as_ref().map_or(self.entries.bytes(), Conforming::derived_bytes);
        (std::mem::size_of_val(self.records.as_slice()), entries)
    }

    /// The face at `position`, in the local frame.
    pub(crate) fn local_triangle(&self, position: usize) -> Triangle {
        let corners = self.local_corners(position);
        match self.face_normals.get() {
            Some(normals) => {
                let (normal, is_needle) = normals[position];
                Triangle::from_parts(corners, normal, is_needle)
            }
            None => Triangle::new(corners),
        }
    }

    /// Corners of the face at `position`, in the local frame.
    pub(crate) fn local_corners(&self, position: usize) -> [DVec3; 3] {
        self.face_corners(position).map(|p| self.frame.to_local(p))
    }

    /// Stores the normals of all faces, unless they are stored: 32 bytes each. Computing a normal
    /// takes as long as the rest of a distance to the face.
    ///
    /// On one thread: a thread that waits for parallel work may take up another detection, which
    /// would wait for these normals forever.
    pub(crate) fn store_normals(&self) {
        self.face_normals.get_or_init(|| {
            let normal = |position| {
                let triangle = Triangle::new(self.local_corners(position));
                (triangle.normal, triangle.is_needle())
            };
            (0..self.faces.len()).map(normal).collect()
        });
    }

    /// As [`store_normals`](Self::store_normals), for queries. After a move they compute the
    /// normals of the few faces that they need: the next move may follow soon.
    #[inline]
    pub(crate) fn store_normals_unless_moved(&self) {
        if self.motion.is_none() {
            self.store_normals();
        }
    }

    /// Checks what the sign is told by.
    fn check_signs(&self) -> Result<(), AssetError> {
        let (f, v) = (self.faces.len(), self.vertices.len());
        if self.about.signs != Signs::Cells && self.conforming.is_some() {
            let reason = "a conforming domain, whose cells tell the side; expected the bisection domain";
            return wrong(layout::TETRAHEDRA, reason.into());
        }
        let Some(faces) = self.sign_faces.as_deref() else { return Ok(()) };
        if !self.is_by_rule {
            return wrong(layout::SIGN_FACES, "the asset has no rule that counts them".into());
        }
        if let Some(i) = faces.iter().position(|c| c.iter().any(|&k| k as usize >= v)) {
            return wrong(layout::SIGN_FACES, format!("face {i} uses {:?} of {v} vertices", faces[i]));
        }
        if faces.len() > layout::MAX_FACES - f {
            let most = layout::MAX_FACES;
            return wrong(
                layout::SIGN_FACES,
                format!("{} faces beside {f}; expected {most} in all", faces.len()),
            );
        }
        Ok(())
    }

    fn check_mesh(&self) -> Result<(), AssetError> {
        let (f, v) = (self.faces.len(), self.vertices.len());
        if f == 0 || f > layout::MAX_FACES {
            return wrong(layout::FACES, format!("{f} faces; expected 1 to {}", layout::MAX_FACES));
        }
        let bad = |c: &[f64; 3]| c.iter().any(|x| !x.is_finite());
        if let Some(i) = self.vertices.iter().position(bad) {
            return wrong(layout::VERTICES, format!("vertex {i} is not finite"));
        }
        if let Some(i) = self.faces.iter().position(|c| c.iter().any(|&k| k as usize >= v)) {
            return wrong(layout::FACES, format!("face {i} uses {:?} of {v} vertices", self.faces[i]));
        }
        // Ids have gaps where faces of the source mesh are no surface.
        let ids = if self.container.version() == FORMAT_VERSION { f } else { layout::MAX_FACES };
        if let Some(i) = self.face_ids.iter().position(|&id| id as usize >= ids) {
            return wrong(layout::FACE_IDS, format!("entry {i} is {} of {ids} faces", self.face_ids[i]));
        }
        for (spec, n) in
            [(layout::FACE_IDS, self.face_ids.len()), (layout::SIGN_HINTS, self.sign_hints.len())]
        {
            if n != f {
                return wrong(spec, format!("{n} entries for {f} faces"));
            }
        }
        Ok(())
    }

    fn check_lists(&self) -> Result<(), AssetError> {
        let f = self.faces.len() as u32;
        if let Some(high) = &self.palettes_high
            && high.len() != self.palettes.len()
        {
            return wrong(
                layout::PALETTES_HIGH,
                format!("{} entries for {}", high.len(), self.palettes.len()),
            );
        }
        let starts = &self.palette_starts;
        if starts.first() != Some(&0) || starts.last().map(|&s| s as usize) != Some(self.palettes.len()) {
            return wrong(
                layout::PALETTE_STARTS,
                "does not begin at 0 and end at the number of palette faces".into(),
            );
        }
        if let Some(p) = starts.windows(2).position(|w| w[0] > w[1] || w[1] - w[0] > PALETTE_SIZE as u32) {
            return wrong(layout::PALETTE_STARTS, format!("palette {p} has not 0 to {PALETTE_SIZE} faces"));
        }
        if let Some(i) = (0..self.palettes.len()).find(|&i| {
            let high = self.palettes_high.as_ref().map_or(0, |high| high[i]);
            layout::palette_face(self.palettes[i], high) >= f
        }) {
            return wrong(
                layout::PALETTES,
                format!("entry {i} names a face that does not exist ({f} faces)"),
            );
        }
        // Children follow their parents, so the depth of a word is known when the word is reached.
        let (n, roots) = (self.nodes.len(), self.root_count());
        if n < roots {
            return wrong(layout::NODES, format!("{n} words; expected the {roots} roots at least"));
        }
        let mut depth = vec![u8::MAX; n];
        depth[..roots].fill(0);
        // Many cells may share a list, which is checked once. No two lists overlap.
        let (mut known, mut listed) = (vec![0_u64; self.lists.len() / 64 + 1], 0);
        for (i, &word) in self.nodes.iter().enumerate() {
            let bad = |reason: String| wrong(layout::NODES, format!("word {i}: {reason}"));
            if depth[i] == u8::MAX {
                return bad("no word leads to it".into());
            }
            match Node::decode(word, &self.lists) {
                Node::Split(c) => {
                    let c = c as usize;
                    if c <= i || c + 1 >= n || depth[c] != u8::MAX || depth[c + 1] != u8::MAX {
                        return bad(format!("children at {c} of {n} words"));
                    }
                    if u32::from(depth[i]) >= MAX_DEPTH {
                        return bad(format!("deeper than {MAX_DEPTH} bisections"));
                    }
                    let below = depth[i] + 1;
                    depth[c..c + 2].fill(below);
                }
                Node::Listed(_, offset) => {
                    let bit = 1 << (offset % 64);
                    if known.get(offset as usize / 64).is_some_and(|bits| bits & bit != 0) {
                        continue;
                    }
                    match self.check_list(offset) {
                        Err(reason) => return bad(format!("list at byte {offset}: {reason}")),
                        Ok(entries) => listed += entries,
                    }
                    // A list that is not empty begins within the section.
                    known[offset as usize / 64] |= bit;
                    if listed > self.lists.len() {
                        return bad(format!("list at byte {offset}: it overlaps others"));
                    }
                }
                Node::Far(_) | Node::NotOfDomain => {}
            }
        }
        Ok(())
    }

    /// The number of faces of a list. It checks that each face exists.
    fn check_list(&self, offset: u32) -> Result<usize, String> {
        let list = List::decode(&self.lists, offset).ok_or("it runs out of the section")?;
        if list.is_empty() {
            return Err("it is empty".into());
        }
        match list {
            List::Slots(palette, slots) => {
                let palette = palette as usize;
                let [start, end] = self.palette_starts.get(palette..palette + 2).unwrap_or(&[]) else {
                    return Err(format!("palette {palette} does not exist"));
                };
                match slots.iter().find(|&&s| u32::from(s) >= end - start) {
                    Some(s) => Err(format!("slot {s} of a palette of {}", end - start)),
                    None => Ok(list.len()),
                }
            }
            List::Faces(bytes) => {
                let faces = bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
                match faces.into_iter().find(|&f| f as usize >= self.faces.len()) {
                    Some(f) => Err(format!("face {f} of {}", self.faces.len())),
                    None => Ok(list.len()),
                }
            }
        }
    }

    fn check_tree(&self) -> Result<(), AssetError> {
        let (n, f) = (self.tree_children.len(), self.faces.len() as u32);
        if n == 0 || self.tree_boxes.len() != n {
            return wrong(
                layout::TREE_BOXES,
                format!("{} boxes for {n} nodes; at least 1 of each", self.tree_boxes.len()),
            );
        }
        let mut depth = vec![0u8; n];
        let mut covered = 0u64;
        for (i, node) in self.tree_children.iter().enumerate() {
            if usize::from(depth[i]) > AabbTree::MAX_DEPTH {
                return wrong(
                    layout::TREE_CHILDREN,
                    format!("node {i} is deeper than {}", AabbTree::MAX_DEPTH),
                );
            }
            for &word in node {
                match TreeChild::decode(word) {
                    TreeChild::Node(c) if c as usize <= i || c as usize >= n || depth[c as usize] != 0 => {
                        return wrong(layout::TREE_CHILDREN, format!("node {i}: child {c} of {n} nodes"));
                    }
                    TreeChild::Node(c) => depth[c as usize] = depth[i] + 1,
                    TreeChild::Leaf(start, count) => {
                        if start + count > f {
                            return wrong(
                                layout::TREE_CHILDREN,
                                format!("node {i}: faces {start} to {} of {f}", start + count),
                            );
                        }
                        covered += u64::from(count);
                    }
                }
            }
        }
        if covered != u64::from(f) {
            return wrong(layout::TREE_CHILDREN, format!("leaves hold {covered} of {f} faces"));
        }
        Ok(())
    }
}

fn frame_and_cube(placed: &[f64]) -> Result<(LocalFrame, DomainCube), AssetError> {
    let &[x, y, z, scale, u, v, w, side] = placed else {
        return wrong(layout::FRAME, format!("{} numbers; expected 8", placed.len()));
    };
    let positive = |s: f64| s.is_normal() && s > 0.0;
    let sound = |s: f64| positive(s) && (1.0 / s).is_normal();
    if !placed.iter().all(|x| x.is_finite()) || !sound(scale) || !sound(side) {
        return wrong(layout::FRAME, format!("{placed:?} is no frame: finite, scale and side positive"));
    }
    Ok((LocalFrame::new(DVec3::new(x, y, z), scale), DomainCube::new(DVec3::new(u, v, w), side)))
}

fn wrong<T>(spec: super::SectionSpec, reason: String) -> Result<T, AssetError> {
    Err(AssetError::section(spec.name, reason))
}
