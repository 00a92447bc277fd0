//! Buffers of a CUDA device: allocated here, or in memory of other libraries.
use std::collections::HashMap;
use std::sync::Arc;

use cubecl::server::{BufferBinding, IoError, ServerError};
use cubecl_environment::backtrace::BackTrace;
use cubecl_runtime::memory_management::{ManagedMemoryHandle, ManagedMemoryId};
use cubecl_runtime::storage::{ComputeStorage, StorageHandle, StorageId, StorageUtilization};

use super::driver::{Failure, Gpu};

/// Every allocation begins at a multiple of this number of bytes.
pub const ALIGNMENT: usize = 256;

/// Allocations of a GPU.
#[derive(Debug)]
pub struct Storage {
    gpu: Arc<Gpu>,
    held: HashMap<StorageId, (u64, u64)>,
}

impl ComputeStorage for Storage {
    /// Address on the device.
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
            // SAFETY: the memory was allocated here, and its entry was just removed. If the driver
            // refuses, the memory stays allocated.
            let _ = unsafe { self.gpu.free(pointer) };
        }
    }

    fn flush(&mut self) {}

    fn bytes_allocated(&self) -> u64 {
        self.held.values().map(|(_, size)| size).sum()
    }
}

/// Origin of a buffer's memory.
#[derive(Debug)]
enum Place {
    Ours(StorageHandle),
    /// Memory of another library, at this address.
    Outside(u64),
    /// The allocation failed for lack of memory.
    None,
}

#[derive(Debug)]
struct Allocation {
    /// Tells whether a buffer still refers to this memory.
    handle: ManagedMemoryHandle,
    place: Place,
    /// The reason why the contents are invalid.
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

    /// Allocates memory for a buffer, where the context is `current`.
    pub fn allocate(
        &mut self,
        handle: ManagedMemoryHandle,
        bytes: u64,
        current: Result<(), Failure>,
    ) -> Result<(), ServerError> {
        self.give_back();
        let (place, failure) =
            match current.map_err(IoError::from).and_then(|()| self.storage.alloc(bytes.max(1))) {
                Ok(storage) => (Place::Ours(storage), None),
                Err(error) => (Place::None, Some(ServerError::from(error))),
            };
        self.insert(handle, place, failure.clone());
        failure.map_or(Ok(()), Err)
    }

    /// Registers an address of another library as a buffer.
    pub fn adopt(&mut self, handle: ManagedMemoryHandle, pointer: u64) {
        self.insert(handle, Place::Outside(pointer), None);
    }

    fn insert(&mut self, handle: ManagedMemoryHandle, place: Place, failure: Option<ServerError>) {
        self.allocations.insert(handle.descriptor().id, Allocation { handle, place, failure });
    }

    /// Frees the memory that no buffer refers to any more.
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

    /// Address of a buffer on the device.
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

    /// Fails when the contents of a buffer are invalid.
    pub fn check(&self, buffer: &BufferBinding) -> Result<(), ServerError> {
        match self.allocations.get(&buffer.memory.id()).and_then(|a| a.failure.clone()) {
            Some(failure) => Err(failure),
            None => Ok(()),
        }
    }

    /// Records whether the launch or copy that writes these buffers succeeded.
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
