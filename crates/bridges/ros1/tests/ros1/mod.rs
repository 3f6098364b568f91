#[cfg(feature = "external-tools")]
mod agent;
#[cfg(feature = "external-tools")]
mod peer;
#[cfg(feature = "external-tools")]
mod replay;
mod settings;
#[cfg(feature = "external-tools")]
mod topics;
