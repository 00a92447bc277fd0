//! Buffers of a CUDA device: what was allocated for them, or what others own.
use std::collections::HashMap;
use std::sync::Arc;

use cubecl::server::{BufferBinding, IoError, ServerError};
use cubecl_environment::backtrace::BackTrace;
use cubecl_runtime::memory_management::{ManagedMemoryHandle, ManagedMemoryId};
use cubecl_runtime::storage::{ComputeStorage, StorageHandle, StorageId, StorageUtilization};

use super::driver::Gpu;

/// Bytes that allocations begin at a multiple of.
pub const ALIGNMENT: usize = 256;

/// Allocations of a GPU.
#[derive(Debug)]
pub struct Storage {
    gpu: Arc<Gpu>,
    held: HashMap<StorageId, (u64, u64)>,
}

impl ComputeStorage for Storage {
    /// Where it begins on the device.
    type Resource = u64;

    fn alignment(&self) -> usize {
        ALIGNMENT
    }

    fn get(&mut self, handle: &StorageHandle) -> Result<u64, IoError> {
        let lost = || IoError::StorageHandleNotFound {
            reason: format!("{} on the CUDA device", handle.id).into(),
            backtrace: BackTrace::capture(),
        };
        let (pointer, _) = self.held.get(&handle.id).ok_or_else(lost)?;
        Ok(pointer + handle.offset())
    }

    fn alloc(&mut self, size: u64) -> Result<StorageHandle, IoError> {
        let pointer = self.gpu.allocate(size as usize)?;
        let id = StorageId::new();
        self.held.insert(id, (pointer, size));
        Ok(StorageHandle::new(id, StorageUtilization { offset: 0, size }))
    }

    fn dealloc(&mut self, id: StorageId) {
        if let Some((pointer, _)) = self.held.remove(&id) {
            // SAFETY: it was allocated here, and is now forgotten. A driver that refuses keeps it.
            let _ = unsafe { self.gpu.free(pointer) };
        }
    }

    fn flush(&mut self) {}

    fn bytes_allocated(&self) -> u64 {
        self.held.values().map(|(_, size)| size).sum()
    }
}

/// Whose memory a buffer is.
#[derive(Debug)]
enum Place {
    Ours(StorageHandle),
    /// Pointer.
    Outside(u64),
    /// There was no memory left.
    None,
}

#[derive(Debug)]
struct Allocation {
    /// Knows whether a buffer still refers to it.
    handle: ManagedMemoryHandle,
    place: Place,
    /// Why it does not hold what it should.
    failure: Option<ServerError>,
}

/// All buffers of a device.
#[derive(Debug)]
pub struct Memory {
    storage: Storage,
    allocations: HashMap<ManagedMemoryId, Allocation>,
}

impl Memory {
    pub fn new(gpu: Arc<Gpu>) -> Self {
        Self { storage: Storage { gpu, held: HashMap::new() }, allocations: HashMap::new() }
    }

    /// Takes memory for a buffer.
    pub fn allocate(&mut self, handle: ManagedMemoryHandle, bytes: u64) -> Result<(), ServerError> {
        self.give_back();
        let (place, failure) = match self.storage.alloc(bytes.max(1)) {
            Ok(storage) => (Place::Ours(storage), None),
            Err(error) => (Place::None, Some(ServerError::from(error))),
        };
        self.insert(handle, place, failure.clone());
        failure.map_or(Ok(()), Err)
    }

    /// Takes a pointer that others own as a buffer.
    pub fn adopt(&mut self, handle: ManagedMemoryHandle, pointer: u64) {
        self.insert(handle, Place::Outside(pointer), None);
    }

    fn insert(&mut self, handle: ManagedMemoryHandle, place: Place, failure: Option<ServerError>) {
        self.allocations.insert(handle.descriptor().id, Allocation { handle, place, failure });
    }

    /// Frees what no buffer refers to any more.
    pub fn give_back(&mut self) {
        let storage = &mut self.storage;
        self.allocations.retain(|_, allocation| {
            let is_used = !allocation.handle.is_free();
            if let (false, Place::Ours(held)) = (is_used, &allocation.place) {
                storage.dealloc(held.id);
            }
            is_used
        });
    }

    /// Where a buffer begins.
    pub fn pointer(&mut self, buffer: &BufferBinding) -> Result<u64, ServerError> {
        let lost = || ServerError::Generic {
            reason: "a buffer without memory".into(),
            backtrace: BackTrace::capture(),
        };
        let allocation = self.allocations.get(&buffer.memory.id()).ok_or_else(lost)?;
        let begin = match &allocation.place {
            Place::Ours(held) => self.storage.get(held)?,
            Place::Outside(pointer) => *pointer,
            Place::None => return Err(allocation.failure.clone().unwrap_or_else(lost)),
        };
        Ok(begin + buffer.offset_start.unwrap_or(0))
    }

    /// Whether a buffer holds what it should.
    pub fn check(&self, buffer: &BufferBinding) -> Result<(), ServerError> {
        match self.allocations.get(&buffer.memory.id()).and_then(|a| a.failure.clone()) {
            Some(failure) => Err(failure),
            None => Ok(()),
        }
    }

    /// Notes whether what was to be written was.
    pub fn written<'a>(
        &mut self,
        buffers: impl Iterator<Item = &'a BufferBinding>,
        result: &Result<(), ServerError>,
    ) {
        for buffer in buffers {
            if let Some(allocation) = self.allocations.get_mut(&buffer.memory.id()) {
                allocation.failure = result.as_ref().err().cloned();
            }
        }
    }
}
