use std::sync::Arc; use std::time::Instant;
use tesdf::{TeSdf, collide::*, glam::*};
fn main() {
    let f: Vec<String> = std::env::args().collect();
    let [bolt, nut] = [&f[1], &f[2]].map(|p| Arc::new(TeSdf::open(std::path::Path::new(p)).unwrap()));
    let unit = bolt.bounds().extent().z / 40.0;
    for (name, dz, turn) in [("mated", 5.0, 5.0), ("pushed", 5.2, 5.0), ("random", 5.3, 2.2), ("apart", 60.0, 1.0), ("same", 0.0, 0.0)] {
        let mut s = Scene::new();
        let (x, y) = (s.add_shape(bolt.clone()).unwrap(), s.add_shape(nut.clone()).unwrap());
        let pose = Pose::new(DVec3::new(0.0, 0.0, dz * unit), DQuat::from_rotation_z(std::f64::consts::PI * turn)).unwrap();
        let a = s.add(Instance::new(x, Pose::IDENTITY)).unwrap();
        let b = s.add(Instance::new(if name == "same" {x} else {y}, pose)).unwrap();
        for _ in 0..2 {
            let t = Instant::now();
            let c = clearance(&s, a, b, &ClearanceOptions::default()).unwrap();
            println!("{name}: {:?} {} mm conv {}", t.elapsed(), c.distance / unit, c.converged);
        }
        let t = Instant::now();
        let n = detect(&s, &CollideOptions::default()).unwrap();
        println!("   detect {:?} {} contacts", t.elapsed(), n.contacts.len());
    }
}
