//! How the emulated sensor stands on the network: a UDP port for its stream and a web server for its page, both on loopback.

use super::faults::NetFtFaultSwitch;
use super::page;
use super::sensor::Sensor;
use super::setup::NetFtSetup;
use crate::clock::HostTime;
use std::io;
use std::net::Ipv4Addr;
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream, UdpSocket};
use tokio::runtime::Builder;
use tokio::sync::oneshot;
use tokio::time::{sleep, timeout};

/// Records sent at one go when the emulator has fallen behind: a receiver needs a moment to fetch them, as it would have had in life. As
/// many as are due in 28 ms, which is longer than most computers take to wake a thread.
const BURST: usize = 200;

/// Shortest wait between two goes.
const BREATH: Duration = Duration::from_millis(1);

/// How long a web client may take to say what it wants.
const PATIENCE: Duration = Duration::from_secs(2);

/// A Net F/T on loopback, running until it is dropped.
#[derive(Debug)]
pub struct NetFtEmulator {
    rdt_port: u16,
    http_port: u16,
    power_up: HostTime,
    faults: NetFtFaultSwitch,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl NetFtEmulator {
    /// Gives power to a sensor, whose clock stood at zero at `power_up`. `wrench` is asked for force and torque on it (N and N·m, sensor
    /// frame) at each record's own time, in seconds after that; times never go back. Records wait for it, and requests too.
    ///
    /// # Errors
    /// What the operating system says of sockets and threads.
    pub fn start(
        setup: NetFtSetup,
        power_up: HostTime,
        wrench: impl FnMut(f64) -> [f64; 6] + Send + 'static,
    ) -> io::Result<Self> {
        let runtime = Builder::new_current_thread().enable_io().enable_time().build()?;
        let (socket, listener) = runtime.block_on(async {
            let any = (Ipv4Addr::LOCALHOST, 0);
            Ok::<_, io::Error>((UdpSocket::bind(any).await?, TcpListener::bind(any).await?))
        })?;
        let (rdt_port, http_port) = (socket.local_addr()?.port(), listener.local_addr()?.port());
        let faults = NetFtFaultSwitch::default();
        let sensor = Sensor::new(setup, Box::new(wrench), faults.clone());
        let (stop, stopped) = oneshot::channel();
        let thread = std::thread::Builder::new().name("net-ft-emulator".to_owned()).spawn(move || {
            runtime.block_on(serve(sensor, power_up, &socket, &listener, stopped));
        })?;
        Ok(Self { rdt_port, http_port, power_up, faults, stop: Some(stop), thread: Some(thread) })
    }

    /// Port of the stream on 127.0.0.1.
    pub fn rdt_port(&self) -> u16 {
        self.rdt_port
    }

    /// Port of the web page on 127.0.0.1.
    pub fn http_port(&self) -> u16 {
        self.http_port
    }

    /// When the sensor's clock stood at zero.
    pub fn power_up(&self) -> HostTime {
        self.power_up
    }

    /// What goes wrong, to be changed while it runs.
    pub fn faults(&self) -> &NetFtFaultSwitch {
        &self.faults
    }
}

impl Drop for NetFtEmulator {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            // A panic of the wrench has been reported by its thread.
            let _ = thread.join();
        }
    }
}

async fn serve(
    mut sensor: Sensor,
    power_up: HostTime,
    socket: &UdpSocket,
    listener: &TcpListener,
    mut stopped: oneshot::Receiver<()>,
) {
    let tick_hz = sensor.setup().tick_hz;
    let now = || HostTime::now().seconds_after(power_up) * tick_hz;
    let mut request = [0; 64];
    let mut behind = false;
    loop {
        let ahead =
            sensor.due().map(|due| Duration::from_secs_f64(((due as f64 - now()) / tick_hz).max(0.0)));
        let wait = if behind { BREATH } else { ahead.unwrap_or_default() };
        tokio::select! {
            _ = &mut stopped => return,
            received = socket.recv_from(&mut request) => {
                // An error is the echo of a datagram that a client no longer took.
                if let Ok((length, from)) = received {
                    sensor.hear(&request[..length], from, now() as u64);
                }
            }
            accepted = listener.accept() => {
                if let Ok((client, _)) = accepted {
                    let (setup, status, fault) = (sensor.setup().clone(), sensor.status(), sensor.faults().page);
                    tokio::spawn(async move {
                        // A client that hangs up early is its own problem.
                        let _ = timeout(PATIENCE, answer(client, setup, status, fault)).await;
                    });
                }
            }
            () = sleep(wait), if ahead.is_some() => {
                // A full queue loses a datagram here as it would on the wire.
                behind = sensor.send_due(now() as u64, BURST, &mut |to, bytes| drop(socket.try_send_to(bytes, to)));
            }
        }
    }
}

async fn answer(
    mut client: TcpStream,
    setup: NetFtSetup,
    status: u32,
    fault: super::NetFtPageFault,
) -> io::Result<()> {
    let mut request = Vec::new();
    while !request.ends_with(b"\r\n\r\n") && request.len() < 8192 {
        if client.read_buf(&mut request).await? == 0 {
            break;
        }
    }
    let first_line = String::from_utf8_lossy(&request).lines().next().unwrap_or_default().to_owned();
    client.write_all(page::answer(&first_line, &setup, status, fault).as_bytes()).await?;
    client.shutdown().await
}
