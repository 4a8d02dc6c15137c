//! What a session's messages are about, and how each kind is written down: topic, channel number, schema.
//!
//! Documents and events are JSON, described by a JSON Schema. Streams are CDR (little-endian), described by a ROS 2 message definition,
//! so that public tools decode them without knowing this program.

use std::fmt;

/// A topic of a session. Its channel number in the file is part of the format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Topic {
    /// The start document: the first message.
    Start,
    /// Batches of raw force records.
    Force,
    /// Reports of the stage.
    Stage,
    /// Frames of marker positions.
    Markers,
    /// Probes of the offset between the host's clock and a device's.
    ClockProbe,
    /// Records that are known to be missing.
    Gap,
    /// What happened.
    Event,
    /// The stop document: the last message. A session without one was interrupted.
    Stop,
    /// Frames of the depth camera.
    Frame,
    /// Their grey pictures.
    Grey,
    /// Their depth pictures.
    Depth,
}

/// How the messages of a topic are described in the file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Schema {
    /// Name of the type.
    pub(super) name: &'static str,
    /// Language of `text`.
    pub(super) encoding: &'static str,
    /// Description of the type.
    pub(super) text: &'static str,
    /// Encoding of the messages.
    pub(super) message_encoding: &'static str,
}

impl Topic {
    /// All topics, by channel number.
    pub const ALL: [Self; 11] = [
        Self::Start,
        Self::Force,
        Self::Stage,
        Self::Markers,
        Self::ClockProbe,
        Self::Gap,
        Self::Event,
        Self::Stop,
        Self::Frame,
        Self::Grey,
        Self::Depth,
    ];

    /// Its name in the file.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Start => "/start",
            Self::Force => "/force",
            Self::Stage => "/stage",
            Self::Markers => "/markers",
            Self::ClockProbe => "/clock_probe",
            Self::Gap => "/gap",
            Self::Event => "/event",
            Self::Stop => "/stop",
            Self::Frame => "/camera/frame",
            Self::Grey => "/camera/grey",
            Self::Depth => "/camera/depth",
        }
    }

    /// The topic of that name.
    pub(super) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|t| t.name() == name)
    }

    /// Place in [`Self::ALL`].
    pub(super) const fn index(self) -> usize {
        self as usize
    }

    /// Number of its channel in a file that this program wrote: from 1.
    pub(super) const fn channel(self) -> u16 {
        self as u16 + 1
    }

    pub(super) const fn schema(self) -> Schema {
        let (name, text) = match self {
            Self::Start => ("phantom_rig.Start", START),
            Self::Force => ("phantom_rig/msg/ForceBatch", FORCE),
            Self::Stage => ("phantom_rig/msg/StageReport", STAGE),
            Self::Markers => ("phantom_rig/msg/MarkerFrame", MARKERS),
            Self::ClockProbe => ("phantom_rig/msg/ClockProbe", CLOCK_PROBE),
            Self::Gap => ("phantom_rig/msg/Gap", GAP),
            Self::Event => ("phantom_rig.Event", EVENT),
            Self::Stop => ("phantom_rig.Stop", STOP),
            Self::Frame => ("phantom_rig/msg/CameraFrame", FRAME),
            Self::Grey | Self::Depth => ("foxglove_msgs/msg/CompressedImage", PICTURE),
        };
        let (encoding, message_encoding) = match self {
            Self::Start | Self::Event | Self::Stop => ("jsonschema", "json"),
            Self::Force
            | Self::Stage
            | Self::Markers
            | Self::ClockProbe
            | Self::Gap
            | Self::Frame
            | Self::Grey
            | Self::Depth => ("ros2msg", "cdr"),
        };
        Schema { name, encoding, text, message_encoding }
    }
}

impl fmt::Display for Topic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

const FORCE: &str = "\
# Raw records of the force sensor in columns: element i of every column belongs to record i.
# What a count is worth stands in the start document. Every time is of the host's monotonic clock (ns).
uint64 first_record      # number of force records in this file before this batch
uint64[] host_ns         # arrival at the host
uint32[] rdt_sequence    # number within the request
uint32[] ft_sequence     # the sensor's own clock
uint32[] status
int32[] fx_counts        # in the sensor's frame
int32[] fy_counts
int32[] fz_counts
int32[] tx_counts
int32[] ty_counts
int32[] tz_counts
";

const STAGE: &str = "\
# What the stage says of itself.
uint8 IDLE=0
uint8 MOVING=1
uint8 HOMING=2
uint8 FAULT=3
uint64 host_ns           # arrival at the host, on its monotonic clock
bool has_tick
uint32 tick_us           # the controller's own time, wraps; 0 when it tells none
float64[2] position_m    # along each axis, from where it homes
uint8 state
uint8 fault_code         # 0 unless state is FAULT
bool homed
";

const MARKERS: &str = "\
# All markers seen in one frame, in columns, in the phantom frame.
uint64 host_ns           # when the frame was grabbed, on the host's monotonic clock
uint32 number            # of the frame
uint32[] marker
float64[] x_m
float64[] y_m
float64[] z_m
";

const FRAME: &str = "\
# A frame of the depth camera. Its pictures have the same time.
uint64 host_ns           # when it was grabbed, on the host's monotonic clock
uint32 number            # that its source gives it; a gap is a frame that was lost
bool has_device_s
float64 device_s         # the source's own time; 0 when it tells none
";

/// Foxglove's schema of compressed pictures (docs.foxglove.dev, CompressedImage), as ROS 2 defines messages.
const PICTURE: &str = "\
# A PNG: grey levels in 8 bits, or depths in 16, in units that stand in the start document.
builtin_interfaces/Time timestamp   # of the host's monotonic clock
string frame_id
uint8[] data
string format
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
";

const CLOCK_PROBE: &str = "\
# One question for a device's clock and its answer. Recorded as it is; nothing in this file was corrected with it.
string device
uint64 sent_ns           # question handed over, on the host's monotonic clock
uint64 received_ns       # answer arrived, on the host's monotonic clock
uint64 device_ticks      # the device's counter in the answer
float64 tick_hz          # nominal rate of that counter
";

const GAP: &str = "\
# Records that are known to be missing.
uint8 QUEUE_FULL=0       # handed over faster than the disk took them
uint8 NOT_RECEIVED=1     # the device counted them, but they never came
string topic
uint8 cause
uint64 records
uint64 first_ns          # of the first and the last missing record, or of those around them, on the host's monotonic clock
uint64 last_ns
";

const START: &str = r#"{
  "title": "phantom_rig.Start", "type": "object",
  "properties": {
    "format": {"type": "string"},
    "name": {"type": "string"},
    "segment": {"type": "integer", "description": "number of this file within the session, from 1"},
    "first_poke": {"type": "integer", "description": "the poke that this segment begins with"},
    "started_utc": {"type": "string", "description": "wall clock at the start; the only wall-clock time in the file"},
    "started_host_ns": {"type": "integer", "description": "the host's monotonic clock at the same instant"},
    "boot": {"type": "string", "description": "monotonic clocks of files compare where this is the same"},
    "program": {"type": "string"},
    "seeds": {"type": "object"},
    "rig": {"type": "object", "properties": {"text": {"type": "string"}, "sha256": {"type": "string"}}},
    "protocol": {"type": "object", "properties": {"text": {"type": "string"}, "sha256": {"type": "string"}}},
    "variables": {"type": "object", "description": "values that variables of the protocol were given from outside"},
    "stage": {"type": "object"},
    "force": {"type": "object"},
    "markers": {"type": "object"},
    "camera": {"type": "object"},
    "calibration": {"type": "object", "description": "the calibration set in use, and its files that readings are put right by"},
    "mounting": {"type": "object"},
    "tip": {"type": "object"},
    "phantom": {"type": "object"}
  }
}"#;

const EVENT: &str = r#"{
  "title": "phantom_rig.Event", "type": "object",
  "properties": {
    "host_ns": {"type": "integer", "description": "the host's monotonic clock"},
    "name": {"type": "string"},
    "poke": {"type": "integer"},
    "detail": {"type": "object"}
  }
}"#;

const STOP: &str = r#"{
  "title": "phantom_rig.Stop", "type": "object",
  "properties": {
    "outcome": {"type": "string", "enum": ["success", "abort", "fail"]},
    "cause": {"type": "string"},
    "stopped_host_ns": {"type": "integer", "description": "the host's monotonic clock"},
    "messages": {"type": "object", "description": "messages of each topic in this file, without this one"},
    "force_records": {"type": "integer"},
    "dropped": {"type": "object", "description": "records of each topic that were handed over but not written"},
    "sensor": {"type": "object", "description": "what became of the force records on their way to the host"}
  }
}"#;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_channel_number_is_the_place_in_the_list() {
        for (place, topic) in Topic::ALL.into_iter().enumerate() {
            assert_eq!((topic.index(), usize::from(topic.channel())), (place, place + 1));
            assert_eq!(Topic::named(topic.name()), Some(topic));
        }
        assert_eq!(Topic::named("/else"), None);
    }

    #[test]
    fn json_schemas_are_json() {
        for topic in [Topic::Start, Topic::Event, Topic::Stop] {
            let schema: serde_json::Value = serde_json::from_str(topic.schema().text).expect("JSON");
            assert_eq!(
                (&schema["type"], schema["title"].as_str()),
                (&"object".into(), Some(topic.schema().name))
            );
        }
    }
}
