//! Which serial ports this machine has.

use super::DriverError;
use serialport::SerialPortType;

/// Paths of the serial ports behind which a controller may be, USB ones first.
///
/// # Errors
/// [`DriverError::Ports`]: the operating system does not tell.
pub fn serial_ports() -> Result<Vec<String>, DriverError> {
    let mut ports = serialport::available_ports().map_err(|source| DriverError::Ports { source })?;
    ports.sort_by_key(|port| (!matches!(port.port_type, SerialPortType::UsbPort(_)), port.port_name.clone()));
    Ok(ports.into_iter().map(|port| port.port_name).collect())
}
