//! An agent with programs of CycloneDDS and Fast DDS.

mod fast;
mod hostile;
mod mismatch;
mod peer;
mod replay;
mod topics;
