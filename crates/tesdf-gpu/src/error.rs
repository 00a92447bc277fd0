/// Why something could not be done on a device.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GpuError {
    /// This machine has no device that kernels can run on.
    #[error(
        "no GPU device was found; expected a Vulkan, Metal or DirectX 12 driver. On Debian and Ubuntu: `apt install libvulkan1 \
         mesa-vulkan-drivers` for AMD, Intel and the software device, the package nvidia-driver for NVIDIA"
    )]
    NoDevice,
    /// No device of this machine is meant by a name or number.
    #[error("no device is named {asked:?}; this machine has {}", list(.found))]
    NoSuchDevice {
        /// What was asked for.
        asked: String,
        /// Names of the devices there are.
        found: Vec<String>,
    },
    /// The device refused a buffer, a kernel or a read.
    #[error("{device}: {doing}: {reason}")]
    Device {
        /// Name of the device.
        device: String,
        /// What was being done.
        doing: &'static str,
        /// What the driver said.
        reason: String,
    },
    /// A scene or options that no detector takes.
    #[error(transparent)]
    Collide(#[from] tesdf::collide::CollideError),
    /// What kernels cannot do.
    #[error("{what} is not available on a device; {instead}")]
    Unavailable {
        /// What was asked for.
        what: String,
        /// What to do instead.
        instead: &'static str,
    },
    /// Fixed memory that does not hold what a scene needs. Nothing was lost: there is no result.
    #[error(
        "{device}: buffer {buffer:?} holds {capacity} elements; the scene needs {needed}. Raise it, or let buffers grow"
    )]
    Full {
        /// Name of the device.
        device: String,
        /// Which buffer.
        buffer: &'static str,
        /// Elements that it holds.
        capacity: u32,
        /// Elements that are needed.
        needed: u32,
    },
    /// An array on a device that is too short, or not whole.
    #[error("array {array:?} has {found} elements; expected {expected}")]
    Length {
        /// Which array.
        array: &'static str,
        /// Elements that it has.
        found: usize,
        /// What was expected.
        expected: String,
    },
    /// A kernel that a compiler refused.
    #[error("kernel {kernel}: {reason}")]
    Kernel {
        /// Its name.
        kernel: String,
        /// What the compiler said.
        reason: String,
    },
    /// Kernels cannot be compiled for CUDA.
    #[error(
        "NVRTC, which compiles kernels for CUDA, was not found; expected libnvrtc.so.12 or nvrtc64_12.dll. Install the CUDA toolkit 12, \
         or `pip install nvidia-cuda-nvrtc-cu12` and put its folder nvidia/cuda_nvrtc/lib into LD_LIBRARY_PATH"
    )]
    NoNvrtc,
    /// A shape that kernels cannot read.
    #[error("shape {number}: {reason}")]
    Shape {
        /// Its place in the list that was to be uploaded.
        number: usize,
        /// What was found, and what was expected.
        reason: String,
    },
    /// An instance that cannot be.
    #[error("instance {instance}: {reason}")]
    Instance {
        /// Its place in the list.
        instance: usize,
        /// What was found, and what was expected.
        reason: String,
    },
    /// A buffer is larger than the device can bind.
    #[error(
        "{device}: buffer {buffer:?} needs {needed} bytes; the device binds {limit} at most. Split the scene, or raise the limit of the driver"
    )]
    TooLarge {
        /// Name of the device.
        device: String,
        /// Which buffer.
        buffer: &'static str,
        /// Bytes that are needed.
        needed: u64,
        /// Bytes that there can be.
        limit: u64,
    },
}

fn list(names: &[String]) -> String {
    let numbered: Vec<String> = names.iter().enumerate().map(|(i, name)| format!("{i}: {name}")).collect();
    numbered.join(", ")
}
