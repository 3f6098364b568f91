/// Memory that is aligned for values of any interface.
#[derive(Debug)]
pub struct AlignedMemory(Box<[u128]>);

impl AlignedMemory {
    /// Returns memory of all zeros.
    pub fn zeroed(bytes: usize) -> Self {
        Self(vec![0; bytes.div_ceil(16).max(1)].into_boxed_slice())
    }

    /// Returns the address.
    #[inline]
    pub fn as_ptr(&self) -> *const u8 {
        self.0.as_ptr().cast()
    }

    /// Returns the address, for writing.
    #[inline]
    pub fn as_mut_ptr(&mut self) -> *mut u8 {
        self.0.as_mut_ptr().cast()
    }

    /// Returns the bytes as [`bytes_mut`](AlignedMemory::bytes_mut), for reading.
    #[inline]
    pub fn bytes(&self, count: usize) -> &[u8] {
        let count = count.min(size_of_val(&*self.0));
        // SAFETY: the memory is initialized and has so many bytes.
        unsafe { std::slice::from_raw_parts(self.as_ptr(), count) }
    }

    /// Returns the first `count` bytes, or all if there are fewer.
    #[inline]
    pub fn bytes_mut(&mut self, count: usize) -> &mut [u8] {
        let count = count.min(size_of_val(&*self.0));
        // SAFETY: the memory is initialized and has so many bytes.
        unsafe { std::slice::from_raw_parts_mut(self.as_mut_ptr(), count) }
    }
}
