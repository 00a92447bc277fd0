//! Each call of CUDA's driver that a detection or a query makes fails in turn, for lack of memory,
//! or so that all later ones fail as well. The replacement of CUDA's driver makes them fail.
use std::ffi::{CStr, c_char, c_int};
use std::process::Command;

use libloading::{Library, Symbol};
use tesdf::collide::{CollideOptions, Mode, Placement, Pose, Reduction, Scene, Shape};
use tesdf::glam::DVec3;
use tesdf_gpu::{Capacities, Detector, DetectorOptions, Device, GpuError, GpuShapes};

use crate::compare::device;
use crate::hidden::two_cubes;
use crate::support::rotation::of_the_day;

/// `CUDA_ERROR_OUT_OF_MEMORY` and `CUDA_ERROR_LAUNCH_FAILED`.
const OUT_OF_MEMORY: c_int = 2;
const LAUNCH_FAILED: c_int = 719;

/// The replacement of CUDA's driver that this process has loaded.
struct Driver(Library);

impl Driver {
    fn find() -> Self {
        // SAFETY: a library without initialisers, which the process has loaded before.
        let library = unsafe { Library::new("libcuda.so") }.expect("the replacement of CUDA's driver");
        Self(library)
    }

    /// Calls number `first` to `last` from now on fail. Returns the number of calls before.
    fn fail(&self, first: u64, last: u64, status: c_int) -> u64 {
        type Fail = unsafe extern "C" fn(u64, u64, c_int) -> u64;
        // SAFETY: the signature is that of `cuda.cpp`.
        unsafe {
            let fail: Symbol<Fail> = self.0.get(b"cuda_on_cpu_fail").expect("no GPU: --skip driver_faults::");
            fail(first, last, status)
        }
    }

    /// The call that failed since, or an empty text.
    fn failed(&self) -> String {
        // SAFETY: as above; the text is constant.
        unsafe {
            let failed: Symbol<unsafe extern "C" fn() -> *const c_char> =
                self.0.get(b"cuda_on_cpu_failed").expect("it is beside the other");
            CStr::from_ptr(failed()).to_string_lossy().into_owned()
        }
    }
}

/// What a program keeps on the device: buffers that have to grow at the first detection, and a
/// shape.
struct Held {
    detector: Detector,
    shapes: GpuShapes,
}

impl Held {
    fn new(device: &Device, scene: &Scene, shape: &Shape) -> Result<Self, GpuError> {
        let capacities = Capacities { contacts: 1, ..Capacities::default() };
        let options = DetectorOptions { capacities, ..DetectorOptions::default() };
        Ok(Self {
            detector: Detector::new(device, scene, options)?,
            shapes: GpuShapes::upload(device, std::slice::from_ref(shape))?,
        })
    }

    /// The contacts of nodes, reduced ones, those of faces, those that stay on the device, and
    /// distances.
    fn answers(&mut self, scene: &Scene) -> Result<String, GpuError> {
        let of = |mode| CollideOptions { contact_distance: 0.01, ..CollideOptions::with_mode(mode) };
        let reduced = CollideOptions { reduction: Reduction::PerPair(2), ..of(Mode::Node) };
        let mut text = format!("{:?}\n", self.detector.detect_timed(scene, &of(Mode::Node))?.as_slice());
        for options in [reduced, of(Mode::exact())] {
            text += &format!("{:?}\n", self.detector.detect(scene, &options)?.as_slice());
        }
        let found = self.detector.detect_on_device(scene, None, &of(Mode::Node))?;
        self.detector.device().wait()?;
        text += &format!("{}\n", found.count);
        let points = [DVec3::ZERO, DVec3::new(0.3, 0.2, 0.9)];
        let id = self.shapes.ids()[0];
        let at = Placement { pose: Pose::IDENTITY, scale: 1.0 };
        Ok(text + &format!("{:?}", self.shapes.signed_distances(&points, &[(id, at)])?))
    }
}

fn scene() -> (Scene, Shape) {
    let scene = two_cubes(0.25);
    let (_, instance) = scene.instances().next().expect("some");
    let shape = scene.shape(instance.shape).expect("its shape").clone();
    (scene, shape)
}

/// Runs a test of this module in a process of its own, because calls fail in all threads.
fn alone(name: &str, test: fn(&Driver, &Device)) {
    const ALONE: &str = "TESDF_TEST_ALONE";
    if std::env::var_os(ALONE).is_some() {
        let device = device();
        return test(&Driver::find(), &device);
    }
    let mut command = Command::new(std::env::current_exe().expect("a test is a program"));
    command.args(["--exact", &format!("driver_faults::{name}"), "--nocapture"]).env(ALONE, "1");
    let output = command.output().expect("it starts");
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && text.contains("1 passed"), "{text}");
}

#[test]
fn a_call_that_fails_once_is_an_error_and_loses_nothing() {
    alone("a_call_that_fails_once_is_an_error_and_loses_nothing", each_call_once);
}

/// The number of calls that answers take once kernels are loaded, and these answers.
fn calls_of(driver: &Driver, whole: impl Fn() -> Result<String, GpuError>) -> (u64, String) {
    whole().expect("nothing fails");
    driver.fail(0, 0, 0);
    let answers = whole().expect("nothing fails");
    (driver.fail(0, 0, 0), answers)
}

fn each_call_once(driver: &Driver, device: &Device) {
    let (scene, shape) = scene();
    let whole = || Held::new(device, &scene, &shape)?.answers(&scene);
    driver.fail(1, u64::MAX, OUT_OF_MEMORY);
    println!("{}", whole().expect_err("no memory"));
    driver.fail(0, 0, 0);
    let (calls, expected) = calls_of(driver, whole);
    let calls = of_the_day(1..=calls);
    let mut errors = 0;
    for call in &calls {
        driver.fail(*call, *call, OUT_OF_MEMORY);
        let mut held = Held::new(device, &scene, &shape);
        let result = held.as_mut().map_err(|e| e.clone()).and_then(|held| held.answers(&scene));
        let failed = driver.failed();
        driver.fail(0, 0, 0);
        assert!(!failed.is_empty(), "call {call} did not come");
        match result {
            Err(error) => {
                println!("{call} {failed}: {error}");
                assert!(error.to_string().contains("out of memory (status 2)"), "{error}");
                errors += 1;
            }
            // Such as a buffer that nothing uses.
            Ok(text) => {
                assert!(text == expected, "call {call}: {failed} was not told");
                println!("{call} {failed}: the same answers");
            }
        }
        if let Ok(held) = &mut held {
            let again = held.answers(&scene).unwrap_or_else(|e| panic!("after call {call}, {failed}: {e}"));
            assert!(again == expected, "after call {call}, {failed}");
        }
    }
    assert!(4 * errors > 3 * calls.len(), "{errors} errors of {} calls", calls.len());
}

#[test]
fn a_device_that_is_lost_is_an_error_from_any_call_on() {
    alone("a_device_that_is_lost_is_an_error_from_any_call_on", each_call_for_good);
}

fn each_call_for_good(driver: &Driver, device: &Device) {
    let (scene, shape) = scene();
    let whole = || Held::new(device, &scene, &shape)?.answers(&scene);
    let (calls, _) = calls_of(driver, whole);
    for call in of_the_day(1..=calls) {
        driver.fail(call, u64::MAX, LAUNCH_FAILED);
        let result = whole();
        let failed = driver.failed();
        driver.fail(0, 0, 0);
        let error = result.expect_err("the device is lost").to_string();
        println!("{call} {failed}: {error}");
        assert!(error.contains("(status 719). All later calls of this process fail, too"), "{error}");
    }
}
