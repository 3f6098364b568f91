//! Embedded simulator: worlds, robots and sensors; a time source.
