/// The reason why an operation on a device failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// This machine has no device that kernels can run on.
    #[error(
        "no GPU device was found; expected a Vulkan, Metal or DirectX 12 driver. On Debian and Ubuntu: `apt install libvulkan1 \
         mesa-vulkan-drivers` for AMD, Intel and the software device, the package nvidia-driver for NVIDIA"
    )]
    NoDevice,
    /// No device has the requested name or number.
    #[error("no device is named {asked:?}; this machine has {}", list(.found))]
    NoSuchDevice {
        /// Name or number that was requested.
        asked: String,
        /// Names of all devices, in the order of [`devices`](crate::devices).
        found: Vec<String>,
    },
    /// A buffer, a launch, a timing or a read on the device failed.
    #[error("{device}: {doing}: {reason}")]
    Device {
        /// Name of the device.
        device: String,
        /// The operation that failed, or the name of the buffer that was read.
        doing: &'static str,
        /// Message of the driver.
        reason: String,
    },
    /// The scene or the options are invalid on every device.
    #[error(transparent)]
    Collide(#[from] tesdf::collide::CollideError),
    /// This device has no such operation.
    #[error("{what} is not available on a device; {instead}")]
    Unavailable {
        /// The operation that was requested.
        what: String,
        /// Advice: what to do instead.
        instead: &'static str,
    },
    /// A buffer of fixed size is too small for the scene. The detection returns no contacts.
    #[error(
        "{device}: buffer {buffer:?} holds {capacity} elements; the scene needs {needed}. Raise it, or let buffers grow"
    )]
    Full {
        /// Name of the device.
        device: String,
        /// Name of the buffer.
        buffer: &'static str,
        /// Capacity of the buffer, in elements.
        capacity: u32,
        /// Elements that the scene needs.
        needed: u32,
    },
    /// An array on a device has the wrong length.
    #[error("array {array:?} has {found} elements; expected {expected}")]
    Length {
        /// Name of the array.
        array: &'static str,
        /// Length of the array, in numbers.
        found: usize,
        /// The length that is expected, in words.
        expected: String,
    },
    /// CUDA C++ cannot express a kernel, or NVRTC rejects it.
    #[error("kernel {kernel}: {reason}")]
    Kernel {
        /// Name of the kernel.
        kernel: String,
        /// Messages of the compiler.
        reason: String,
    },
    /// The library NVRTC, which compiles kernels for CUDA, is missing.
    #[error(
        "NVRTC, which compiles kernels for CUDA, was not found; expected libnvrtc.so, libnvrtc.so.13 or libnvrtc.so.12 (Windows: \
         nvrtc64_130_0.dll or nvrtc64_120_0.dll). Install the CUDA toolkit 12 or 13, or `pip install nvidia-cuda-nvrtc` and put its folder \
         nvidia/cu13/lib into LD_LIBRARY_PATH"
    )]
    NoNvrtc,
    /// The kernels cannot read a shape, or cannot move its vertices.
    #[error("shape {number}: {reason}")]
    Shape {
        /// Index of the shape in the list of uploaded shapes.
        number: usize,
        /// What is wrong with the shape, and what is expected.
        reason: String,
    },
    /// An instance refers to a shape that was not uploaded.
    #[error("instance {instance}: {reason}")]
    Instance {
        /// Index of the instance in the list.
        instance: usize,
        /// What is wrong with the instance, and what is expected.
        reason: String,
    },
    /// A buffer is larger than the device allows.
    #[error(
        "{device}: buffer {buffer:?} needs {needed} bytes; the device binds {limit} at most. Split the scene, or raise the limit of the driver"
    )]
    TooLarge {
        /// Name of the device.
        device: String,
        /// Name of the buffer.
        buffer: &'static str,
        /// Size that the buffer needs, in bytes.
        needed: u64,
        /// Largest size that the device can bind, in bytes.
        limit: u64,
    },
}

fn list(names: &[String]) -> String {
    let numbered: Vec<String> = names.iter().enumerate().map(|(i, name)| format!("{i}: {name}")).collect();
    numbered.join(", ")
}
