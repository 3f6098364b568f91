//! Times in the notation of the command line.

use std::time::Duration;

/// Maximum duration of a wait at a terminal, a day.
const MAX_DURATION: f64 = 86_400.0;

/// Reads `200ms`, `10s`, `5m` or `1h`; a bare number is in seconds.
pub fn parse(text: &str) -> Result<Duration, String> {
    let expected = || format!("expected a time such as `200ms`, `10s` or `5m`, not `{text}`");
    let text = text.trim();
    let end = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(end);
    let number: f64 = number.trim().parse().map_err(|_| expected())?;
    let factor = match unit {
        "us" => 1e-6,
        "ms" => 1e-3,
        "" | "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(expected()),
    };
    let seconds = number * factor;
    if !(0.0..=MAX_DURATION).contains(&seconds) {
        return Err("a time is from 0 to 24h".into());
    }
    Duration::try_from_secs_f64(seconds).map_err(|_| expected())
}

/// Nanoseconds as people read them.
pub fn show(nanoseconds: f64) -> String {
    match nanoseconds {
        n if n >= 1e9 => format!("{:.2} s", n / 1e9),
        n if n >= 1e6 => format!("{:.2} ms", n / 1e6),
        n if n >= 1e3 => format!("{:.1} us", n / 1e3),
        n => format!("{n:.0} ns"),
    }
}

/// Bytes as people read them.
pub fn bytes(bytes: f64) -> String {
    match bytes {
        n if n >= 1e9 => format!("{:.2} GB", n / 1e9),
        n if n >= 1e6 => format!("{:.2} MB", n / 1e6),
        n if n >= 1e3 => format!("{:.1} kB", n / 1e3),
        n => format!("{n:.0} B"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_has_a_unit_or_is_in_seconds() {
        for (text, milliseconds) in
            [("200ms", 200), ("10s", 10_000), ("0.5", 500), ("2m", 120_000), ("1h", 3_600_000)]
        {
            assert_eq!(parse(text), Ok(Duration::from_millis(milliseconds)), "{text}");
        }
    }

    #[test]
    fn invalid_time_is_refused_with_example() {
        for text in ["", "s", "-1s", "1 week", "1e9h", "nan", "inf"] {
            assert!(parse(text).is_err(), "{text}");
        }
        assert!(parse("1d").unwrap_err().contains("`200ms`"));
    }
}
