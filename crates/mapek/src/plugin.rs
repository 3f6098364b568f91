//! The blocks as plugins, for lists of what is linked into a program.

use slate_module::Plugin;

use crate::{
    Actuator, ActuatorBlock, Analyze, AnalyzeBlock, ExecuteBlock, Knowledge, KnowledgeBlock, Monitor,
    MonitorBlock, Plan, PlanBlock, ReactiveBlock, ReactiveModel, Repertoire, Sensor, SensorBlock,
};

/// The plugin of a [`Sensor`].
pub fn sensor<S: Sensor>() -> Plugin {
    Plugin::linked::<SensorBlock<S>>()
}

/// The plugin of an [`Actuator`].
pub fn actuator<A: Actuator>() -> Plugin {
    Plugin::linked::<ActuatorBlock<A>>()
}

/// The plugin of a [`Monitor`].
pub fn monitor<M: Monitor>() -> Plugin {
    Plugin::linked::<MonitorBlock<M>>()
}

/// The plugin of an [`Analyze`].
pub fn analyze<A: Analyze>() -> Plugin {
    Plugin::linked::<AnalyzeBlock<A>>()
}

/// The plugin of a [`Plan`].
pub fn plan<P: Plan>() -> Plugin {
    Plugin::linked::<PlanBlock<P>>()
}

/// The plugin of the Execute for a [`Repertoire`].
pub fn execute<R: Repertoire>() -> Plugin {
    Plugin::linked::<ExecuteBlock<R>>()
}

/// The plugin of a [`ReactiveModel`].
pub fn reactive<R: ReactiveModel>() -> Plugin {
    Plugin::linked::<ReactiveBlock<R>>()
}

/// The plugin of a [`Knowledge`].
pub fn knowledge<K: Knowledge>() -> Plugin {
    Plugin::linked::<KnowledgeBlock<K>>()
}
