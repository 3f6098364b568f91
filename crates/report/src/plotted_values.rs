use std::path::Path;

use slate_bag::{Decoder, Selection, Unread, Value, whole};
use slate_logs::open;

use crate::Error;
use crate::plot::{Curve, curves};

/// Draws numbers over time as an SVG image.
/// Fields are named such as `/r2/pose/theta`, also without the leading slash: a topic and then the path to the number,
/// with the index of an element as in `/r2/scan/ranges/3`. Returns the number of points of each, and the messages that
/// can't be read.
///
/// # Errors
/// When the file is damaged, there is no such number, or `out` can't be written.
pub fn plot_values(
    path: &Path,
    fields: &[String],
    selection: &Selection,
    out: &Path,
) -> Result<(Vec<usize>, Vec<Unread>), Error> {
    let bare = |path: &str| path.trim_start_matches('/').to_owned();
    let mut reader = open(path)?;
    let mut decoder = Decoder::default();
    let mut drawn: Vec<Curve> =
        fields.iter().map(|field| Curve { name: field.clone(), points: Vec::new() }).collect();
    // The numbers that the named topics have instead.
    let mut others: Vec<Option<String>> = vec![None; fields.len()];
    let mut start = reader.start();
    selection.visit(&mut reader, |message| {
        let start = *start.get_or_insert(message.log_time);
        let mut value: Option<Value> = None;
        for (i, field) in fields.iter().enumerate() {
            let field = bare(field);
            let field_path = field
                .strip_prefix(&bare(&message.channel.topic))
                .and_then(|field_path| field_path.strip_prefix('/'));
            let Some(field_path) = field_path else { continue };
            let value = value.get_or_insert_with(|| decoder.decode(message));
            match value.number(field_path) {
                Some(number) => {
                    let seconds = message.log_time.saturating_sub(start) as f64 * 1e-9;
                    drawn[i].points.push((seconds, number));
                }
                None if others[i].is_none() => others[i] = Some(numbers(&message.channel.topic, value)),
                None => {}
            }
        }
        Ok(true)
    })?;
    if let Some((curve, others)) = drawn.iter().zip(&others).find(|(curve, _)| curve.points.is_empty()) {
        let is_of = |topic: &str| {
            let name = bare(&curve.name);
            name.strip_prefix(&bare(topic))
                .is_some_and(|field_path| field_path.starts_with('/') && field_path.len() > 1)
        };
        let what = match others {
            None if selection.is_span() && reader.channels().any(|channel| is_of(&channel.topic)) => {
                format!(
                    "`{}` has no value in that time span; `slate bag info` shows the times of the file",
                    curve.name
                )
            }
            None => format!(
                "it has no number `{}`; name a topic, as `slate bag info` lists them, and then a field",
                curve.name
            ),
            Some(others) => format!("it has no number `{}`; {others}", curve.name),
        };
        return Err(slate_bag::Error::Unfit { path: path.into(), what }.into());
    }
    let title = path.file_name().unwrap_or_default().to_string_lossy();
    let image = curves(&title, &drawn)?;
    whole::write(out, |file| {
        std::io::Write::write_all(file, image.as_bytes())
            .map_err(|source| slate_bag::Error::Write { path: out.into(), source })
    })?;
    Ok((drawn.iter().map(|curve| curve.points.len()).collect(), decoder.into_unread()))
}

/// Lists the numbers of a message; of a list only its first one.
fn numbers(topic: &str, value: &Value) -> String {
    if let Value::Unread { why, .. } = value {
        return format!("a message of `{topic}` can't be read: {why}");
    }
    let number = |(name, _): (String, String)| {
        let first = format!("{name}/0");
        let found = [name, first].into_iter().find(|field_path| value.number(field_path).is_some())?;
        Some(format!("{topic}/{found}"))
    };
    let names: Vec<_> = value.fields(false).into_iter().filter_map(number).collect();
    match names.is_empty() {
        true => format!("`{topic}` has none at all"),
        false => format!("available: {}", names.join(", ")),
    }
}
