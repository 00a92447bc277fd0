//! Checks the CUDA C++ text of all kernels, which takes long to make.
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::LazyLock;

use tesdf_gpu::cuda::{Count, CudaSource, sources};

pub static SOURCES: LazyLock<Vec<CudaSource>> = LazyLock::new(|| sources().unwrap_or_else(|e| panic!("{e}")));

/// Checks the order of arguments that launches rely on: pointers, then scalars and lengths by
/// value.
#[test]
#[ignore = "minutes, for one text: .ci/kernels.sh runs it where a kernel changes"]
fn arguments_are_pointers_then_scalars_and_lengths() {
    let named = |name: &str| SOURCES.iter().find(|s| s.kernel == name).expect("the kernel is listed");
    let direct = named("query::batch::signed_distances");
    let parameters = parameters(direct);
    // Buffers: three for the shapes, two for the instances, one each for points, answers and faces.
    let types: Vec<&str> = parameters.iter().map(|p| p.split_whitespace().next().unwrap_or("")).collect();
    let rows = "float_4";
    assert_eq!(
        types[..8].iter().map(|t| t.trim_end_matches('*')).collect::<Vec<_>>(),
        ["uint32_t", "uint32_t", rows, rows, "uint32_t", rows, rows, "uint32_t"],
    );
    assert_eq!(parameters.len(), 9);
    assert!(parameters[8].starts_with("__grid_constant__ info_st const "), "{}", parameters[8]);
    assert_eq!(direct.threads, (64, 1, 1));
    // Three scalars are padded to four. Eight lengths follow.
    let info = between(&direct.text, "struct info_st {", "};");
    let fields: Vec<&str> = info.split_inclusive(';').map(str::trim).filter(|f| !f.is_empty()).collect();
    assert_eq!(fields, ["uint32_t scalars_u32[4];", "uint32_t static_meta[8];"]);
    let indirect = named("bodies::nodes::nodes");
    assert!(indirect.count == Count::Indirect && indirect.entry.ends_with("_indirect"));
    assert!(indirect.text.contains(&format!(" {}(", indirect.entry)));
    assert!(
        indirect.text.contains(" info_v") && indirect.text.contains(", uint32_t const* const tesdf_count) {")
    );
}

/// The catalog has every kernel of `src/kernels`.
#[test]
#[ignore = "minutes, for one text: .ci/kernels.sh runs it where a kernel changes"]
fn every_kernel_is_listed() {
    let listed: BTreeSet<String> =
        SOURCES.iter().map(|s| s.kernel.split(' ').next().unwrap_or("").to_owned()).collect();
    let mut written = BTreeSet::new();
    add_kernels(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src/kernels"), "", &mut written);
    assert_eq!(listed, written);
}

/// Adds the names of the kernels in a folder, with their modules.
fn add_kernels(folder: &Path, modules: &str, names: &mut BTreeSet<String>) {
    for file in std::fs::read_dir(folder).expect("a folder") {
        let path = file.expect("a file").path();
        let module = format!("{modules}{}::", path.file_stem().expect("a name").to_string_lossy());
        if path.is_dir() {
            add_kernels(&path, &module, names);
            continue;
        }
        let text = std::fs::read_to_string(&path).expect("text");
        let kernels = text.split("#[cube(launch").skip(1).map(|after| between(after, "fn ", "("));
        names.extend(kernels.map(|name| format!("{module}{name}")));
    }
}

fn parameters(source: &CudaSource) -> Vec<&str> {
    between(&source.text, &format!("{}(", source.entry), ") {").split(", ").collect()
}

fn between<'a>(text: &'a str, from: &str, to: &str) -> &'a str {
    let rest = text.split_once(from).expect(from).1;
    rest.split_once(to).expect(to).0
}
