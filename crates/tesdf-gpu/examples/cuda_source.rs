//! Prints kernels as CUDA C++: `cargo run -p tesdf-gpu --example cuda_source [PART OF A NAME]`. It
//! needs neither CUDA nor a GPU.
use tesdf_gpu::cuda::sources;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let part = std::env::args().nth(1).unwrap_or_default();
    for source in sources()?.iter().filter(|s| s.kernel.contains(&part)) {
        let (x, y, z) = source.threads;
        println!(
            "// {}: {}<<<blocks, ({x}, {y}, {z}), {}>>>\n{}",
            source.kernel, source.entry, source.shared_bytes, source.text
        );
    }
    Ok(())
}
