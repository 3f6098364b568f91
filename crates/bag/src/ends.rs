//! Header and summary of a damaged file, as far as they are intact.

use std::io::{Read, Seek};

use super::Error;
use super::record::{DataEnd, FRAME_SIZE, Footer, Header, MAGIC, Record};
use super::source::RecordSource;
use super::summary::Summary;

/// Returns the summary, if its own checksum is right.
pub(super) fn intact_summary<R: Read + Seek>(source: &mut RecordSource<R>) -> Option<Summary> {
    let start = data_end(source)?;
    source.seek(start).ok()?;
    let mut body = Vec::new();
    Summary::read(source, &mut body).ok().filter(|summary| summary.crc != 0)
}

/// Returns true if the file has an end with a valid checksum of all data.
pub(super) fn is_covered<R: Read + Seek>(source: &mut RecordSource<R>) -> Result<bool, Error> {
    let end_size = FRAME_SIZE + 4;
    let Some(end) = data_end(source).and_then(|end| end.checked_sub(end_size)) else { return Ok(false) };
    let mut body = Vec::new();
    source.seek(end)?;
    source.part(end_size, &mut body)?;
    let mut expected = Vec::new();
    source.seek(0)?;
    source.crc.reset();
    let mut left = end;
    let mut part = Vec::new();
    while left > 0 {
        source.part(left.min(1 << 20), &mut part)?;
        left -= (part.len() as u64).clamp(1, left);
    }
    let data_section_crc = source.crc.clone().finalize();
    DataEnd { data_section_crc }.append(&mut expected);
    Ok(data_section_crc != 0 && body == expected)
}

/// Returns the end of the record that ends the data itself, as the footer says.
fn data_end<R: Read + Seek>(source: &mut RecordSource<R>) -> Option<u64> {
    let place = source.length().checked_sub(FRAME_SIZE + 20 + MAGIC.len() as u64)?;
    source.seek(place).ok()?;
    let frame = source.frame().ok().filter(|frame| frame.opcode == Footer::OPCODE)?;
    let mut body = Vec::new();
    source.body(frame, &mut body).ok()?;
    let start = Footer::parse(&body).ok()?.summary_start;
    (start <= place).then_some(if start == 0 { place } else { start })
}

/// Returns the header, and the offset of the first record behind it.
pub(super) fn header<R: Read + Seek>(source: &mut RecordSource<R>) -> Result<(Header, u64), Error> {
    let start = MAGIC.len() as u64;
    let mut bytes = Vec::new();
    source.seek(0)?;
    source.part(start, &mut bytes)?;
    if bytes.is_empty() {
        let what = "it is empty, so there is nothing to repair".into();
        return Err(Error::NoBag { path: source.path().into(), what });
    }
    let begins = MAGIC.starts_with(&bytes);
    let mut body = Vec::new();
    let frame = source.frame();
    if let Ok(frame) = frame
        && frame.opcode == Header::OPCODE
    {
        source.body(frame, &mut body)?;
        if let Ok(header) = Header::parse(&body) {
            return Ok((header, frame.end()));
        }
    }
    match begins {
        true => Ok((Header::default(), start.min(source.length()))),
        false => {
            let what = format!("it begins with {bytes:02x?}, not {MAGIC:02x?}, and has no header");
            Err(Error::NoBag { path: source.path().into(), what })
        }
    }
}
