use parry3d::query::PointQuery;
use std::time::Instant;
use tesdf::encode::*;
use tesdf::geometry::*;
use tesdf::glam::DVec3;
use tesdf::mesh::*;
use tesdf::query::*;

fn main() {
    let a: Vec<String> = std::env::args().collect();
    let mesh = tesdf::mesh::read(a[1].as_ref()).unwrap().mesh;
    let mut o = EncodeOptions::default();
    o.byte_worth = a[2].parse().unwrap();
    o.tighten_levels = a[3].parse().unwrap();
    let solid = SolidMesh::new(mesh.clone()).unwrap();
    let t = Instant::now();
    let asset = encode(&solid, &Default::default(), &o, &Default::default()).unwrap();
    asset
        .save(std::path::Path::new(&format!(
            "/tmp/{}.tesdf",
            std::path::Path::new(&a[1]).file_stem().unwrap().to_str().unwrap()
        )))
        .unwrap();
    println!("encode {:.2} s", t.elapsed().as_secs_f64());
    println!("{:?}", asset.about().statistics);
    let sizes: Vec<(String, usize)> =
        asset.container().sections().map(|s| (s.spec.name.to_string(), s.bytes.len())).collect();
    let lt: usize =
        sizes.iter().filter(|s| s.0.starts_with("domain") || s.0.starts_with("lists")).map(|s| s.1).sum();
    println!(
        "{sizes:?}\nlists+tree {:.3} MB, file {:.3} MB = {:.1} B/face, derived {:?}",
        lt as f64 / 1e6,
        asset.as_bytes().len() as f64 / 1e6,
        asset.as_bytes().len() as f64 / mesh.faces().len() as f64,
        asset.derived_bytes()
    );
    let mut seed = 1u64;
    let mut rnd = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    let n = 100_000;
    let diag = mesh.diagonal();
    let tris: Vec<Triangle> = (0..mesh.faces().len()).map(|f| Triangle::new(mesh.triangle(f))).collect();
    let mut cum = vec![];
    let mut acc = 0.0;
    for t in &tris {
        acc += (t.corners[1] - t.corners[0]).cross(t.corners[2] - t.corners[0]).length();
        cum.push(acc);
    }
    let near: Vec<DVec3> = (0..n)
        .map(|_| {
            let x = rnd() * acc;
            let i = cum.partition_point(|c| *c < x).min(tris.len() - 1);
            let t = &tris[i];
            let (u, w) = (rnd().sqrt(), rnd());
            t.corners[0] * (1.0 - u)
                + t.corners[1] * u * (1.0 - w)
                + t.corners[2] * u * w
                + t.normal * (2.0 * rnd() - 1.0) * 0.02 * diag
        })
        .collect();
    let b = mesh.bounds();
    let boxed: Vec<DVec3> = (0..n).map(|_| b.min + b.extent() * DVec3::new(rnd(), rnd(), rnd())).collect();
    let pv: Vec<parry3d::math::Vector> =
        mesh.vertices().iter().map(|v| v.as_vec3().to_array().into()).collect();
    let tm = parry3d::shape::TriMesh::with_flags(
        pv,
        mesh.faces().to_vec(),
        parry3d::shape::TriMeshFlags::ORIENTED,
    )
    .unwrap();
    let boxes: Vec<Aabb> = tris.iter().map(|t| Aabb::of(&t.corners)).collect();
    let tree = AabbTree::build(&boxes, 4);
    let winding = WindingNumber::new(&mesh);
    for (name, points) in [("near", &near), ("box", &boxed)] {
        let (mut tp, mut to, mut t64, mut tb) = (f64::MAX, f64::MAX, f64::MAX, f64::MAX);
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let mut sink = 0.0;
        for _ in 0..3 {
            let t = Instant::now();
            for p in points {
                let q = p.as_vec3();
                let r = tm.project_local_point(q.to_array().into(), false);
                let d = parry3d::math::Vector::from(q.to_array()) - r.point;
                sink += d.length() as f64 + r.is_inside as u8 as f64;
            }
            tp = tp.min(t.elapsed().as_secs_f64());
            let t = Instant::now();
            for p in points {
                let r = asset.query(*p, Precision::F32);
                sink += r.signed_distance + r.gradient.x;
            }
            to = to.min(t.elapsed().as_secs_f64());
            let t = Instant::now();
            let r = one.install(|| asset.query_batch(points, Precision::F32));
            sink += r[7].signed_distance;
            tb = tb.min(t.elapsed().as_secs_f64());
            let t = Instant::now();
            for p in points {
                let r = asset.query(*p, Precision::F64);
                sink += r.signed_distance + r.gradient.x;
            }
            t64 = t64.min(t.elapsed().as_secs_f64());
        }
        let fall = points.iter().filter(|p| asset.reads(**p).tree_nodes > 0).count(); let fr: usize = points.iter().map(|p| { let r = asset.reads(*p); r.tree_nodes + r.tree_faces }).sum(); println!("fallback share {:.4} reads each {:.1}", fall as f64 / n as f64, fr as f64 / fall.max(1) as f64);
        let reads: usize = points.iter().map(|p| asset.reads(*p).total()).sum();
        let (mut e32, mut e64, mut s32, mut s64) = (0f64, 0f64, 0, 0);
        for p in &points[..20000] {
            let d = tree.nearest(*p, |i| tris[i as usize].closest(*p).distance.powi(2)).unwrap().0.sqrt();
            let e = if winding.at(*p) >= 1 { -d } else { d };
            let (x, y) = (
                asset.query(*p, Precision::F32).signed_distance,
                asset.query(*p, Precision::F64).signed_distance,
            );
            e32 = e32.max((x.abs() - d).abs());
            e64 = e64.max((y.abs() - d).abs());
            if x.signum() != e.signum() && d > 1e-6 * diag {
                s32 += 1
            }
            if y.signum() != e.signum() && d > 1e-12 * diag {
                s64 += 1
            }
        }
        println!(
            "{name}: parry {:.0} ns, ours {:.0} ns ({:.2} x), batch {:.0} ns ({:.2} x), f64 {:.0} ns | reads {:.2} | err {:.1e} {:.1e} signs {s32} {s64} ({sink:.3})",
            tp / n as f64 * 1e9,
            to / n as f64 * 1e9,
            tp / to,
            tb / n as f64 * 1e9,
            tp / tb,
            t64 / n as f64 * 1e9,
            reads as f64 / n as f64,
            e32 / diag,
            e64 / diag
        );
    }
}
