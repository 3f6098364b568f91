//! Host's side of a table: kinds of modules, and their plugins.

use std::any::Any;
use std::fmt;
use std::sync::Arc;

use crate::table::{Bytes, DONE, SetupTable, Sink};
use crate::{Description, Instance, Module, ModuleTable, Refusal, Setup, encode, portable};

/// Kind of module, ready to be instantiated.
#[derive(Clone)]
pub struct ModuleKind {
    name: Arc<str>,
    doc: Arc<str>,
    section: Arc<str>,
    table: ModuleTable,
    /// Handle that keeps the library open while its code may be called.
    library: Option<Arc<dyn Any + Send + Sync>>,
    factory: Option<Arc<dyn InstanceFactory>>,
    needs_process: bool,
}

/// Maker of instances, in place of the calls of a table.
/// For instances in other processes, of which the calls of the table know nothing.
pub trait InstanceFactory: Send + Sync {
    /// Describes ports, parameters and trigger under a setup.
    /// In the format of [`ModuleKind::describe_portable`].
    ///
    /// # Errors
    /// The module's refusal.
    fn describe(&self, setup: &Setup<'_>) -> Result<Vec<u8>, Refusal>;

    /// Makes an instance for the other calls of the table.
    ///
    /// # Errors
    /// The module's refusal.
    fn create(&self, setup: &Setup<'_>, params: &[u8]) -> Result<*mut (), Refusal>;
}

impl fmt::Debug for ModuleKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ModuleKind").field("name", &self.name).finish_non_exhaustive()
    }
}

impl ModuleKind {
    /// Returns the kind of a module that is linked into the program.
    pub fn linked<M: Module>() -> Self {
        // SAFETY: the table of a module keeps the contract.
        unsafe { Self::from_table(ModuleTable::of::<M>(), None) }
    }

    /// Returns the kind of an instance type that is linked into the program.
    pub fn instance<I: Instance>(name: &'static str, doc: &'static str) -> Self {
        // SAFETY: as above.
        unsafe { Self::from_table(ModuleTable::of_instance::<I>(name, doc), None) }
    }

    /// Returns a kind by its calls; `library` is kept as long as they may be made.
    ///
    /// # Safety
    /// The calls keep the contract of [`ModuleTable`], and the table's texts live as long as `library`.
    pub unsafe fn from_table(table: ModuleTable, library: Option<Arc<dyn Any + Send + Sync>>) -> Self {
        // SAFETY: the texts live as the caller says; they are copied.
        let text = |bytes: Bytes| Arc::from(String::from_utf8_lossy(unsafe { bytes.as_slice() }));
        Self {
            name: text(table.name),
            doc: text(table.doc),
            section: text(table.section),
            table,
            library,
            factory: None,
            needs_process: false,
        }
    }

    /// Returns a kind whose instances `factory` makes.
    /// The other calls are those of the table; its texts don't count. `library` is kept.
    ///
    /// # Safety
    /// The calls keep the contract of [`ModuleTable`] with what `factory` makes.
    pub unsafe fn with_factory(
        factory: Arc<dyn InstanceFactory>,
        table: ModuleTable,
        (name, doc, section): (&str, &str, &str),
        library: Option<Arc<dyn Any + Send + Sync>>,
    ) -> Self {
        let (name, doc, section) = (name.into(), doc.into(), section.into());
        Self { name, doc, section, table, library, factory: Some(factory), needs_process: false }
    }

    /// Marks a kind whose instances run in processes of their own only.
    /// Its modules are isolated, whatever their configuration says.
    #[must_use]
    pub fn in_processes(mut self) -> Self {
        self.needs_process = true;
        self
    }

    /// Returns true if its instances run in processes of their own only.
    pub fn needs_process(&self) -> bool {
        self.needs_process
    }

    /// Returns the name by which configuration finds it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the description of the kind.
    pub fn doc(&self) -> &str {
        &self.doc
    }

    /// Returns the configuration table that sets it up; empty for none.
    pub fn section(&self) -> &str {
        &self.section
    }

    /// Returns the calls.
    pub fn table(&self) -> &ModuleTable {
        &self.table
    }

    /// Returns the handle that keeps its library open; `None` for linked code.
    pub fn library(&self) -> Option<&Arc<dyn Any + Send + Sync>> {
        self.library.as_ref()
    }

    /// Returns true if `other` is the same code, loaded at the same time.
    pub fn is(&self, other: &Self) -> bool {
        let library = |kind: &Self| kind.library.as_ref().map(|library| Arc::as_ptr(library).cast::<()>());
        let factory = |kind: &Self| kind.factory.as_ref().map(|factory| Arc::as_ptr(factory).cast::<()>());
        std::ptr::fn_addr_eq(self.table.tick, other.table.tick)
            && library(self) == library(other)
            && factory(self) == factory(other)
    }

    /// Ports, parameters and trigger under a setup.
    ///
    /// # Errors
    /// The module's refusal, or the error in its description.
    pub fn describe(&self, setup: &Setup<'_>) -> Result<Description, Refusal> {
        portable::decode_description(&self.describe_portable(setup)?)
    }

    /// Describes the kind in the portable format, for a library or a process.
    ///
    /// # Errors
    /// The module's refusal.
    pub fn describe_portable(&self, setup: &Setup<'_>) -> Result<Vec<u8>, Refusal> {
        if let Some(factory) = &self.factory {
            return factory.describe(setup);
        }
        let section = section_bytes(setup)?;
        let table = setup_table(setup, &section);
        // SAFETY: setup and sink live during the call.
        call(|sink| unsafe { (self.table.describe)(&raw const table, sink) })
    }

    /// Makes an instance; `params` holds a value of the parameter interface.
    ///
    /// # Errors
    /// The module's refusal.
    pub fn create(&self, setup: &Setup<'_>, params: &[u8]) -> Result<*mut (), Refusal> {
        if let Some(factory) = &self.factory {
            return factory.create(setup, params);
        }
        let section = section_bytes(setup)?;
        let table = setup_table(setup, &section);
        let params = Bytes { data: params.as_ptr(), length: params.len() };
        let mut instance = std::ptr::null_mut();
        // SAFETY: everything lives during the call.
        call(|sink| unsafe { (self.table.create)(&raw const table, params, &raw mut instance, sink) })?;
        if instance.is_null() { Err("it made no instance, and gave no reason".into()) } else { Ok(instance) }
    }

    /// Makes an instance, restores a state in it if there is one, and ends it.
    /// Returns the result of the restoration.
    ///
    /// # Errors
    /// The module's refusal to be made.
    pub fn try_out(
        &self,
        setup: &Setup<'_>,
        params: &[u8],
        state: Option<&[u8]>,
    ) -> Result<Result<(), Refusal>, Refusal> {
        let instance = self.create(setup, params)?;
        // SAFETY: just made, and nobody else has it.
        let restored = state.map_or(Ok(()), |state| unsafe { self.restore(instance, state) });
        // SAFETY: as above, and it is not used any more. An error at its end is not an error of its setup.
        let _ = unsafe { self.destroy(instance) };
        Ok(restored)
    }

    /// Saves the state of an instance.
    ///
    /// # Errors
    /// A state that can't be encoded.
    ///
    /// # Safety
    /// The instance is of this kind, lives, and has no other user during the call.
    pub unsafe fn save(&self, instance: *const ()) -> Result<Vec<u8>, Refusal> {
        // SAFETY: passed on to the caller.
        call(|sink| unsafe { (self.table.save)(instance, sink) })
    }

    /// Restores a saved state in an instance.
    ///
    /// # Errors
    /// A state that doesn't fit; the present one is unchanged then.
    ///
    /// # Safety
    /// As for [`save`](ModuleKind::save).
    pub unsafe fn restore(&self, instance: *mut (), state: &[u8]) -> Result<(), Refusal> {
        let state = Bytes { data: state.as_ptr(), length: state.len() };
        // SAFETY: passed on to the caller.
        call(|sink| unsafe { (self.table.restore)(instance, state, sink) }).map(drop)
    }

    /// Returns `Ok` if an instance may be unloaded now; an error is a veto.
    ///
    /// # Errors
    /// Its veto.
    ///
    /// # Safety
    /// As for [`save`](ModuleKind::save).
    pub unsafe fn may_unload(&self, instance: *const ()) -> Result<(), Refusal> {
        // SAFETY: passed on to the caller.
        call(|sink| unsafe { (self.table.may_unload)(instance, sink) }).map(drop)
    }

    /// Ends an instance.
    ///
    /// # Errors
    /// An error at its end, such as a panic; it has ended all the same.
    ///
    /// # Safety
    /// As for [`save`](ModuleKind::save), and it is not used any more.
    pub unsafe fn destroy(&self, instance: *mut ()) -> Result<(), Refusal> {
        // SAFETY: passed on to the caller.
        call(|sink| unsafe { (self.table.destroy)(instance, sink) }).map(drop)
    }
}

fn section_bytes(setup: &Setup<'_>) -> Result<Vec<u8>, Refusal> {
    setup.section.map_or(Ok(Vec::new()), encode)
}

fn setup_table(setup: &Setup<'_>, section: &[u8]) -> SetupTable {
    SetupTable {
        name: Bytes::of(setup.name),
        seed: setup.seed,
        period: setup.period,
        section: Bytes { data: section.as_ptr(), length: section.len() },
        params: setup
            .params
            .map_or(Bytes::NONE, |params| Bytes { data: params.as_ptr(), length: params.len() }),
    }
}

/// Calls a function that writes a robot's configuration; returns the text.
///
/// # Errors
/// The error in the robot's configuration.
pub fn read_robot(robot: impl FnOnce(*const Sink) -> i32) -> Result<String, Refusal> {
    call(robot).map(|text| String::from_utf8_lossy(&text).into_owned())
}

/// Makes a call with a sink; returns the written bytes, or the refusal.
fn call(call: impl FnOnce(*const Sink) -> i32) -> Result<Vec<u8>, Refusal> {
    let mut written = Vec::new();
    let sink = Sink::into(&mut written);
    match call(&raw const sink) {
        DONE => Ok(written),
        _ => Err(Refusal(String::from_utf8_lossy(&written).into_owned())),
    }
}

impl Sink {
    /// Returns a sink that appends to a vector, which must stay untouched meanwhile.
    pub(crate) fn into(written: &mut Vec<u8>) -> Self {
        Self { context: std::ptr::from_mut(written).cast(), write: append }
    }
}

unsafe extern "C" fn append(context: *mut (), data: *const u8, length: usize) {
    // SAFETY: the context is the vector of `call`, which waits; the module passes bytes that live during the call.
    unsafe { (*context.cast::<Vec<u8>>()).extend_from_slice(Bytes { data, length }.as_slice()) }
}

/// Plugin with modules: linked into the program, or a shared library.
#[derive(Clone, Debug)]
pub struct Plugin {
    name: Arc<str>,
    version: Arc<str>,
    kinds: Vec<ModuleKind>,
    depends: Vec<String>,
}

/// Conversion of a kind of module to a plugin of its name.
impl From<ModuleKind> for Plugin {
    fn from(kind: ModuleKind) -> Self {
        Self::new(&kind.name.clone(), [kind])
    }
}

impl Plugin {
    /// Returns a plugin of that name with those kinds of modules.
    pub fn new(name: &str, kinds: impl IntoIterator<Item = ModuleKind>) -> Self {
        Self {
            name: name.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            kinds: kinds.into_iter().collect(),
            depends: Vec::new(),
        }
    }

    /// Returns a plugin with one module that is linked into the program.
    /// It has the module's name.
    pub fn linked<M: Module>() -> Self {
        ModuleKind::linked::<M>().into()
    }

    /// Sets the version.
    #[must_use]
    pub fn version(mut self, version: &str) -> Self {
        self.version = version.into();
        self
    }

    /// Sets plugins to be loaded before it, and unloaded after it.
    #[must_use]
    pub fn depends(mut self, plugins: &[&str]) -> Self {
        self.depends = plugins.iter().map(|name| (*name).into()).collect();
        self
    }

    /// Returns the name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the version.
    pub fn version_text(&self) -> &str {
        &self.version
    }

    /// Returns the kinds of modules.
    pub fn kinds(&self) -> &[ModuleKind] {
        &self.kinds
    }

    /// Returns the plugins that must be loaded before it.
    pub fn dependencies(&self) -> &[String] {
        &self.depends
    }
}
