//! Costs as percentages, as Nav2 publishes its costmaps.

use slate_planning::{INSCRIBED, LETHAL, UNKNOWN};

/// Percentage of an impassable cell near to an obstacle.
const INSCRIBED_PERCENT: i8 = 99;

/// Converts a cost to a percentage; unknown is -1.
pub fn to_percent(cost: u8) -> i8 {
    match cost {
        0 => 0,
        UNKNOWN => -1,
        LETHAL => 100,
        INSCRIBED => INSCRIBED_PERCENT,
        // 1 to 252 become 1 to 98.
        _ => (1 + (97 * (u32::from(cost) - 1)) / 251) as i8,
    }
}

/// Converts a percentage to a cost.
pub fn from_percent(percent: i8) -> u8 {
    match percent {
        0 => 0,
        ..0 => UNKNOWN,
        INSCRIBED_PERCENT => INSCRIBED,
        1..INSCRIBED_PERCENT => (1 + (251 * (percent as u32 - 1)) / 97) as u8,
        _ => LETHAL,
    }
}
