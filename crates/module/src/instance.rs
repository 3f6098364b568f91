use std::marker::PhantomData;

use slate_blackboard::interface::Interface;

use crate::panics::{catch_silently, discard};
use crate::{Description, Module, Outcome, Params, PortCursor, Ports, Refusal, Setup, Tick, decode, encode};

/// Running instance of a module, as the host drives it.
/// Authors write a [`Module`]; this is for modules whose ports are only known from their configuration, such as a
/// simulator.
pub trait Instance: Sized + Send + 'static {
    /// Configuration table that sets it up, such as `world`; empty for none.
    const SECTION: &'static str = "";

    /// Describes ports, parameters and trigger under that setup.
    ///
    /// # Errors
    /// A refusal in words.
    fn describe(setup: &Setup<'_>) -> Result<Description, Refusal>;

    /// Creates an instance before its first tick.
    /// `params` holds a value of the parameter interface.
    ///
    /// # Errors
    /// A refusal in words.
    fn create(setup: &Setup<'_>, params: &[u8]) -> Result<Self, Refusal>;

    /// Makes one step; `params` holds a value of the parameter interface.
    fn tick(&mut self, ports: &mut PortCursor, params: &[u8], now: &Tick) -> Outcome;

    /// Saves the state as CBOR with field names.
    ///
    /// # Errors
    /// A state that can't be encoded.
    fn save(&self) -> Result<Vec<u8>, Refusal>;

    /// Restores a saved state.
    ///
    /// # Errors
    /// A state that doesn't fit; the present one is unchanged then.
    fn restore(&mut self, state: &[u8]) -> Result<(), Refusal>;

    /// Returns `Ok` if it may be unloaded now; an error is a veto.
    ///
    /// # Errors
    /// The reason of the veto.
    fn may_unload(&self) -> Result<(), Refusal> {
        Ok(())
    }
}

/// Instance of a [`Module`].
pub(crate) struct ModuleInstance<M: Module> {
    state: M::State,
    module: PhantomData<fn() -> M>,
}

impl<M: Module> Instance for ModuleInstance<M> {
    fn describe(setup: &Setup<'_>) -> Result<Description, Refusal> {
        let spec = M::spec();
        let hardware = match setup.params {
            Some(params) => M::hardware(setup, &read_params::<M::Params>(params)?)?,
            None => Vec::new(),
        };
        Ok(Description {
            ports: M::Io::describe(),
            params: M::Params::DESCRIPTOR,
            parameters: M::Params::parameters(),
            stage: M::STAGE,
            trigger: spec.trigger,
            deadline: spec.deadline,
            unique: spec.unique.into(),
            describes_hardware: M::DESCRIBES_HARDWARE,
            hardware,
        })
    }

    fn create(setup: &Setup<'_>, params: &[u8]) -> Result<Self, Refusal> {
        let params = read_params::<M::Params>(params)?;
        Ok(Self { state: M::create(setup, &params)?, module: PhantomData })
    }

    #[inline]
    fn tick(&mut self, ports: &mut PortCursor, params: &[u8], now: &Tick) -> Outcome {
        // SAFETY: the host passes a whole, aligned value of the parameter interface.
        let params = unsafe { M::Params::from_raw(params.as_ptr(), 0) };
        ports.with(|io: &M::Io| M::tick(&mut self.state, io, params, now))
    }

    fn save(&self) -> Result<Vec<u8>, Refusal> {
        encode(&self.state)
    }

    fn restore(&mut self, state: &[u8]) -> Result<(), Refusal> {
        let state = decode(state).map_err(|error| Refusal(format!("its state does not fit: {error}")))?;
        let old = std::mem::replace(&mut self.state, state);
        // The new state is in place, so a panic of the old one's end is no refusal.
        let _ = catch_silently(|| drop(old)).map_err(discard);
        Ok(())
    }

    fn may_unload(&self) -> Result<(), Refusal> {
        M::may_unload(&self.state)
    }
}

/// Reads the parameters of an [`Instance`] from their bytes.
///
/// # Errors
/// When there are too few bytes.
pub fn read_params<P: Params>(bytes: &[u8]) -> Result<P, Refusal> {
    if bytes.len() < size_of::<P>() {
        return Err(format!("{} bytes of parameters, expected {}", bytes.len(), size_of::<P>()).into());
    }
    // SAFETY: the length was checked, every bit pattern of an interface is valid, and the read needs no alignment.
    Ok(unsafe { bytes.as_ptr().cast::<P>().read_unaligned() })
}
