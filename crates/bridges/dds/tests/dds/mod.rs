//! An agent with topics of DDS.

#[cfg(feature = "external-tools")]
mod agent;
#[cfg(feature = "external-tools")]
mod cyclone;
mod idl;
mod interfaces;
mod message;
mod settings;
