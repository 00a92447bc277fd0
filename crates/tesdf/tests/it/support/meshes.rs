use std::path::{Path, PathBuf};
use std::sync::Arc;

use tesdf::TeSdf;
use tesdf::encode::{Encoder, Preset};
use tesdf::mesh::{RepairOptions, SolidMesh, TriangleMesh, read, repair};

/// The asset of a solid, with the preset `fast`.
pub fn encoded(solid: &SolidMesh) -> TeSdf {
    Encoder::new().preset(Preset::Fast).encode(solid).expect("valid options")
}

/// The same, for the shapes of a scene.
pub fn asset(solid: &SolidMesh) -> Arc<TeSdf> {
    Arc::new(encoded(solid))
}

/// A row of `data/MANIFEST.tsv` for a mesh that can be encoded, as it is or after repair.
pub struct Row {
    pub name: String,
    pub path: PathBuf,
    pub faces: usize,
    pub repair: bool,
    pub references: Vec<PathBuf>,
}

/// Meshes with real cracks that only a wider tolerance closes, in the mesh's unit.
const WELDED: [(&str, f64); 1] = [("soup_jitter_obj", 1e-8)];
/// Meshes with cracks that no weld closes. Default repair leaves the cracks and reports them.
pub const CRACKED: [&str; 2] = ["factory_nut_m4_loose_subdiv_3x", "factory_nut_m8_loose_subdiv_3x"];

pub fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data")
}

/// A file of `tests/data/bad`.
pub fn bad(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/bad").join(name)
}

/// The mesh of a file of `tests/data/bad`.
pub fn load(name: &str) -> TriangleMesh {
    read(bad(name)).unwrap_or_else(|e| panic!("{name}: {e}")).mesh
}

/// All rows except those marked for rejection. A missing file fails when it is read.
pub fn manifest() -> Vec<Row> {
    let text = std::fs::read_to_string(data().join("MANIFEST.tsv")).expect("data/MANIFEST.tsv");
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("a header").split('\t').collect();
    let column = |name: &str| header.iter().position(|h| *h == name).expect("a known column");
    let (name, file, faces, references, expect) =
        (column("name"), column("file"), column("faces"), column("reference"), column("expect"));
    lines
        .map(|line| line.split('\t').collect::<Vec<_>>())
        .filter(|row| row[expect] != "reject")
        .map(|row| {
            let folder = if row[file].starts_with("bad/") {
                Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data")
            } else {
                data()
            };
            assert!(matches!(row[expect], "accept" | "accept+note" | "repair"), "{row:?}");
            Row {
                name: row[name].into(),
                path: folder.join(row[file]),
                faces: row[faces].parse().expect("a count"),
                repair: row[expect] == "repair",
                references: row[references]
                    .split(' ')
                    .filter(|r| *r != "-")
                    .map(|r| data().join(r))
                    .collect(),
            }
        })
        .collect()
}

impl Row {
    /// The solid, repaired when the manifest says so.
    pub fn solid(&self) -> Result<SolidMesh, String> {
        let loaded = read(&self.path).map_err(|e| format!("{}: {e}", self.path.display()))?;
        let mut mesh = loaded.mesh;
        if self.repair {
            let weld_tolerance = WELDED.iter().find(|w| w.0 == self.name).map(|w| w.1);
            let options = RepairOptions { weld_tolerance, ..RepairOptions::default() };
            mesh = repair(&mesh, &options).map_err(|e| e.to_string())?.mesh;
        }
        SolidMesh::new(mesh).map_err(|e| e.to_string())
    }

    /// Points of the reference files with their signed distances.
    pub fn reference_points(&self) -> Vec<([f64; 3], f64)> {
        let rows = self.references.iter().flat_map(|path| {
            let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            assert!(text.starts_with("x,y,z,signed_distance"), "{}", path.display());
            let number = |s: &str| s.trim().parse::<f64>().expect("a number");
            text.lines().skip(1).map(|l| l.split(',').map(number).collect::<Vec<_>>()).collect::<Vec<_>>()
        });
        rows.map(|r| ([r[0], r[1], r[2]], r[3])).collect()
    }
}

/// The mesh of a file in `data/`, which must be a solid.
pub fn named(file: &str) -> SolidMesh {
    let path = data().join(file);
    let loaded = read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    SolidMesh::new(loaded.mesh).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}
