//! NVRTC compiles every kernel. It must be the real one, and needs no GPU: `.ci/kernels.sh`.
use tesdf_gpu::cuda::{Resources, compile};

use crate::cuda_source::SOURCES;

/// Compiles to machine code for GPUs of compute centers. `tesdf-lab kernels` prints its
/// resources.
#[test]
#[ignore = "needs NVRTC: .ci/kernels.sh runs it"]
fn every_kernel_compiles_to_machine_code() {
    for source in SOURCES.iter() {
        let compiled = compile(source, "sm_90a").unwrap_or_else(|e| panic!("{e}"));
        assert!(compiled.image.starts_with(b"\x7fELF"), "{}", source.kernel);
        let resources = compiled.resources.expect("machine code has it");
        println!("{}: {resources}", source.kernel);
        let Resources { registers, .. } = resources;
        assert!((1..=255).contains(&registers), "{}: {registers} registers", source.kernel);
    }
}

/// Compiles to PTX for all GPUs from Turing on.
#[test]
#[ignore = "needs NVRTC: .ci/kernels.sh runs it"]
fn every_kernel_compiles_to_ptx() {
    for source in SOURCES.iter() {
        let compiled = compile(source, "compute_75").unwrap_or_else(|e| panic!("{e}"));
        let text = String::from_utf8_lossy(&compiled.image);
        assert!(text.contains(&format!(".visible .entry {}(", source.entry)), "{}", source.kernel);
    }
}

#[test]
#[ignore = "needs NVRTC: .ci/kernels.sh runs it"]
fn a_refused_kernel_says_why() {
    let mut source = SOURCES[0].clone();
    source.text.push_str("no such thing;");
    let error = compile(&source, "sm_90a").expect_err("no kernel").to_string();
    assert!(error.contains("error: identifier \"no\" is undefined"), "{error}");
}
