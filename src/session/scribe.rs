//! How messages become an MCAP file: chunks with checksums, closed so often that little is lost when the process is killed.
//!
//! Why no compression: raw counts with noise hardly shrink, and a chunk that is written as it stands is found again in a damaged file.
//! Why chunks are built in memory: the file then never holds a chunk whose length and checksum are still to be filled in.

use super::message::Message;
use super::{SessionError, Topic};
use crate::clock::HostTime;
use mcap::McapError;
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use std::collections::BTreeMap;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// A chunk is written out so long after its first message.
pub(super) const CHUNK_SPAN: Duration = Duration::from_millis(50);

/// A chunk is written out when it is larger (bytes): about 0.3 s of everything but pictures. What a writer that was held up catches up
/// with in no time is not to be lost with one damaged chunk either.
const CHUNK_SIZE: u64 = 1 << 17;

/// Largest payload of a message (bytes).
pub(super) const LARGEST_MESSAGE: usize = 16 << 20;

/// Holds an ordinary chunk with its index, so that it is written by one call.
const BUFFER: usize = 256 << 10;

/// Writes one file.
pub(super) struct Scribe<W: Write> {
    mcap: mcap::Writer<NoSeek<BufWriter<W>>>,
    file: PathBuf,
    counts: Counts,
    payload: Vec<u8>,
    /// When the first message came that is not yet written out.
    waiting_since: Option<HostTime>,
}

/// What was written.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    messages: [u64; Topic::ALL.len()],
    pub(super) force_records: u64,
}

impl Counts {
    /// Messages of each topic, by name.
    pub(super) fn messages(&self) -> BTreeMap<String, u64> {
        Topic::ALL
            .into_iter()
            .map(|t| (t.name().to_owned(), self.messages[t.index()]))
            .filter(|&(_, count)| count > 0)
            .collect()
    }
}

impl<W: Write> Scribe<W> {
    /// Begins a file: header, all schemas and all channels, which stay in memory until the first message is written out.
    pub(super) fn begin(sink: W, file: &Path) -> Result<Self, SessionError> {
        let failed = |error| failed(file, error);
        let mut mcap = mcap::WriteOptions::new()
            .compression(None)
            .chunk_size(Some(CHUNK_SIZE))
            .disable_seeking(true)
            .library(concat!("phantom-rig/", env!("CARGO_PKG_VERSION")))
            .create(NoSeek::new(BufWriter::with_capacity(BUFFER, sink)))
            .map_err(failed)?;
        for topic in Topic::ALL {
            let (schema, number) = (topic.schema(), topic.channel());
            mcap.add_schema_with_id(number, schema.name, schema.encoding, schema.text.as_bytes())
                .and_then(|id| {
                    let metadata = BTreeMap::new();
                    mcap.add_channel_with_id(number, id, topic.name(), schema.message_encoding, &metadata)
                })
                .map_err(failed)?;
        }
        Ok(Self {
            mcap,
            file: file.to_owned(),
            counts: Counts::default(),
            payload: Vec::new(),
            waiting_since: None,
        })
    }

    /// Adds a message. A batch is told how many force records come before it.
    pub(super) fn write(&mut self, mut message: Message) -> Result<(), SessionError> {
        if let Message::Force(batch) = &mut message {
            batch.first_record = self.counts.force_records;
        }
        let mut payload = std::mem::take(&mut self.payload);
        message.encode(&mut payload)?;
        let topic = message.topic();
        self.copy(topic, message.host().nanos(), self.next_sequence(topic), &payload)?;
        if let Message::Force(batch) = &message {
            self.counts.force_records += batch.records().len() as u64;
        }
        self.payload = payload;
        Ok(())
    }

    /// Adds a message whose payload is known. It does not count as force records.
    pub(super) fn copy(
        &mut self,
        topic: Topic,
        log_time: u64,
        sequence: u32,
        payload: &[u8],
    ) -> Result<(), SessionError> {
        if payload.len() > LARGEST_MESSAGE {
            return Err(SessionError::TooLarge { topic, bytes: payload.len(), most: LARGEST_MESSAGE });
        }
        let header =
            MessageHeader { channel_id: topic.channel(), sequence, log_time, publish_time: log_time };
        self.mcap.write_to_known_channel(&header, payload).map_err(|error| failed(&self.file, error))?;
        self.counts.messages[topic.index()] += 1;
        self.waiting_since.get_or_insert_with(HostTime::now);
        Ok(())
    }

    /// Number of a topic's next message, from 1.
    fn next_sequence(&self, topic: Topic) -> u32 {
        // Wraps after years.
        (self.counts.messages[topic.index()] as u32).wrapping_add(1)
    }

    pub(super) fn counts(&self) -> &Counts {
        &self.counts
    }

    /// When what waits has to be written out; none when nothing waits.
    pub(super) fn due(&self) -> Option<HostTime> {
        self.waiting_since.map(|since| since + CHUNK_SPAN)
    }

    /// Hands all messages so far to the operating system.
    pub(super) fn flush(&mut self) -> Result<(), SessionError> {
        self.waiting_since = None;
        self.mcap.flush().map_err(|error| failed(&self.file, error))
    }

    /// Writes indexes and footer; the sink holds a complete file.
    pub(super) fn finish(mut self) -> Result<W, SessionError> {
        self.mcap.finish().map_err(|error| failed(&self.file, error))?;
        let buffered = self.mcap.into_inner().into_inner();
        buffered.into_inner().map_err(|error| SessionError::write(&self.file)(error.into_error()))
    }
}

fn failed(file: &Path, error: McapError) -> SessionError {
    let source = match error {
        McapError::Io(source) => source,
        other => io::Error::other(other),
    };
    SessionError::Write { file: file.to_owned(), source: Arc::new(source) }
}
