//! What a session says of a run besides the streams: names and details of its events. `dataset` reads them again.

use crate::acquire::plan::{Leg, PlanStep};
use crate::clock::HostTime;
use crate::device::ClockComparison;
use crate::session::{ClockProbe, Event};
use serde_json::{Value, json};

/// An event with details, which are a JSON object.
pub(super) fn event(name: &'static str, poke: Option<u32>, detail: Value) -> Event {
    let mut event = Event::new(HostTime::now(), name);
    event.poke = poke;
    if let Value::Object(detail) = detail {
        event.detail = detail;
    }
    event
}

/// A clock that was compared.
pub(super) fn clock_probe(device: &str, compared: ClockComparison) -> ClockProbe {
    let ClockComparison { sent, received, ticks, tick_hz } = compared;
    ClockProbe { device: device.to_owned(), sent, received, device_ticks: ticks.into(), tick_hz }
}

/// A step begins.
pub(super) fn step(step: &PlanStep) -> Event {
    let planned = &step.step;
    let id = planned.id.to_string();
    event("step", planned.poke, json!({"number": planned.number, "id": id, "kind": planned.kind.name()}))
}

/// A leg begins.
pub(super) fn leg(step: &PlanStep, leg: &Leg) -> Event {
    event("leg", step.step.poke, json!({"phase": leg.phase.name()}))
}
