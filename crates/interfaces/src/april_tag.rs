//! Codes of AprilTags.

/// Codes of the AprilTag family 16h5, by number; they differ in at least 5 bits.
///
/// Olson, 2011, *AprilTag: A robust and flexible visual fiducial system*. A white cell is a set bit, row by row from
/// the highest bit at the top left; the 4 x 4 cells stand in a black frame of one cell.
pub const TAG16H5: [u16; 30] = [
    0x231b, 0x2ea5, 0x346a, 0x45b9, 0x79a6, 0x7f6b, 0xb358, 0xe745, 0xfe59, 0x156d, 0x380b, 0xf0ab, 0x0d84,
    0x4736, 0x8c72, 0xaf10, 0x093c, 0x93b4, 0xa503, 0x468f, 0xe137, 0x5795, 0xdf42, 0x1c1d, 0xe9dc, 0x73ad,
    0xad5f, 0xd530, 0x07ca, 0xaf2e,
];
