use crate::Test;
pub const TESTS: [Test; 0] = [];
pub const LONG_TESTS: [Test; 0] = [];
