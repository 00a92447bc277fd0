//! The CUDA C++ text of a kernel.
use std::sync::Arc;

use cubecl::features::Plane;
use cubecl::ir::{
    DeviceIdentity, DeviceProperties, HardwareProperties, MemoryDeviceProperties, TargetProperties,
    VectorSize,
};
use cubecl::prelude::CubeKernel;
use cubecl::profile::TimingMethod;
use cubecl::server::CubeDim;
use cubecl::{Compiler as _, define_kernel};
use cubecl_cpp::register_supported_types;
use cubecl_cpp::shared::{CompilationOptions, CppCompiler, CppSupportedFeatures};
use cubecl_cpp::target::Cuda;
use cubecl_runtime::kernel::BufferIOAttr;

use crate::GpuError;
use crate::kernels::catalog::{self, Count};

/// Definitions before the text of each kernel.
///
/// CubeCL fuses products into sums on its own. `a·d − b·c` is then no longer equal to
/// `−(b·c − a·d)`, and two faces would disagree about the side on which a ray passes their common
/// edge.
///
/// In exchanges between lanes, CubeCL includes only the lanes that are active together, but the
/// kernels mean all lanes of the subgroup. Lanes that took different branches need not have
/// converged again.
const HEAD: &str = "#define fma(a, b, c) ((a) * (b) + (c))
#define __activemask() 0xFFFFFFFFu
";

/// Kernels for which a bound on registers pays: the start of the function's name, and the least
/// number of resident blocks per multiprocessor. The compiler then spills registers to memory. Most
/// spilled values are read only after the loops; `tesdf-lab kernels`
/// prints the number of spilled bytes.
const BLOCKS: [(&str, u32); 2] = [("narrow_faces_", 24), ("narrow_exact_", 20)];

/// The CUDA C++ text of a kernel.
#[derive(Clone, Debug)]
pub struct CudaSource {
    /// Name of the kernel, with the name of the variant.
    pub kernel: String,
    /// Source of the number of blocks.
    pub count: Count,
    /// Name of the `extern "C"` function to launch.
    pub entry: String,
    /// Threads per block in x, y and z.
    pub threads: (u32, u32, u32),
    /// Dynamic shared memory per block, in bytes.
    pub shared_bytes: usize,
    /// Text of the kernel, without `#include`.
    pub text: String,
    /// Access to each buffer: read, written or both.
    pub(crate) io: Vec<BufferIOAttr>,
}

/// Properties of the GPU for the code generator.
pub(crate) fn properties(
    identity: DeviceIdentity,
    memory: MemoryDeviceProperties,
    hardware: HardwareProperties,
) -> DeviceProperties {
    let mut properties =
        DeviceProperties::new(Default::default(), memory, hardware, TimingMethod::Device, identity);
    register_supported_types(&mut properties);
    properties.features.memory_reinterpret = true;
    properties.features.alignment = true;
    properties.features.device_memory_scope = true;
    properties.features.plane.insert(Plane::Ops);
    properties.features.plane.insert(Plane::Sync);
    properties.features.plane.insert(Plane::NonUniformControlFlow);
    properties
}

/// The least hardware among GPUs of compute capability 7.5 or more.
pub(crate) fn least_hardware() -> HardwareProperties {
    HardwareProperties {
        load_width: 128,
        vector_register_count: None,
        plane_size_min: 32,
        plane_size_max: 32,
        max_bindings: 1024,
        max_shared_memory_size: 48 << 10,
        max_cube_count: (i32::MAX as u32, 65_535, 65_535),
        max_units_per_cube: 1024,
        max_cube_dim: (1024, 1024, 64),
        num_streaming_multiprocessors: None,
        num_cpu_cores: None,
        last_level_cache_size: None,
        num_tensor_cores: None,
        min_tensor_cores_dim: None,
        max_vector_size: VectorSize::MAX,
        cube_mma_reserved_shared_memory: 0,
    }
}

/// Generates the text of every kernel in every variant, with direct or indirect counts as the host
/// launches it.
///
/// # Errors
/// [`GpuError::Kernel`] for a kernel that CUDA C++ cannot express.
pub fn sources() -> Result<Vec<CudaSource>, GpuError> {
    let identity = DeviceIdentity { name: "CUDA".into(), fingerprint: "cuda".into(), physical: None };
    let properties = properties(identity, MemoryDeviceProperties::new(1 << 30, 256), least_hardware());
    let kernels = catalog::kernels(&Arc::new(properties), &Arc::new(TargetProperties::default()));
    let text = |named: &catalog::Named| {
        let direct = source(&*named.kernel, &named.name)?;
        match named.count {
            Count::Direct => Ok(direct),
            Count::Indirect => direct.counted_by_device(),
        }
    };
    kernels.iter().map(text).collect()
}

/// Generates the text of a kernel with a direct count.
pub(crate) fn source(kernel: &dyn CubeKernel, name: &str) -> Result<CudaSource, GpuError> {
    let refused = |reason: String| GpuError::Kernel { kernel: name.to_owned(), reason };
    let definition = define_kernel(kernel).map_err(|e| refused(e.to_string()))?;
    let entry = definition.settings.kernel_name.clone();
    let threads = CubeDim::from(definition.settings.cube_dim);
    let options = CompilationOptions {
        supports_features: CppSupportedFeatures { grid_constants: true, ..Default::default() },
        ..Default::default()
    };
    let compiled =
        CppCompiler::<Cuda>::default().compile(definition, &options).map_err(|e| refused(e.to_string()))?;
    Ok(CudaSource {
        kernel: name.to_owned(),
        count: Count::Direct,
        threads: (threads.x, threads.y, threads.z),
        shared_bytes: compiled.shared_memory_size,
        text: format!("{HEAD}{}", bounded(&compiled.source, &entry)),
        io: compiled.io,
        entry,
    })
}

/// Adds the bound of [`BLOCKS`] to the text.
fn bounded(text: &str, entry: &str) -> String {
    match BLOCKS.iter().find(|(name, _)| entry.starts_with(name)) {
        Some((_, blocks)) => {
            let (before, after) = text.split_once("__launch_bounds__(").unwrap_or((text, ""));
            match after.split_once(')') {
                Some((threads, rest)) => format!("{before}__launch_bounds__({threads}, {blocks}){rest}"),
                None => text.to_owned(),
            }
        }
        None => text.to_owned(),
    }
}

impl CudaSource {
    /// The same kernel with an indirect count.
    pub(crate) fn counted_by_device(self) -> Result<Self, GpuError> {
        let Some(text) = indirect(&self.text, &self.entry) else {
            let reason = format!("no function {} as it is expected in\n{}", self.entry, self.text);
            return Err(GpuError::Kernel { kernel: self.kernel, reason });
        };
        Ok(Self { count: Count::Indirect, entry: format!("{}_indirect", self.entry), text, ..self })
    }
}

/// Puts a loop over the blocks around the kernel and reads their number from a buffer, as the
/// module's documentation describes.
fn indirect(text: &str, entry: &str) -> Option<String> {
    let head = text.find("extern \"C\" __global__")?;
    let open = head + text[head..].find(&format!("{entry}("))? + entry.len();
    let body = open + text[open..].find(") {")?;
    let qualifiers = text[head..open].strip_suffix(entry)?;
    let parameters = &text[open + 1..body];
    let names: Vec<&str> = parameters.split(", ").map(|p| p.rsplit(' ').next().unwrap_or(p)).collect();
    let arguments = names.join(", ");
    // Only a kernel can have grid constants as parameters. The body is inlined, because the
    // parameters of a function take registers (two for each pointer) and those of a kernel take
    // none (narrow phase of faces: 96 registers instead of 127).
    let inner = parameters.replace("__grid_constant__ ", "");
    let before = &text[..head];
    let after = &text[body..];
    Some(format!(
        "{before}#define blockIdx tesdf_block
#define gridDim tesdf_grid
static __device__ __forceinline__ void {entry}(const uint3 tesdf_block, const uint3 tesdf_grid, {inner}{after}
#undef blockIdx
#undef gridDim
{qualifiers}{entry}_indirect({parameters}, uint32_t const* const tesdf_count) {{
    const uint3 grid = {{tesdf_count[0], tesdf_count[1], tesdf_count[2]}};
    const uint32_t slab = grid.x * grid.y;
    const uint32_t blocks = slab * grid.z;
    for (uint32_t i = blockIdx.x; i < blocks; i += gridDim.x) {{
        const uint32_t rest = i % slab;
        const uint3 block = {{rest % grid.x, rest / grid.x, i / slab}};
        {entry}(block, grid, {arguments});
        __syncthreads();
    }}
}}
"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_is_put_beside_the_threads() {
        let text = "void __launch_bounds__(32)  narrow_faces_1(int a) {}";
        assert_eq!(
            bounded(text, "narrow_faces_1"),
            "void __launch_bounds__(32, 24)  narrow_faces_1(int a) {}"
        );
        assert_eq!(bounded(text, "narrow_nodes_1"), text);
    }

    #[test]
    fn an_indirect_count_is_a_loop_around_the_same_body() {
        let text = "struct s {};\nextern \"C\" __global__ void __launch_bounds__(64)  k_1(uint32_t* const __restrict__ a, __grid_constant__ \
                    info_st const info) {\na[blockIdx.x] = gridDim.x;\n}\n";
        let looped = indirect(text, "k_1").expect("a kernel");
        assert!(
            looped.contains(
                "void k_1(const uint3 tesdf_block, const uint3 tesdf_grid, uint32_t* const __restrict__ a, "
            ),
            "{looped}"
        );
        assert!(
            looped.contains("__launch_bounds__(64)  k_1_indirect(uint32_t* const __restrict__ a, "),
            "{looped}"
        );
        assert!(looped.contains("k_1(block, grid, a, info);"), "{looped}");
        assert!(indirect(text, "k_2").is_none());
    }
}
