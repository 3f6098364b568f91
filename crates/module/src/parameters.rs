use slate_blackboard::interface::{Interface, Value};

/// Parameter of a module: set by configuration, and by users at run time.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// Field of the parameter interface.
    pub name: String,
    /// Default value.
    pub default: Value,
    /// Least and greatest allowed value.
    pub range: Option<(f64, f64)>,
    /// Settings whose value the parameter takes unless it has one itself.
    /// The first that exists counts, such as `world.robots.{robot}.profile`, where `{robot}` is the module's robot.
    pub follows: Vec<String>,
}

/// Parameters of a module, made by the `#[params]` macro.
pub trait Params: Interface + Copy + Default {
    /// Defaults and ranges.
    fn parameters() -> Vec<Parameter>;
}

/// Parameters of a module without any.
impl Params for () {
    fn parameters() -> Vec<Parameter> {
        Vec::new()
    }
}
