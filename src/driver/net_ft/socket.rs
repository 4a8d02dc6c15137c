//! How datagrams go to the sensor and come from it: those of nobody else, each with the time of its arrival, without ever waiting
//! longer than asked.
//!
//! The socket is not connected: what comes from elsewhere is counted instead of vanishing, and "nobody listens there", which a machine
//! may answer to a request, is silence and no error.

use super::rdt::{self, Command, MOST_RECORDS, RECORD_BYTES};
use crate::clock::HostTime;
use rustix::event::{PollFd, PollFlags, poll};
use std::io::{self, ErrorKind};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, SocketAddrV4, ToSocketAddrs, UdpSocket};

/// Room for what arrives while nobody receives, in bytes. The system may grant less: `net.core.rmem_max` of Linux is 208 KiB unless
/// somebody raised it, which was measured to hold 512 single records (73 ms of 7000 a second) or 184 datagrams of 40 (1.05 s).
const RECEIVE_BUFFER_BYTES: usize = 4 << 20;

/// The socket of one sensor's stream.
#[derive(Debug)]
pub(super) struct SensorSocket {
    socket: UdpSocket,
    sensor: SocketAddrV4,
    /// Datagrams from elsewhere.
    foreign: u64,
    /// One byte longer than the longest datagram, so that a longer one is seen to be.
    datagram: [u8; MOST_RECORDS * RECORD_BYTES + 1],
}

impl SensorSocket {
    /// A socket for the sensor at that address, on any port of this machine.
    pub(super) fn open(sensor: SocketAddrV4) -> io::Result<Self> {
        let socket = socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::DGRAM, None)?;
        socket.set_recv_buffer_size(RECEIVE_BUFFER_BYTES)?;
        socket.bind(&SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0)).into())?;
        socket.set_nonblocking(true)?;
        Ok(Self { socket: socket.into(), sensor, foreign: 0, datagram: [0; MOST_RECORDS * RECORD_BYTES + 1] })
    }

    /// The sensor's address.
    pub(super) fn sensor(&self) -> SocketAddrV4 {
        self.sensor
    }

    /// Datagrams that came from elsewhere.
    pub(super) fn foreign(&self) -> u64 {
        self.foreign
    }

    /// Sends a request, which nobody acknowledges.
    pub(super) fn send(&self, command: Command) -> io::Result<()> {
        self.socket.send_to(&rdt::request(command), self.sensor).map(drop)
    }

    /// The sensor's next datagram and when it had arrived; none when there was none until `until`.
    pub(super) fn next(&mut self, until: HostTime) -> io::Result<Option<(&[u8], HostTime)>> {
        loop {
            match self.socket.recv_from(&mut self.datagram) {
                Ok((length, from)) if from == SocketAddr::V4(self.sensor) => {
                    return Ok(Some((&self.datagram[..length], HostTime::now())));
                }
                Ok(_) => {
                    self.foreign += 1;
                    // Strangers cannot keep anybody here.
                    if HostTime::now() >= until {
                        return Ok(None);
                    }
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    if HostTime::now() >= until {
                        return Ok(None);
                    }
                    self.wait(until)?;
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }

    /// Waits until something has arrived, or until `until`.
    fn wait(&self, until: HostTime) -> io::Result<()> {
        let mut sockets = [PollFd::new(&self.socket, PollFlags::IN)];
        let timeout = until.remaining().try_into().ok();
        match poll(&mut sockets, timeout.as_ref()) {
            Ok(_) | Err(rustix::io::Errno::INTR) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }
}

/// The address of that name. The sensor has IPv4 only.
pub(super) fn resolve(address: &str) -> io::Result<Ipv4Addr> {
    let found = (address, 0).to_socket_addrs()?.find_map(|found| match found.ip() {
        IpAddr::V4(host) => Some(host),
        IpAddr::V6(_) => None,
    });
    found.ok_or_else(|| io::Error::new(ErrorKind::AddrNotAvailable, "it has no IPv4 address"))
}
