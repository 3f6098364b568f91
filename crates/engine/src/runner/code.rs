use slate_module::{Frame, ModuleKind, Refusal};

use super::{CallTimeout, OwnSetup, Retired};

/// Code of a step.
pub type StepCode = unsafe extern "C" fn(*mut (), *const Frame) -> i32;

/// Code of a module and its instance.
#[repr(C)]
pub struct ModuleCode {
    /// Step of the kind.
    tick: StepCode,
    /// Instance with the state, in memory of its own; null if none exists.
    instance: *mut (),
    origin: Box<InstanceOrigin>,
}

/// Kind, setup and parameters for making the instance, also anew after a panic.
struct InstanceOrigin {
    kind: ModuleKind,
    setup: OwnSetup,
    /// Timeout of the instance's end.
    timeout: CallTimeout,
}

impl ModuleCode {
    /// Returns the code of that kind, without an instance.
    pub fn new(kind: ModuleKind, setup: OwnSetup, timeout: CallTimeout) -> Self {
        let tick = kind.table().tick;
        let origin = Box::new(InstanceOrigin { kind, setup, timeout });
        Self { tick, instance: std::ptr::null_mut(), origin }
    }

    /// Returns the kind.
    pub fn kind(&self) -> &ModuleKind {
        &self.origin.kind
    }

    /// Returns the instance; null if none exists.
    #[inline]
    pub fn instance(&self) -> *mut () {
        self.instance
    }

    /// Returns code and instance, for a call in another thread.
    pub fn parts(&self) -> (ModuleKind, *mut ()) {
        (self.origin.kind.clone(), self.instance)
    }

    /// Returns true if an instance exists.
    pub fn has_instance(&self) -> bool {
        !self.instance.is_null()
    }

    /// Sets the instance, if none exists.
    pub fn set_instance(&mut self, instance: *mut ()) {
        self.instance = instance;
    }

    /// Returns the call of a step on that frame.
    #[inline]
    pub fn call(&self, frame: *const Frame) -> StepCall {
        StepCall { tick: self.tick, instance: self.instance, frame }
    }

    /// Makes an instance with those parameters.
    ///
    /// # Errors
    /// The module's refusal.
    pub fn create(&self, params: &[u8]) -> Result<*mut (), Refusal> {
        self.origin.setup.with(|setup| self.origin.kind.create(setup, params))
    }

    /// Acts as [`create`](ModuleCode::create), in a thread with a timeout.
    ///
    /// # Errors
    /// The module's refusal, or that the call does not return.
    pub fn create_with_timeout(&self, params: &[u8]) -> Result<*mut (), Refusal> {
        let InstanceOrigin { kind, setup, timeout } = &*self.origin;
        timeout.create(kind, setup, params)
    }

    /// Exchanges code and instance; returns the old ones.
    pub fn exchange(&mut self, kind: ModuleKind, instance: *mut ()) -> Retired {
        self.tick = kind.table().tick;
        let kind = std::mem::replace(&mut self.origin.kind, kind);
        let instance = std::mem::replace(&mut self.instance, instance);
        Retired::new(kind, instance, self.origin.timeout.clone())
    }

    /// Takes the instance out.
    pub fn retire(&mut self) -> Retired {
        let instance = std::mem::replace(&mut self.instance, std::ptr::null_mut());
        Retired::new(self.origin.kind.clone(), instance, self.origin.timeout.clone())
    }

    /// Restores the saved state of another instance.
    /// If the call does not return, no instance is left.
    ///
    /// # Errors
    /// A state that doesn't fit, or that the call does not return.
    pub fn restore(&mut self, state: &[u8]) -> Result<(), String> {
        let (retired, fits) = self.retire().restored(state.to_vec());
        self.instance = retired.into_parts().1;
        fits
    }
}

/// Prepared call of a step.
#[derive(Clone, Copy)]
pub struct StepCall {
    tick: StepCode,
    instance: *mut (),
    frame: *const Frame,
}

// SAFETY: instances are `Send`, and the frame is used by the caller alone.
unsafe impl Send for StepCall {}

impl StepCall {
    /// Makes the step; returns the outcome, or -1 after a panic.
    ///
    /// # Safety
    /// The runner was prepared and lives, and its instance and frame have no other user during the call.
    #[inline]
    pub unsafe fn make(self) -> i32 {
        // SAFETY: passed on to the caller.
        unsafe { (self.tick)(self.instance, self.frame) }
    }
}
