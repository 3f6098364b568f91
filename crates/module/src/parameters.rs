use slate_blackboard::interface::{Interface, Value};

/// A value that configuration gives a module and users may change while it runs.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// The field of the parameter interface.
    pub name: String,
    /// Its value unless configuration says otherwise.
    pub default: Value,
    /// The least and the greatest value allowed.
    pub range: Option<(f64, f64)>,
    /// Settings of the configuration whose value it takes unless it has one itself: the first that is there, such as
    /// `world.robots.{robot}.profile`, where `{robot}` is the module's robot.
    pub follows: Vec<String>,
}

/// The parameters of a module, made by the `#[params]` macro.
pub trait Params: Interface + Copy + Default {
    /// Defaults and ranges.
    fn parameters() -> Vec<Parameter>;
}

/// No parameters.
impl Params for () {
    fn parameters() -> Vec<Parameter> {
        Vec::new()
    }
}
