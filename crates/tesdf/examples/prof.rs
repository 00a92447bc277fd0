use std::time::Instant;
use tesdf::{TeSdf, glam::DVec3, query::*};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let asset = TeSdf::open(a[1].as_ref()).unwrap();
    let mut seed = 1u64;
    let mut rnd = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    let n = 100_000;
    let f = asset.face_count();
    let diag = asset.about().statistics.diagonal;
    let mut cum = vec![];
    let mut acc = 0.0;
    for i in 0..f {
        let t = asset.face_corners(i);
        acc += (t[1] - t[0]).cross(t[2] - t[0]).length();
        cum.push(acc);
    }
    let near: Vec<DVec3> = (0..n)
        .map(|_| {
            let x = rnd() * acc;
            let i = cum.partition_point(|c| *c < x).min(f - 1);
            let t = asset.face_corners(i);
            let (u, w) = (rnd().sqrt(), rnd());
            let nn = (t[1] - t[0]).cross(t[2] - t[0]).normalize();
            t[0] * (1.0 - u) + t[1] * u * (1.0 - w) + t[2] * u * w + nn * (2.0 * rnd() - 1.0) * 0.02 * diag
        })
        .collect();
    let near: Vec<DVec3> = if a.len() > 3 {
        let m: usize = a[3].parse().unwrap();
        (0..n).map(|i| near[i % m]).collect()
    } else {
        near
    };
    let reps: usize = a[2].parse().unwrap();
    let mut s = 0.0;
    let t = Instant::now();
    for _ in 0..reps {
        for p in &near {
            s += asset.query(*p, Precision::F32).signed_distance;
        }
    }
    println!("query {:.1} ns {s}", t.elapsed().as_secs_f64() / (reps * n) as f64 * 1e9);
    let t = Instant::now();
    for _ in 0..reps {
        s += asset.query_batch(&near, Precision::F32)[5].signed_distance;
    }
    println!("batch {:.1} ns {s}", t.elapsed().as_secs_f64() / (reps * n) as f64 * 1e9);
}
