//! What the robots of a team share.
//!
//! [`knowledge`] is the protocol by which facts reach every robot that is reachable through any chain of robots that know
//! each other. It is a state machine without sockets, clocks and threads: the host hands it messages and sends what it
//! has to say, over whatever carries bytes.

pub mod knowledge;
