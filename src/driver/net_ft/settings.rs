//! Where a Net F/T is, and how it is asked to stream.

/// Where the sensor is, and how it is to stream.
#[derive(Debug, Clone, PartialEq)]
pub struct NetFtSettings {
    /// Its address or name on the network, without a port.
    pub address: String,
    /// Port of its web page.
    pub http_port: u16,
    /// Port of its stream.
    pub rdt_port: u16,
    /// Rate that it must be set to (records/s); any when none is given. Nobody sets it from here: it would change the sensor for
    /// everybody who uses it.
    pub expected_rate_hz: Option<f64>,
    /// Several records a datagram: less work for both ends, at the price of the time that it takes to collect them.
    pub buffered: bool,
}

impl NetFtSettings {
    /// The sensor at that address with the ports that it has from the factory, at any rate, one record a datagram.
    pub fn at(address: impl Into<String>) -> Self {
        Self {
            address: address.into(),
            http_port: 80,
            rdt_port: 49152,
            expected_rate_hz: None,
            buffered: false,
        }
    }
}
