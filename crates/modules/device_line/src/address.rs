use std::fmt;
use std::path::{Path, PathBuf};

/// Line to a device, as a parameter names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LineAddress {
    /// Serial device, with its speed.
    Serial {
        /// Device, such as `/dev/ttyUSB0`.
        path: PathBuf,
        /// Baud rate.
        baud: u32,
    },
    /// Host and port of TCP.
    Tcp(String),
    /// Input device, such as `/dev/input/js0`, which is only read.
    Input(PathBuf),
}

/// Reason why a text is not a valid device address.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AddressError {
    /// Neither a path nor an address.
    #[error("expected a device such as \"/dev/ttyUSB0\"{}, found \"{text}\"", tcp(*.by_network))]
    Unknown {
        /// Text found.
        text: String,
        /// True if such devices exist with a network, too.
        by_network: bool,
    },
    /// Address without a host or with a wrong port.
    #[error("expected an address such as \"tcp://192.168.0.10:10940\", found \"{0}\"")]
    Tcp(String),
    /// Path of something that can't be a device.
    #[error("{} is {found}, and no device: expected a path such as \"/dev/ttyUSB0\"", .path.display())]
    NoDevice {
        /// Path.
        path: PathBuf,
        /// Type of the file found.
        found: &'static str,
    },
    /// Path whose folder does not exist.
    #[error("there is no folder {}: expected a device such as \"/dev/ttyUSB0\"", .0.display())]
    NoFolder(PathBuf),
}

fn tcp(by_network: bool) -> &'static str {
    if by_network { " or an address such as \"tcp://192.168.0.10:10940\"" } else { "" }
}

impl LineAddress {
    /// Returns a serial device by its path, or `tcp://HOST` with or without `:PORT`.
    ///
    /// # Errors
    /// When it is neither.
    pub fn parse(text: &str, baud: u32, default_port: u16) -> Result<Self, AddressError> {
        let Some(address) = text.strip_prefix("tcp://") else {
            return if text.starts_with('/') {
                Ok(Self::Serial { path: text.into(), baud })
            } else {
                Err(AddressError::Unknown { text: text.into(), by_network: true })
            };
        };
        let wrong = || AddressError::Tcp(text.into());
        // The last colon of a bracketed IPv6 address is within the brackets.
        let (host, port) = match address.rsplit_once(':') {
            Some((host, port)) if !port.ends_with(']') => (host, port.parse().map_err(|_| wrong())?),
            _ => (address, default_port),
        };
        if host.is_empty() || port == 0 || host.contains(['/', ' ']) {
            return Err(wrong());
        }
        Ok(Self::Tcp(format!("{host}:{port}")))
    }

    /// Returns a serial device by its path.
    ///
    /// # Errors
    /// When it is not an absolute path.
    pub fn serial(path: &str, baud: u32) -> Result<Self, AddressError> {
        if path.starts_with('/') {
            Ok(Self::Serial { path: path.into(), baud })
        } else {
            Err(AddressError::Unknown { text: path.into(), by_network: false })
        }
    }

    /// Returns an input device by its path.
    ///
    /// # Errors
    /// When it is not an absolute path.
    pub fn input(path: &str) -> Result<Self, AddressError> {
        Self::serial(path, 0).map(|_| Self::Input(path.into()))
    }

    /// Checks the form of the address. A device that is not connected is no error.
    ///
    /// # Errors
    /// When the folder of the path is missing, or a file or a folder is at the path.
    pub fn check(&self) -> Result<(), AddressError> {
        let (Self::Serial { path, .. } | Self::Input(path)) = self else { return Ok(()) };
        if path.is_dir() || path.is_file() {
            let found = if path.is_dir() { "a folder" } else { "a file" };
            return Err(AddressError::NoDevice { path: path.clone(), found });
        }
        let parent = path.parent().unwrap_or(Path::new("/"));
        // Linux makes these folders when the first such device is plugged in.
        let may_come = ["/dev/serial", "/dev/input"].iter().any(|folder| parent.starts_with(folder));
        if may_come || parent.is_dir() { Ok(()) } else { Err(AddressError::NoFolder(parent.into())) }
    }
}

impl fmt::Display for LineAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial { path, .. } | Self::Input(path) => path.display().fmt(f),
            Self::Tcp(address) => address.fmt(f),
        }
    }
}
