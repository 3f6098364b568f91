//! Numbers as arguments.

/// Parses a whole number of a range.
pub fn whole<T: TryFrom<u64>>(
    least: u64,
    most: u64,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.parse::<u64>().ok().filter(|number| (least..=most).contains(number));
        number.and_then(|number| T::try_from(number).ok()).ok_or_else(|| match most {
            u64::MAX => format!("expected a whole number of at least {least}, found `{text}`"),
            _ => format!("expected a whole number from {least} to {most}, found `{text}`"),
        })
    }
}

/// Parses a rate in hertz.
pub fn hertz(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(rate) if rate.is_finite() && rate >= 0.0 => Ok(rate),
        _ => Err(format!("expected a rate in Hz, such as 20 or 0.5, found `{text}`")),
    }
}
