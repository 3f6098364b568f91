use std::path::Path;

use crate::merge::{MergeCheck, MergeInput, Part, join};
use crate::open;
use slate_bag::whole;
use slate_bag::{Error, Selection};

/// Copies the selected messages of a file, in its order; returns their number.
/// All attachments and metadata are copied. A part of a run is no longer marked as a whole run, and the metadata that
/// counts its values is counted anew.
///
/// # Errors
/// When the file is damaged or can't be read, `out` can't be written, a topic is not there, or nothing is in the time that is asked
/// for.
pub fn copy(path: &Path, out: &Path, selection: &Selection) -> Result<u64, Error> {
    let input = MergeInput::new(open(path)?, "");
    whole::write(out, |file| match join(vec![input], file, out, selection, None)? {
        0 if selection.is_span() => {
            let what =
                "no selected message is in that time span; `slate bag info` shows the times of the file";
            Err(Error::Unfit { path: path.into(), what: what.into() })
        }
        messages => Ok(messages),
    })
}

/// Merges several files into one, in the order of the log times.
/// Channels of the same topic, type and encoding become one. Messages that several recordings of one run share are
/// written once; messages of different runs that would mix in one topic are refused, unless `is_mixed` allows that.
/// Returns the number of messages.
///
/// # Errors
/// As [`copy`], and when messages of different runs would be mixed.
pub fn merge(parts: &[Part<'_>], out: &Path, is_mixed: bool) -> Result<u64, Error> {
    let input = |part: &Part<'_>| Ok(MergeInput::new(open(part.file)?, part.prefix));
    let mut inputs = parts.iter().map(input).collect::<Result<Vec<_>, Error>>()?;
    let runs = inputs.iter_mut().map(MergeInput::run).collect::<Result<Vec<_>, _>>()?;
    let merge_check = MergeCheck::new(&runs);
    whole::write(out, |file| join(inputs, file, out, &Selection::default(), Some((merge_check, is_mixed))))
}
