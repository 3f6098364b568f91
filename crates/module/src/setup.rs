use slate_blackboard::interface::Value;

/// Setup of a module: its name, seed, period and configuration.
#[derive(Clone, Copy, Debug)]
pub struct Setup<'a> {
    /// Name of the module in the agent, such as `r2/planner`.
    pub name: &'a str,
    /// Seed of the run.
    pub seed: u64,
    /// Period of the main loop, ns.
    pub period: u64,
    /// Configuration table named by [`Instance::SECTION`](crate::Instance::SECTION).
    /// `None` if the module requests none or it is missing.
    pub section: Option<&'a Value>,
    /// Value of the parameter interface, for a description with parameters.
    /// Only for a module that [describes hardware](crate::Module::DESCRIBES_HARDWARE).
    pub params: Option<&'a [u8]>,
}
