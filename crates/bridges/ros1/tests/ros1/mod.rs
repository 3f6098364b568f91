#[cfg(feature = "external-tools")]
mod agent;
mod checksum;
#[cfg(feature = "external-tools")]
mod frames;
#[cfg(feature = "external-tools")]
mod hostile;
#[cfg(feature = "external-tools")]
mod parameters;
#[cfg(feature = "external-tools")]
mod peer;
#[cfg(feature = "external-tools")]
mod replay;
#[cfg(feature = "external-tools")]
mod services;
mod settings;
#[cfg(feature = "external-tools")]
mod tools;
#[cfg(feature = "external-tools")]
mod topics;
