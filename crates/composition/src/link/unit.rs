//! Units that differ by an exact factor.

use slate_sorted::SortedMap;

/// Unit symbols that take a prefix.
const BASES: [&str; 11] = ["m", "s", "g", "A", "V", "W", "N", "J", "K", "Pa", "Hz"];

/// Prefixes as powers of ten, counted from the smallest.
const PREFIXES: [(&str, u32); 9] =
    [("k", 15), ("M", 18), ("G", 21), ("d", 11), ("c", 10), ("m", 9), ("u", 6), ("n", 3), ("p", 0)];

/// The power of ten of a symbol without a prefix.
const ONE: u32 = 12;

/// Units of time that are no powers of ten, in seconds.
const TIMES: [(&str, u128); 2] = [("min", 60), ("h", 3600)];

/// Unit: powers of its base symbols, and its size in the smallest units.
/// The size is the fraction `above / below`.
#[derive(Debug, PartialEq, Eq)]
struct Measure {
    powers: SortedMap<&'static str, i64>,
    above: u128,
    below: u128,
}

/// The factor between two units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Factor {
    /// A whole number.
    Whole(u64),
    /// Units of the same dimension whose factor is not a whole number.
    Fraction,
    /// Units of different dimensions, or unknown ones.
    None,
}

/// Returns the conversion factor from one unit to another.
pub(super) fn factor(from: &str, to: &str) -> Factor {
    if from == to {
        return Factor::Whole(1);
    }
    let (Some(from), Some(to)) = (measure(from), measure(to)) else { return Factor::None };
    if from.powers != to.powers {
        return Factor::None;
    }
    let terms = from.above.checked_mul(to.below).zip(from.below.checked_mul(to.above));
    match terms.map(|(above, below)| (u64::try_from(above / below), above.is_multiple_of(below))) {
        Some((Ok(factor), true)) => Factor::Whole(factor),
        _ => Factor::Fraction,
    }
}

/// Reads `m`, `mm/s`, `1/s`, `m/s^2` and `m/s2`.
fn measure(text: &str) -> Option<Measure> {
    let mut measure = Measure { powers: SortedMap::new(), above: 1, below: 1 };
    for (i, term) in text.split('/').enumerate() {
        if i == 0 && term == "1" {
            continue;
        }
        let letters = term.trim_end_matches(|c: char| c.is_ascii_digit());
        let power: u32 = if letters == term { 1 } else { term[letters.len()..].parse().ok()? };
        let (base, scale) = symbol(letters.trim_end_matches('^'))?;
        let scale = scale.checked_pow(power)?;
        let (side, sign) = if i == 0 { (&mut measure.above, 1) } else { (&mut measure.below, -1) };
        *side = side.checked_mul(scale)?;
        *measure.powers.entry(base).or_default() += sign * i64::from(power);
    }
    Some(measure)
}

/// Returns the base of a symbol, and its size in the smallest units.
fn symbol(text: &str) -> Option<(&'static str, u128)> {
    if let Some((_, seconds)) = TIMES.iter().find(|(symbol, _)| *symbol == text) {
        return Some(("s", seconds * 10_u128.pow(ONE)));
    }
    if let Some(base) = BASES.iter().find(|base| **base == text) {
        return Some((base, 10_u128.pow(ONE)));
    }
    let (prefix, power) = PREFIXES.iter().find(|(prefix, _)| text.starts_with(prefix))?;
    let base = BASES.iter().find(|base| **base == &text[prefix.len()..])?;
    Some((base, 10_u128.pow(*power)))
}

#[cfg(test)]
mod tests {
    use super::Factor::{Fraction, None, Whole};
    use super::factor;

    #[test]
    fn factors() {
        let cases = [
            ("m", "m", Whole(1)),
            ("", "", Whole(1)),
            ("m", "mm", Whole(1000)),
            ("km", "cm", Whole(100_000)),
            ("s", "ns", Whole(1_000_000_000)),
            ("ms", "us", Whole(1000)),
            ("min", "s", Whole(60)),
            ("h", "min", Whole(60)),
            ("m/s", "mm/s", Whole(1000)),
            ("m/s^2", "mm/s2", Whole(1000)),
            ("m/ms", "m/s", Whole(1000)),
            ("1/ms", "1/s", Whole(1000)),
            ("m2", "mm^2", Whole(1_000_000)),
            ("mm", "m", Fraction),
            ("s", "min", Fraction),
            ("m", "s", None),
            ("m", "", None),
            ("m", "m/s", None),
            ("deg", "rad", None),
            ("apple", "m", None),
        ];
        for (from, to, expected) in cases {
            assert_eq!(factor(from, to), expected, "{from} to {to}");
        }
    }
}
