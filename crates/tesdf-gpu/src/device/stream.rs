//! The stream of all work.
use cubecl_environment::stream::StreamId;

/// The stream of all work of this crate. By default each thread has a stream of its own, and CubeCL
/// 0.11.3 then loses buffers that one thread has made and another uses ("Memory location points to
/// a different allocation").
pub(crate) const STREAM: StreamId = StreamId { value: 0 };
