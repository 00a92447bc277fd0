//! Contacts of the device against those of the host.
#[path = "../../tesdf/tests/support/mod.rs"]
mod support;

use std::collections::BTreeMap;

use support::bodies::{Placed, RELATIONS, scene};
use support::random::Random;
use tesdf::collide::{CollideOptions, Contact, Mode, Scene, detect};
use tesdf_gpu::{Detector, DetectorOptions, Device};

type Key = (u32, u32, u32, Option<u32>);

fn keyed(contacts: &[Contact], mode: Mode) -> BTreeMap<Key, Contact> {
    let key = |c: &Contact| {
        let cell = if mode == Mode::Node { None } else { c.tet_b };
        (c.instance_a.0, c.instance_b.0, c.feature.a, cell)
    };
    contacts.iter().map(|c| (key(c), *c)).collect()
}

#[derive(Default, Debug)]
struct Compared {
    same: usize,
    only_host: usize,
    only_device: usize,
    far: usize,
    off: f64,
}

fn compare(scene: &Scene, options: &CollideOptions, device: &Device, size: f64) -> Compared {
    let host = detect(scene, options).expect("a good scene");
    let mut detector = Detector::new(device, scene, DetectorOptions::default()).expect("fits");
    let found = detector.detect(scene, options).expect("detects");
    println!("{:?} {:?}", host.statistics, found.statistics);
    let (host, found) = (keyed(&host.contacts, options.mode), keyed(&found.contacts, options.mode));
    let mut compared = Compared::default();
    for (key, h) in &host {
        match found.get(key) {
            None => compared.only_host += 1,
            Some(f) => {
                let off = (h.distance - f.distance).abs() / size;
                compared.same += 1;
                compared.off = compared.off.max(off);
                compared.far += usize::from(off > 1e-5);
            }
        }
    }
    compared.only_device = found.keys().filter(|k| !host.contains_key(k)).count();
    compared
}

#[test]
fn contacts_are_those_of_the_host() {
    let device = Device::choose(None).expect("a device");
    println!("device: {}", device.info().name);
    let mut random = Random(11);
    let names = [["l_bracket", "cube"], ["torus_quads", "tetra"], ["iso_m16_bolt_6k", "iso_m16_nut_c25"]];
    for names in names {
        for relation in RELATIONS {
            let bodies: [Placed; 2] = relation.place(names, &mut random);
            let size = bodies[0].diagonal().max(bodies[1].diagonal());
            for mode in [Mode::Node, Mode::FACE] {
                let options = CollideOptions {
                    contact_distance: 1e-3 * size,
                    cos_theta: Some(0.3),
                    ..CollideOptions::with_mode(mode)
                };
                let start = std::time::Instant::now();
                println!("{names:?} {relation:?} {mode:?}: {:?} {:?}", compare(&scene(&bodies), &options, &device, size), start.elapsed());
            }
        }
    }
}
