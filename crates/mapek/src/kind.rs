//! The blocks as kinds of modules, for plugins.

use slate_module::ModuleKind;

use crate::{
    Actuator, ActuatorBlock, Analyze, AnalyzeBlock, ExecuteBlock, Knowledge, KnowledgeBlock, Monitor,
    MonitorBlock, Plan, PlanBlock, ReactiveBlock, ReactiveModel, Repertoire, Sensor, SensorBlock,
};

/// Returns the kind of module of a [`Sensor`].
pub fn sensor<S: Sensor>() -> ModuleKind {
    ModuleKind::linked::<SensorBlock<S>>()
}

/// Returns the kind of module of an [`Actuator`].
pub fn actuator<A: Actuator>() -> ModuleKind {
    ModuleKind::linked::<ActuatorBlock<A>>()
}

/// Returns the kind of module of a [`Monitor`].
pub fn monitor<M: Monitor>() -> ModuleKind {
    ModuleKind::linked::<MonitorBlock<M>>()
}

/// Returns the kind of module of an [`Analyze`].
pub fn analyze<A: Analyze>() -> ModuleKind {
    ModuleKind::linked::<AnalyzeBlock<A>>()
}

/// Returns the kind of module of a [`Plan`].
pub fn plan<P: Plan>() -> ModuleKind {
    ModuleKind::linked::<PlanBlock<P>>()
}

/// Returns the kind of module of the Execute for a [`Repertoire`].
pub fn execute<R: Repertoire>() -> ModuleKind {
    ModuleKind::linked::<ExecuteBlock<R>>()
}

/// Returns the kind of module of a [`ReactiveModel`].
pub fn reactive<R: ReactiveModel>() -> ModuleKind {
    ModuleKind::linked::<ReactiveBlock<R>>()
}

/// Returns the kind of module of a [`Knowledge`].
pub fn knowledge<K: Knowledge>() -> ModuleKind {
    ModuleKind::linked::<KnowledgeBlock<K>>()
}
