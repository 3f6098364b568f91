/// Memory that is aligned for values of any interface.
#[derive(Debug)]
pub struct AlignedMemory(Box<[u128]>);

impl AlignedMemory {
    /// All zeros.
    pub fn zeroed(bytes: usize) -> Self {
        Self(vec![0; bytes.div_ceil(16).max(1)].into_boxed_slice())
    }

    /// Where it is.
    #[inline]
    pub fn as_ptr(&self) -> *const u8 {
        self.0.as_ptr().cast()
    }

    /// Where it is, to be written.
    #[inline]
    pub fn as_mut_ptr(&mut self) -> *mut u8 {
        self.0.as_mut_ptr().cast()
    }

    /// As [`bytes_mut`](AlignedMemory::bytes_mut), to be read.
    #[inline]
    pub fn bytes(&self, count: usize) -> &[u8] {
        let count = count.min(size_of_val(&*self.0));
        // SAFETY: the memory is initialised and has so many bytes.
        unsafe { std::slice::from_raw_parts(self.as_ptr(), count) }
    }

    /// The first `count` bytes; as many as there are, if there are fewer.
    #[inline]
    pub fn bytes_mut(&mut self, count: usize) -> &mut [u8] {
        let count = count.min(size_of_val(&*self.0));
        // SAFETY: the memory is initialised and has so many bytes.
        unsafe { std::slice::from_raw_parts_mut(self.as_mut_ptr(), count) }
    }
}
