use slate_module::{Frame, ModuleKind, Refusal};

use super::{CallTimeout, OwnSetup, Retired};

/// The code of a step.
pub type StepCode = unsafe extern "C" fn(*mut (), *const Frame) -> i32;

/// The code of a module and its instance.
#[repr(C)]
pub struct ModuleCode {
    /// The step of the kind.
    tick: StepCode,
    /// The state, in memory of its own; null while there is none.
    instance: *mut (),
    origin: Box<InstanceOrigin>,
}

/// What the instance is made with, also anew after a panic.
struct InstanceOrigin {
    kind: ModuleKind,
    setup: OwnSetup,
    /// How long its end is waited for.
    timeout: CallTimeout,
}

impl ModuleCode {
    /// The code of that kind, without an instance.
    pub fn new(kind: ModuleKind, setup: OwnSetup, timeout: CallTimeout) -> Self {
        let tick = kind.table().tick;
        let origin = Box::new(InstanceOrigin { kind, setup, timeout });
        Self { tick, instance: std::ptr::null_mut(), origin }
    }

    /// The code.
    pub fn kind(&self) -> &ModuleKind {
        &self.origin.kind
    }

    /// The instance; null while there is none.
    #[inline]
    pub fn instance(&self) -> *mut () {
        self.instance
    }

    /// Code and instance, for a call in another thread.
    pub fn parts(&self) -> (ModuleKind, *mut ()) {
        (self.origin.kind.clone(), self.instance)
    }

    /// Whether there is an instance.
    pub fn has_instance(&self) -> bool {
        !self.instance.is_null()
    }

    /// Goes on with that instance, where there is none.
    pub fn set_instance(&mut self, instance: *mut ()) {
        self.instance = instance;
    }

    /// The call of a step on that frame.
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

    /// As [`create`](ModuleCode::create), in a thread that is not waited for without end.
    ///
    /// # Errors
    /// The module's refusal, or that the call does not return.
    pub fn create_patiently(&self, params: &[u8]) -> Result<*mut (), Refusal> {
        let InstanceOrigin { kind, setup, timeout } = &*self.origin;
        timeout.create(kind, setup, params)
    }

    /// Goes on with other code and its instance; returns what was before.
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

    /// Gives the instance the state that another one has saved. There is none afterwards if the call does not return.
    ///
    /// # Errors
    /// What doesn't fit, or that the call does not return.
    pub fn restore(&mut self, state: &[u8]) -> Result<(), String> {
        let (retired, fits) = self.retire().restored(state.to_vec());
        self.instance = retired.into_parts().1;
        fits
    }
}

/// A step that is ready to be made.
#[derive(Clone, Copy)]
pub struct StepCall {
    tick: StepCode,
    instance: *mut (),
    frame: *const Frame,
}

// SAFETY: instances are `Send`, and the frame is used by whoever makes the call alone.
unsafe impl Send for StepCall {}

impl StepCall {
    /// Makes the step; returns the outcome, or -1 after a panic.
    ///
    /// # Safety
    /// The runner was prepared and lives, and nobody else touches its instance and frame during the call.
    pub unsafe fn make(self) -> i32 {
        // SAFETY: passed on to the caller.
        unsafe { (self.tick)(self.instance, self.frame) }
    }
}
