use slate_module::Random;

/// Faults of the line, in both directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    /// Probability that a byte is lost.
    pub drop: f64,
    /// Probability that a byte becomes another one.
    pub corrupt: f64,
    /// Silence: true if the device sends no bytes.
    pub silent: bool,
    /// Noise: true if the device sends noise alone.
    pub noise: bool,
}

impl Faults {
    /// Returns what arrives of bytes in either direction.
    pub fn spoil(&self, bytes: &[u8], random: &mut Random) -> Vec<u8> {
        let mut spoilt = Vec::with_capacity(bytes.len());
        for byte in bytes {
            if random.unit() < self.drop {
                continue;
            }
            let other = if random.unit() < self.corrupt { (random.unit() * 256.0) as u8 } else { *byte };
            spoilt.push(other);
        }
        spoilt
    }

    /// Returns the bytes that arrive of those that the device sends.
    pub fn spoil_reports(&self, bytes: &[u8], random: &mut Random) -> Vec<u8> {
        if self.silent {
            return Vec::new();
        }
        if self.noise {
            return (0..4).map(|_| (random.unit() * 256.0) as u8).collect();
        }
        self.spoil(bytes, random)
    }
}
