use slate_blackboard::interface::Value;

/// What a module is told when it is set up.
#[derive(Clone, Copy, Debug)]
pub struct Setup<'a> {
    /// The module's name in the agent, such as `r2/planner`.
    pub name: &'a str,
    /// The run's seed.
    pub seed: u64,
    /// The period of the main loop, nanoseconds.
    pub period: u64,
    /// The configuration table named by [`Instance::SECTION`](crate::Instance::SECTION), if the module asks for one and it is there.
    pub section: Option<&'a Value>,
    /// A value of the parameter interface, when a module that [describes hardware](crate::Module::DESCRIBES_HARDWARE) is described
    /// with its parameters.
    pub params: Option<&'a [u8]>,
}
