//! Signs with QR codes and AprilTags.

use qrcodegen::{QrCode, QrCodeEcc};
use slate_interfaces::TAG16H5;

use crate::render::texture::Texture;
use crate::scenery::SignDescription;

/// Margin of a QR code in cells, as its standard requires.
const QR_MARGIN: i32 = 4;
/// Margin of a tag in cells.
const TAG_MARGIN: i32 = 1;
/// Side of a tag in cells: 4 of data in a black frame.
const TAG_CELLS: i32 = 6;

/// Square pattern of black and white cells.
pub(crate) struct CellPattern {
    /// Number of cells of a side, without the white margin.
    side: i32,
    margin: i32,
    /// Cells, row by row from the top.
    is_black: Vec<bool>,
}

impl CellPattern {
    /// Returns the pattern of a sign; `None` without a code, or for too long a text.
    pub fn of(sign: &SignDescription) -> Option<Self> {
        match (&sign.qr, sign.april_tag) {
            (Some(text), _) => {
                let code = QrCode::encode_text(text, QrCodeEcc::Medium).ok()?;
                let side = code.size();
                let cells = (0..side).flat_map(|row| (0..side).map(move |column| (column, row)));
                let is_black = cells.map(|(column, row)| code.get_module(column, row)).collect();
                Some(Self { side, margin: QR_MARGIN, is_black })
            }
            (None, Some(number)) => {
                let code = *TAG16H5.get(number as usize)?;
                let cells = (0..TAG_CELLS).flat_map(|row| (0..TAG_CELLS).map(move |column| (column, row)));
                let inside = 1..TAG_CELLS - 1;
                let is_black = cells.map(|(column, row)| {
                    let is_frame = !(inside.contains(&column) && inside.contains(&row));
                    is_frame || code >> (15 - (4 * (row - 1) + column - 1)) & 1 == 0
                });
                Some(Self { side: TAG_CELLS, margin: TAG_MARGIN, is_black: is_black.collect() })
            }
            (None, None) => None,
        }
    }

    /// Returns the ratio of the sign's width to its code's.
    pub fn scale(&self) -> f64 {
        f64::from(self.side + 2 * self.margin) / f64::from(self.side)
    }

    /// Paints the whole sign, with its white margin.
    pub fn paint(&self) -> Texture {
        let whole = self.side + 2 * self.margin;
        Texture::paint([8, 8], |u, v| {
            let cell = |share: f32| (share * whole as f32) as i32 - self.margin;
            let (column, row) = (cell(u), cell(1.0 - v));
            let is_inside = (0..self.side).contains(&column) && (0..self.side).contains(&row);
            let is_black = is_inside && self.is_black[(row * self.side + column) as usize];
            if is_black { [0.16, 0.16, 0.16, 1.0] } else { [0.95, 0.95, 0.94, 1.0] }
        })
    }
}
