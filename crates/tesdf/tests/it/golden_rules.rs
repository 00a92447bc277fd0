//! Files of version 2, whose sign needs more than the winding number of their faces.

use std::path::{Path, PathBuf};

use crate::support::brute_inside::BruteInside;
use crate::support::parts::Parts;
use crate::support::parts::Turn::Outward;
use crate::support::random::Random;
use tesdf::TeSdf;
use tesdf::asset::{AssetError, FORMAT_VERSION_OF_RULES, save_atomic};
use tesdf::base::{Inside, InsideRule, SurfaceFaces};
use tesdf::encode::{Encoder, Preset};
use tesdf::glam::DVec3;
use tesdf::mesh::{SolidMesh, TriangleMesh};

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn overlap() -> TriangleMesh {
    let parts =
        Parts::default().cube(DVec3::ZERO, 2.0, Outward).cube(DVec3::new(1.0, 0.5, 0.25), 1.5, Outward);
    parts.mesh()
}

fn open() -> TriangleMesh {
    Parts::default().open_cube(DVec3::ZERO, 1.0, Outward).mesh()
}

/// Each kind of file, with its mesh and rule.
fn kinds() -> [(&'static str, TriangleMesh, Inside); 3] {
    let boundary = Inside { rule: InsideRule::Winding, surface: SurfaceFaces::Boundary };
    [
        ("golden_asset_v2_boundary", overlap(), boundary),
        ("golden_asset_v2_generalized", open(), InsideRule::Generalized.into()),
        ("golden_asset_v2_sheet", open(), InsideRule::Sheet { thickness: 0.125 }.into()),
    ]
}

fn encode(mesh: &TriangleMesh, inside: Inside) -> TeSdf {
    let solid = SolidMesh::with_inside(mesh.clone(), inside).expect("a solid");
    Encoder::new().preset(Preset::Compact).encode(&solid).expect("encodes")
}

/// Files of this version, written once. They must continue to open and give the same answers.
/// `TESDF_WRITE_GOLDEN=1` writes them.
#[test]
fn the_golden_assets_answer() {
    for (name, mesh, inside) in kinds() {
        let path = path(name);
        if std::env::var_os("TESDF_WRITE_GOLDEN").is_some() {
            save_atomic(&path, encode(&mesh, inside).as_bytes()).expect("a writable folder");
        }
        let asset = TeSdf::open(&path).expect("a golden file of this version opens");
        asset.verify_checksums().expect("intact");
        assert_eq!(
            (asset.container().version(), *asset.inside()),
            (FORMAT_VERSION_OF_RULES, inside),
            "{name}"
        );
        let ids = (0..asset.face_count()).map(|at| asset.face_id(at));
        let brute = BruteInside::new(&mesh, inside.rule, ids);
        let (bounds, diagonal, mut random) = (mesh.bounds(), mesh.diagonal(), Random(8));
        for _ in 0..500 {
            let [x, y, z] = [0, 1, 2].map(|_| random.between(-0.3, 1.3));
            let p = bounds.min + DVec3::new(x, y, z) * bounds.extent();
            let error = brute.error(p, asset.signed_distance(p), 1e-12 * diagonal);
            assert!(error <= 1e-12 * diagonal, "{name}, {p}: {error:e}");
        }
    }
}

#[test]
fn damaged_files_are_refused() {
    for (name, mesh, inside) in kinds() {
        let bytes = encode(&mesh, inside).as_bytes().to_vec();
        for end in 0..bytes.len() {
            assert!(TeSdf::from_bytes(&bytes[..end]).is_err(), "{name}: the first {end} bytes open");
        }
        let mut random = Random(9);
        for at in (0..bytes.len()).step_by(5) {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1 << random.index(8);
            let seen = TeSdf::from_bytes(&damaged).and_then(|asset| asset.verify_checksums());
            assert!(seen.is_err(), "{name}: byte {at}");
            // A file that opens nevertheless answers without a panic.
            if let Ok(asset) = TeSdf::from_bytes(&damaged) {
                for _ in 0..20 {
                    asset.query(4.0 * random.in_cube());
                }
            }
        }
    }
}

/// A reader of version 1 knows no rules, so version and rule belong together.
#[test]
fn the_version_belongs_to_the_rule() {
    let plain = encode(&overlap(), Inside::default()).as_bytes().to_vec();
    let rule = encode(&open(), InsideRule::Generalized.into()).as_bytes().to_vec();
    for (bytes, from, to) in [(plain, "\"1\"", "\"2\""), (rule, "\"2\"", "\"1\"")] {
        let at = bytes.windows(3).position(|w| w == from.as_bytes()).expect("the version");
        let mut other = bytes.clone();
        other[at..at + 3].copy_from_slice(to.as_bytes());
        let error = TeSdf::from_bytes(&other).expect_err("another version");
        assert!(matches!(&error, AssetError::Header { .. }), "{error}");
        other[at + 1] = b'3';
        let error = TeSdf::from_bytes(&other).expect_err("an unknown version");
        assert!(error.to_string().contains("reads versions 1 and 2"), "{error}");
    }
}
