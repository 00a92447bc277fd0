use std::sync::atomic::*;
use tesdf::{domain::*, encode::{refine::*, surface::*}, geometry::*, mesh::*};
use glam::DVec3;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let text = std::fs::read_to_string(&a[1]).unwrap();
    let (mut v, mut f) = (vec![], vec![]);
    for l in text.lines() {
        let t: Vec<&str> = l.split_whitespace().collect();
        if t.is_empty() { continue; }
        if t[0] == "v" { v.push(DVec3::new(t[1].parse().unwrap(), t[2].parse().unwrap(), t[3].parse().unwrap())); }
        if t[0] == "f" { let i: Vec<u32> = t[1..].iter().map(|x| x.split('/').next().unwrap().parse::<u32>().unwrap() - 1).collect();
            for k in 1..i.len()-1 { f.push([i[0], i[k], i[k+1]]); } }
    }
    let byte: f64 = a[2].parse().unwrap(); let extra: u32 = a[3].parse().unwrap();
    let floor: f64 = a[4].parse().unwrap();
    let mesh = TriangleMesh::new(v, f).unwrap();
    let frame = LocalFrame::of(mesh.bounds());
    let surface = Surface::new(&mesh, frame);
    let tris = surface.triangles.clone();
    let boxes: Vec<Aabb> = tris.iter().map(|t| Aabb::of(&t.corners)).collect();
    let tree = AabbTree::build(&boxes, 4);
    let b = mesh.bounds();
    let diag = mesh.diagonal() * frame.scale;
    let lb = Aabb { min: frame.to_local(b.min), max: frame.to_local(b.max) };
    let band = 0.05 * diag;
    let cube = DomainCube::around(lb.grown(band));
    // crude inside: solid angle
    let inside = |p: DVec3| { let mut w = 0.0; for t in &tris { let [a,b,c] = t.corners.map(|x| x-p); let (la,lb,lc)=(a.length(),b.length(),c.length());
        w += 2.0*a.dot(b.cross(c)).atan2(la*lb*lc + a.dot(b)*lc + b.dot(c)*la + c.dot(a)*lb); } w > 6.28 };
    let near = 0.01 * diag;
    let cancel = AtomicBool::new(false); let done = AtomicU64::new(0);
    let r = Refiner { surface: &surface, weights: Weights { byte: byte / surface.faces.len() as f64, near, per_volume: 1.0 / (surface.area * 2.0 * 2.0 * near),
        far_faces: 80.0, far_list: 48, far_distance: 0.025 * diag, floor, extra_levels: extra }, band, regions: &[], inside: &inside, cancel: &cancel, done: &done };
    let t0 = std::time::Instant::now();
    use rayon::prelude::*;
    let mut trees: Vec<Tree> = (0..6).into_par_iter().map(|k| r.root(&cube, k).unwrap()).collect();
    let t = t0.elapsed().as_secs_f64();
    let lev: u32 = a[5].parse().unwrap();
    let t1 = std::time::Instant::now();
    fn tight(t: &mut Tree, c: Cell, surface: &Surface, lev: u32, s: &mut tesdf::encode::filter::Scratch) { match t {
        Tree::Split(b) => { let [x, y] = &mut **b; if c.depth < 10 { rayon::join(|| tight(x, c.child(0), surface, lev, &mut Default::default()), || tight(y, c.child(1), surface, lev, &mut Default::default())); } else { tight(x, c.child(0), surface, lev, s); tight(y, c.child(1), surface, lev, s); } }
        Tree::Leaf(Leaf::Listed { faces, .. }) => { *faces = tesdf::encode::tighten::tighten(surface, &c, faces, lev, s); }
        _ => {} } }
    if lev > 0 { trees.par_iter_mut().enumerate().for_each(|(k, t)| tight(t, cube.root(k), &surface, lev, &mut Default::default())); }
    println!("tighten {:.2}", t1.elapsed().as_secs_f64());
    // stats
    struct S { cells: usize, entries: usize, far: usize, out: usize, vol: f64, volw: f64, farvol: f64, maxl: usize, cross: usize, hist: [usize; 12] }
    let mut s = S { cells: 0, entries: 0, far: 0, out: 0, vol: 0.0, volw: 0.0, farvol: 0.0, maxl: 0, cross: 0, hist: [0; 12] };
    fn walk(t: &Tree, c: Cell, s: &mut S) { match t {
        Tree::Split(b) => { walk(&b[0], c.child(0), s); walk(&b[1], c.child(1), s); }
        Tree::Leaf(Leaf::Outside) => s.out += 1,
        Tree::Leaf(Leaf::Far) => { s.far += 1; s.farvol += c.volume(); }
        Tree::Leaf(Leaf::Listed { faces, crossing }) => { s.cells += 1; s.entries += faces.len(); s.vol += c.volume(); s.volw += c.volume() * faces.len() as f64; s.maxl = s.maxl.max(faces.len()); s.cross += *crossing as usize; s.hist[(c.depth as usize/4).min(11)] += 1; }
    } }
    for (k, t) in trees.iter().enumerate() { walk(t, cube.root(k), &mut s); }
    // near-surface queries
    let mut seed = 1u64; let mut rnd = || { seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407); (seed >> 11) as f64 / (1u64 << 53) as f64 };
    let mut cum = vec![]; let mut acc = 0.0; for t in &tris { acc += (t.corners[1]-t.corners[0]).cross(t.corners[2]-t.corners[0]).length(); cum.push(acc); }
    let (mut nq, mut total, mut farq, mut worst) = (0, 0, 0, 0.0f64);
    for _ in 0..20000 {
        let x = rnd() * acc; let i = cum.partition_point(|c| *c < x).min(tris.len()-1);
        let t = &tris[i]; let (u, w) = (rnd().sqrt(), rnd());
        let p = t.corners[0]*(1.0-u) + t.corners[1]*u*(1.0-w) + t.corners[2]*u*w + t.normal * (2.0*rnd()-1.0) * 0.02 * diag;
        let Some((root, mut l)) = cube.locate(p) else { continue };
        let mut t = &trees[root]; let mut depth = 0;
        while let Tree::Split(b) = t { t = &b[l.descend(depth)]; depth += 1; }
        nq += 1;
        match t { Tree::Leaf(Leaf::Listed { faces, .. }) => { total += faces.len();
            let d = faces.iter().map(|&f| tris[f as usize].closest(p).distance).fold(f64::INFINITY, f64::min);
            let e = tree.nearest(p, |i| tris[i as usize].closest(p).distance.powi(2)).unwrap().0.sqrt();
            worst = worst.max((d - e).abs());
        }
            _ => farq += 1 }
    }
    // true lists by sampling
    fn cells<'a>(t: &'a Tree, c: Cell, out: &mut Vec<(Cell, &'a Vec<u32>)>) { match t { Tree::Split(b) => { cells(&b[0], c.child(0), out); cells(&b[1], c.child(1), out); } Tree::Leaf(Leaf::Listed { faces, .. }) => out.push((c, faces)), _ => {} } }
    let mut all = vec![]; for (k, t) in trees.iter().enumerate() { cells(t, cube.root(k), &mut all); }
    let (mut tl, mut tt) = (0, 0);
    for (c, faces) in all.iter().step_by(all.len() / 300) {
        let mut seen = std::collections::BTreeSet::new();
        for _ in 0..4000 { let mut w = [rnd(), rnd(), rnd(), rnd()].map(|x| -(x + 1e-300).ln()); let sum: f64 = w.iter().sum(); w = w.map(|x| x / sum);
            let p = c.corners[0]*w[0]+c.corners[1]*w[1]+c.corners[2]*w[2]+c.corners[3]*w[3];
            let f = faces.iter().min_by(|&&a, &&b| tris[a as usize].closest(p).distance.total_cmp(&tris[b as usize].closest(p).distance)).unwrap(); seen.insert(*f); }
        tl += faces.len(); tt += seen.len();
    }
    println!("listed / sampled true: {} / {} = {:.2}", tl, tt, tl as f64 / tt as f64);
    println!("F {} time {t:.2} cells {} cross {} mean list {:.1} max {} far {} out {} | est bytes {:.2} MB | near {:.2} (far {:.4}) vol-weighted {:.2} far vol {:.3} worst {worst:.1e}", tris.len(), s.cells, s.cross, s.entries as f64 / s.cells as f64, s.maxl, s.far, s.out,
        (s.entries as f64 + 14.0 * s.cells as f64 + 8.0 * (s.out + s.far) as f64) / 1e6, total as f64 / nq as f64, farq as f64 / nq as f64, s.volw / s.vol, s.farvol / (s.vol + s.farvol));
    println!("depth/4 hist {:?}", s.hist);
}
