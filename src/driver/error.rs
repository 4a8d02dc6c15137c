//! How drivers fail while a device is being opened. Once it is open, [`DeviceError`](crate::device::DeviceError) says it.

/// Why a device cannot be opened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DriverError {
    /// Nobody tells which serial ports there are.
    #[error("the serial ports can't be listed")]
    Ports {
        /// What the operating system says.
        source: serialport::Error,
    },
    // Force sensor.
    /// Its configuration page cannot be fetched.
    #[error("the force sensor's configuration page {url} cannot be read")]
    ForcePage {
        /// Where the page should be.
        url: String,
        /// What went wrong on the way.
        source: Box<ureq::Error>,
    },
    /// Its configuration page is no XML, or is cut off.
    #[error("the force sensor's configuration page breaks off at byte {byte}: {why}")]
    ForcePageBroken {
        /// How far it could be read.
        byte: u64,
        /// What is wrong there. Why a text: the reader's error says its cause itself, and names it as its cause once more.
        why: String,
    },
    /// Another page was served.
    #[error("the page holds {root:?}, not the force sensor's active configuration ({expected})")]
    ForceOtherPage {
        /// Name of its root element.
        root: String,
        /// Root elements of the page that was asked for.
        expected: &'static str,
    },
    /// Its configuration page holds something that readings cannot be built upon.
    #[error(
        "<{tag}> of the force sensor's configuration is {}; expected {expected}",
        value.as_deref().unwrap_or("missing")
    )]
    ForceSetting {
        /// Tag of the page.
        tag: &'static str,
        /// What it holds; none when it is not there.
        value: Option<String>,
        /// What it should hold.
        expected: String,
    },
    /// There is no way to it on the network.
    #[error("the force sensor at {address} cannot be talked to")]
    ForceSocket {
        /// Its address.
        address: String,
        /// What the operating system says.
        source: std::io::Error,
    },

    // Serial ports.
    /// The port cannot be opened: not there, no permission, or another program has it.
    #[error("serial port {port} cannot be opened")]
    Open {
        /// Its path.
        port: String,
        /// What the operating system says.
        source: serialport::Error,
    },

    // Stages run by Grbl.
    /// A Grbl that speaks another dialect than 1.1's.
    #[error(
        "{device} is version {version}; this program speaks with Grbl 1.1 and grblHAL, which calls itself 1.1"
    )]
    GrblVersion {
        /// Which device, and where.
        device: String,
        /// Its version.
        version: String,
    },
    /// It does not have the stage's axes.
    #[error("{device} has the axes {has}; the stage is to have {} and {}, two different ones of them", asked[0], asked[1])]
    GrblAxes {
        /// Which device, and where.
        device: String,
        /// Letters that were asked for.
        asked: [char; 2],
        /// Letters that it has.
        has: String,
    },
    /// One of its settings does not serve.
    #[error("{device} has {}; expected {expected}", setting_text(*setting, *value))]
    GrblSetting {
        /// Which device, and where.
        device: String,
        /// Number of the setting.
        setting: u16,
        /// Its value; none when it did not tell one.
        value: Option<f64>,
        /// What it should be.
        expected: &'static str,
    },

    // Stages that run the rig's own firmware.
    /// The operating system gives no random number, which a session needs.
    #[error("no random number for a session with the stage")]
    NoRandomNumber {
        /// What the operating system says.
        source: rand::rngs::SysError,
    },
    /// Its firmware speaks another version of the protocol.
    #[error(
        "{device} speaks version {major} of the protocol, this program version {ours}: it can be stopped, but not moved"
    )]
    NativeMajor {
        /// Which device, and where.
        device: String,
        /// Its version.
        major: i64,
        /// The program's.
        ours: u8,
    },
    /// Its firmware was made from another table of messages.
    #[error(
        "{device} has firmware {firmware:016x} with message table {schema:016x}, this program has table {ours:016x}: it can be \
         stopped, but not moved; install firmware and program of the same version"
    )]
    NativeSchema {
        /// Which device, and where.
        device: String,
        /// Hash of its firmware.
        firmware: u64,
        /// Hash of its table.
        schema: u64,
        /// Hash of the program's.
        ours: u64,
    },
    /// Its firmware cannot do what the rig needs.
    #[error("{device} cannot do {missing}, which the rig needs")]
    NativeCapability {
        /// Which device, and where.
        device: String,
        /// Name of the capability.
        missing: &'static str,
    },

    // Depth cameras.
    /// This program cannot drive any.
    #[error("no depth camera can be driven: this program was built without OpenCV (cargo feature `opencv`)")]
    VideoAbsent,
    /// An option that makes no sense.
    #[error("{name} of the depth camera is {value}; expected {expected}")]
    VideoSetting {
        /// Name of the option.
        name: &'static str,
        /// Its value.
        value: String,
        /// What it should be.
        expected: &'static str,
    },
    /// OpenCV does not have what drives such a camera.
    #[error("the OpenCV that is installed cannot drive such a camera: it lacks {asked}, and has {installed}")]
    VideoBackend {
        /// Name of the backend that it would take.
        asked: &'static str,
        /// Names of those that are there.
        installed: String,
    },
    /// OpenCV does not open it.
    #[error(
        "OpenCV ({backend}) cannot open {device}{}; with OPENCV_LOG_LEVEL=WARNING in the environment it says more",
        said_text(said)
    )]
    VideoOpen {
        /// Device or pipeline.
        device: String,
        /// Name of the backend.
        backend: &'static str,
        /// What OpenCV says; often nothing.
        said: String,
    },
    /// Its pictures are of another kind or size.
    #[error("{device} gives {found}; expected {expected}")]
    VideoPicture {
        /// Device, pipeline or files.
        device: String,
        /// What its first picture is.
        found: String,
        /// What it should be.
        expected: String,
    },
    /// Image files whose names OpenCV would misread.
    #[error("the pattern {} {problem}", pattern.display())]
    VideoPattern {
        /// Pattern of their names.
        pattern: std::path::PathBuf,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// The folder of image files cannot be read.
    #[error("{} cannot be read", folder.display())]
    VideoFolder {
        /// The folder.
        folder: std::path::PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// No such image files.
    #[error("there is no file {} that the table of times has", pattern.display())]
    VideoNoFiles {
        /// Pattern of their names.
        pattern: std::path::PathBuf,
    },
    /// The table that says when image files were taken cannot be read: pictures without times are worth nothing.
    #[error("{}, which should say when each image file was taken, cannot be read", file.display())]
    VideoTimes {
        /// The table.
        file: std::path::PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// That table lacks a column.
    #[error("{} has no column {column}", file.display())]
    VideoTimesColumn {
        /// The table.
        file: std::path::PathBuf,
        /// Name of the column.
        column: &'static str,
    },
    /// A row of that table makes no sense.
    #[error("{}, line {line}: {found}; expected {expected}", file.display())]
    VideoTimesRow {
        /// The table.
        file: std::path::PathBuf,
        /// Its line, from 1.
        line: u64,
        /// What is there.
        found: String,
        /// What should be.
        expected: String,
    },
    /// An image file that the table has no time of.
    #[error("{} has no row for {}: nobody knows when that was taken", times.display(), file.display())]
    VideoUntimed {
        /// The image file.
        file: std::path::PathBuf,
        /// The table.
        times: std::path::PathBuf,
    },

    /// It can be reached, but something goes wrong from there on.
    #[error(transparent)]
    Device(#[from] crate::device::DeviceError),
}

fn said_text(said: &str) -> String {
    if said.is_empty() { String::new() } else { format!(": {said}") }
}

fn setting_text(setting: u16, value: Option<f64>) -> String {
    value.map_or_else(|| format!("no setting ${setting}"), |value| format!("${setting}={value}"))
}
