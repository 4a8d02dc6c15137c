//! How the sensor's configuration page comes over the network: one short request, and a clear word when there is no answer.

use super::super::DriverError;
use std::net::Ipv4Addr;
use std::time::Duration;
use ureq::Agent;

/// The page of the active configuration.
const PAGE: &str = "netftapi2.xml";

/// How long the whole exchange may take: an unreachable sensor is reported before anybody thinks that the program hangs.
const PATIENCE: Duration = Duration::from_secs(2);

/// Longest page that is read; real ones have some kilobytes.
const LONGEST_PAGE: u64 = 256 * 1024;

/// Fetches the page.
///
/// # Errors
/// [`DriverError::ForcePage`].
pub(super) fn fetch_page(host: Ipv4Addr, port: u16) -> Result<Vec<u8>, DriverError> {
    let url = format!("http://{host}:{port}/{PAGE}");
    // The sensor stands on the bench: neither a proxy nor another host has anything to say for it.
    let agent: Agent =
        Agent::config_builder().timeout_global(Some(PATIENCE)).proxy(None).max_redirects(0).build().into();
    let page = agent
        .get(&url)
        .call()
        .and_then(|mut reply| reply.body_mut().with_config().limit(LONGEST_PAGE).read_to_vec());
    page.map_err(|source| DriverError::ForcePage { url, source: Box::new(source) })
}
