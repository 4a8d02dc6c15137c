//! Why a bundle was refused: file, row (line of the file, the first being 1), column, value, expectation.

use super::MeshFileError;
use std::io;
use std::path::PathBuf;

/// Why a bundle was refused, or could not be read or written. Lengths in metres, times in seconds.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// The bundle is not a folder.
    #[error("{}: not a folder; expected a recording bundle", folder.display())]
    NotAFolder {
        /// What was given.
        folder: PathBuf,
    },
    /// A session that was not turned into a bundle.
    #[error("{0}: a session, not a recording bundle; `phantom-rig session export {0} --bundle {0}-bundle` makes one of it", folder.display())]
    IsASession {
        /// What was given.
        folder: PathBuf,
    },
    /// A session without pictures, or with none that can be read.
    #[error("no frame has a grey and a depth picture that can be read")]
    NoPictures,
    /// The tracker refuses the pictures.
    #[error("the pictures cannot be followed")]
    Track(#[from] crate::track::TrackError),
    /// A file that every bundle has is not there.
    #[error("{}: the file is missing; a recording bundle needs {expected}", file.display())]
    MissingFile {
        /// The file.
        file: PathBuf,
        /// What the bundle needs.
        expected: &'static str,
    },
    /// The operating system refused to read.
    #[error("{}: can't be read", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The operating system refused to write.
    #[error("{}: can't be written", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A session that cannot be read.
    #[error("the session")]
    Session(#[from] crate::session::SessionError),
    /// The calibration that a session keeps cannot be used.
    #[error(transparent)]
    Calibration(#[from] crate::calib::instruments::InstrumentError),
    /// A session that says too little to be a recording.
    #[error("{}: the session lacks {what}", session.display())]
    SessionWithout {
        /// Its folder.
        session: PathBuf,
        /// What a recording needs.
        what: &'static str,
    },
    /// Nothing to make a recording of.
    #[error("no session is named")]
    NoSessions,
    /// Sessions of different rigs are no one recording.
    #[error("{}: was recorded with another rig file than {}", session.display(), first.display())]
    OtherRig {
        /// Its folder.
        session: PathBuf,
        /// That of the session that the recording begins with.
        first: PathBuf,
    },
    /// Sessions out of order.
    #[error("{}: does not begin after the end of the session before it; name sessions in the order in which they were recorded", session.display())]
    SessionBack {
        /// Its folder.
        session: PathBuf,
    },
    /// Text in UTF-16.
    #[error("{}: the text is UTF-16; expected UTF-8 (save it again as \"UTF-8\" or \"CSV UTF-8\")", file.display())]
    Utf16 {
        /// The file.
        file: PathBuf,
    },
    /// Bytes that are not UTF-8.
    #[error("{}, row {row}: not UTF-8 text", file.display())]
    NotUtf8 {
        /// The file.
        file: PathBuf,
        /// Line of the first wrong byte.
        row: u64,
    },

    /// `recording.toml` is not TOML.
    #[error("{}, row {row}: not TOML: {message}", file.display())]
    NotToml {
        /// The file.
        file: PathBuf,
        /// Line.
        row: u64,
        /// What the parser says.
        message: String,
    },
    /// `recording.toml` has no `format`, or one that this program does not read.
    #[error("{}: format = {found}; expected \"{expected}\"", file.display())]
    UnknownFormat {
        /// The file.
        file: PathBuf,
        /// What stands there.
        found: String,
        /// What this program reads.
        expected: &'static str,
    },
    /// A key that is unknown, missing or of the wrong type.
    #[error("{}, row {row}: {message}", file.display())]
    ManifestKey {
        /// The file.
        file: PathBuf,
        /// Line.
        row: u64,
        /// The key and what was expected.
        message: String,
    },
    /// A value outside its range.
    #[error("{}: {key} = {value}; expected {expected}", file.display())]
    ManifestValue {
        /// The file.
        file: PathBuf,
        /// The key with its table.
        key: &'static str,
        /// What stands there.
        value: String,
        /// What was expected.
        expected: &'static str,
    },

    /// A column is missing from the header.
    #[error("{}, row 1: no column {column}; the header has {found:?}", file.display())]
    MissingColumn {
        /// The file.
        file: PathBuf,
        /// The column.
        column: &'static str,
        /// The columns that the header names.
        found: Vec<String>,
    },
    /// A file that is no table.
    #[error("{}: no table: its first line is not text; expected a table (CSV) that begins with the names of its columns", file.display())]
    NoTable {
        /// The file.
        file: PathBuf,
    },
    /// A column that stands in the header twice.
    #[error("{}, row 1: column {column} stands in the header twice; expected once", file.display())]
    RepeatedColumn {
        /// The file.
        file: PathBuf,
        /// The column.
        column: &'static str,
    },
    /// A row with fewer or more fields than the header.
    #[error(
        "{}, row {row}: {found} fields, the last of them \"{last}\"; expected {expected} as in the header (is the row cut off?)",
        file.display()
    )]
    FieldCount {
        /// The file.
        file: PathBuf,
        /// Line.
        row: u64,
        /// Fields in the row.
        found: usize,
        /// Fields in the header.
        expected: usize,
        /// The row's last field.
        last: String,
    },
    /// A header without rows.
    #[error("{}: no rows after the header; expected at least one", file.display())]
    NoRows {
        /// The file.
        file: PathBuf,
    },
    /// A field that is not a number.
    #[error("{}, row {row}, column {column}: \"{value}\" is not a number; expected {expected}", file.display())]
    NotANumber {
        /// The file.
        file: PathBuf,
        /// Line.
        row: u64,
        /// Column.
        column: &'static str,
        /// The field.
        value: String,
        /// What was expected.
        expected: &'static str,
    },
    /// A number that is infinite or NaN.
    #[error("{}, row {row}, column {column}: \"{value}\" is not finite; expected a finite number", file.display())]
    NonFinite {
        /// The file.
        file: PathBuf,
        /// Line.
        row: u64,
        /// Column.
        column: &'static str,
        /// The field.
        value: String,
    },
    /// A row earlier than the row before.
    #[error(
        "{}, row {row}, column {column}: {time_s} s follows {previous_s} s; expected rows sorted by time",
        file.display()
    )]
    UnsortedTime {
        /// The file.
        file: PathBuf,
        /// Line.
        row: u64,
        /// Column.
        column: &'static str,
        /// The row's time (s).
        time_s: f64,
        /// The time of the row before (s).
        previous_s: f64,
    },
    /// A marker with two rows at one instant.
    #[error("{}, row {row}, column marker: marker {marker} already has a row at {time_s} s; expected one", file.display())]
    RepeatedMarker {
        /// The file.
        file: PathBuf,
        /// Line.
        row: u64,
        /// Its number.
        marker: u32,
        /// The instant (s).
        time_s: f64,
    },
    /// More frames or markers than can be numbered.
    #[error("{}, row {row}: more than {limit} frames or markers", file.display())]
    TooMany {
        /// The file.
        file: PathBuf,
        /// Line.
        row: u64,
        /// The limit.
        limit: u32,
    },

    /// `pokes.csv` holds no poke.
    #[error("{}: no poke; expected at least one row", file.display())]
    NoPokes {
        /// The file.
        file: PathBuf,
    },
    /// Two pokes of one number.
    #[error("{}, row {row}, column poke: poke {poke} stands there twice; expected each number once", file.display())]
    RepeatedPoke {
        /// The file.
        file: PathBuf,
        /// Line of the second.
        row: u64,
        /// Its number.
        poke: u32,
    },
    /// A poke that ends before it starts.
    #[error(
        "{}, row {row}, column end_s: poke {poke} ends at {end_s} s, but starts at {start_s} s; expected a later end",
        file.display()
    )]
    EndBeforeStart {
        /// The file.
        file: PathBuf,
        /// Line.
        row: u64,
        /// Its number.
        poke: u32,
        /// Start (s).
        start_s: f64,
        /// End (s).
        end_s: f64,
    },
    /// A poke that starts while another lasts.
    #[error(
        "{}, row {row}, column start_s: poke {poke} starts at {start_s} s, while poke {other} lasts until {other_end_s} s; expected one poke at a time",
        file.display()
    )]
    OverlappingPokes {
        /// The file.
        file: PathBuf,
        /// Line.
        row: u64,
        /// Its number.
        poke: u32,
        /// Its start (s).
        start_s: f64,
        /// The poke that still lasts.
        other: u32,
        /// Until when (s).
        other_end_s: f64,
    },
    /// A poke in the rest interval.
    #[error(
        "{}, row {row}, column start_s: poke {poke} starts at {start_s} s, before rest_until_s = {rest_until_s} s; nothing may touch the phantom until then",
        file.display()
    )]
    PokeInRest {
        /// The file.
        file: PathBuf,
        /// Line.
        row: u64,
        /// Its number.
        poke: u32,
        /// Its start (s).
        start_s: f64,
        /// End of the rest interval (s).
        rest_until_s: f64,
    },
    /// A direction that is not a unit vector.
    #[error(
        "{}, row {row}, columns dir_x, dir_y, dir_z: the direction {direction:?} of poke {poke} has length {length}; expected 1",
        file.display()
    )]
    DirectionNotUnit {
        /// The file.
        file: PathBuf,
        /// Line.
        row: u64,
        /// Its number.
        poke: u32,
        /// The direction.
        direction: [f64; 3],
        /// Its length.
        length: f64,
    },
    /// A tip without a positive radius.
    #[error("{}, row {row}, column radius_m: poke {poke} has the radius {radius_m} m; expected more than 0", file.display())]
    RadiusNotPositive {
        /// The file.
        file: PathBuf,
        /// Line.
        row: u64,
        /// Its number.
        poke: u32,
        /// Radius (m).
        radius_m: f64,
    },
    /// A poke to be made that no stage can make.
    #[error("{}, row {row}, column {column}: poke {poke}'s {column} is {value}; expected {expected}", file.display())]
    CannotBeMade {
        /// The file.
        file: PathBuf,
        /// Line.
        row: u64,
        /// Its number.
        poke: u32,
        /// The column.
        column: &'static str,
        /// What stands there (SI).
        value: f64,
        /// What can be.
        expected: &'static str,
    },
    /// A site away from the phantom.
    #[error(
        "{}, row {row}, columns site_x_m, site_y_m, site_z_m: the site {site_m:?} m of poke {poke} lies {distance_m:.6} m from the mesh surface; expected at most its radius, {radius_m} m{}",
        file.display(), suspicion(.suspected)
    )]
    SiteOffSurface {
        /// The file.
        file: PathBuf,
        /// Line.
        row: u64,
        /// Its number.
        poke: u32,
        /// The site (m).
        site_m: [f64; 3],
        /// Distance to the surface (m).
        distance_m: f64,
        /// Radius of the tip (m).
        radius_m: f64,
        /// The unit mistake that would explain it, when one does.
        suspected: Option<String>,
    },

    /// A marker that nobody saw at rest.
    #[error(
        "{}, row {row}, column marker: marker {marker} is first seen at {first_s} s; expected a row in the rest interval, before {rest_until_s} s",
        file.display()
    )]
    MarkerNotAtRest {
        /// The file.
        file: PathBuf,
        /// Line of its first row.
        row: u64,
        /// Its number.
        marker: u32,
        /// Time of its first row (s).
        first_s: f64,
        /// End of the rest interval (s).
        rest_until_s: f64,
    },
    /// A marker away from the phantom.
    #[error(
        "{}, row {row}, columns x_m, y_m, z_m: marker {marker} rests at {rest_m:.6?} m, {distance_m:.6} m from the surface \"observed\"; expected at most {limit_m} m ([markers] max_standoff_m){}",
        file.display(), suspicion(.suspected)
    )]
    MarkerOffSurface {
        /// The file.
        file: PathBuf,
        /// Line of its first row.
        row: u64,
        /// Its number.
        marker: u32,
        /// Rest position (m).
        rest_m: [f64; 3],
        /// Distance to the surface (m).
        distance_m: f64,
        /// The limit (m).
        limit_m: f64,
        /// The unit mistake that would explain it, when one does.
        suspected: Option<String>,
    },

    /// A mesh file that was refused.
    #[error("{}", file.display())]
    Mesh {
        /// The file.
        file: PathBuf,
        /// Why.
        source: MeshFileError,
    },
    /// A mesh without a surface that every bundle names.
    #[error("{}: no physical surface \"{group}\" with triangles; the mesh names {found:?}", file.display())]
    MissingSurface {
        /// The file.
        file: PathBuf,
        /// The surface.
        group: &'static str,
        /// The surfaces that the mesh names.
        found: Vec<String>,
    },
}

fn suspicion(suspected: &Option<String>) -> String {
    suspected.as_ref().map_or_else(String::new, |s| format!(". Suspicion: {s}"))
}
