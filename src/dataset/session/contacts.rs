//! When did the tip touch the phantom, where, and how far was it in: strokes of the session with the reports of the stage.

use crate::device::Mounting;
use crate::geometry::Vec3;
use crate::session::Event;

/// One stroke that was begun.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stroke {
    /// Number of the poke in the protocol.
    pub(super) poke: u32,
    /// Tip centre on the undeformed surface (m).
    pub(super) site: Vec3,
    /// Unit vector into the phantom.
    pub(super) direction: Vec3,
    /// Radius of the tip (m).
    pub(super) radius_m: f64,
    /// Host time (ns) at which it was begun and at which it was over; none where it was not finished.
    pub(super) began_ns: u64,
    pub(super) ended_ns: Option<u64>,
    /// Host time (ns) at which the tip went down to the surface for the first time.
    pub(super) pressed_ns: Option<u64>,
}

/// The strokes that touch the phantom, in order.
pub(super) fn strokes(events: impl Iterator<Item = Event>) -> Vec<Stroke> {
    let mut strokes: Vec<Stroke> = Vec::new();
    for event in events {
        let number = |key: &str| event.detail.get(key).and_then(serde_json::Value::as_f64);
        let vector = |key: &str| -> Option<Vec3> {
            let list = event.detail.get(key)?.as_array()?;
            let values: Vec<f64> = list.iter().filter_map(serde_json::Value::as_f64).collect();
            <[f64; 3]>::try_from(values).ok().map(Vec3::from)
        };
        let open = |s: &&mut Stroke| s.ended_ns.is_none() && Some(s.poke) == event.poke;
        match (event.name.as_str(), event.poke) {
            ("stroke", Some(poke)) => {
                if let (Some(site), Some(direction), Some(radius_m)) =
                    (vector("site_m"), vector("direction"), number("radius_m"))
                {
                    let began_ns = event.host_ns;
                    strokes.push(Stroke {
                        poke,
                        site,
                        direction,
                        radius_m,
                        began_ns,
                        ended_ns: None,
                        pressed_ns: None,
                    });
                }
            }
            ("leg", Some(_)) if event.detail.get("phase").is_some_and(|p| p == "press") => {
                if let Some(stroke) = strokes.last_mut().filter(open) {
                    stroke.pressed_ns.get_or_insert(event.host_ns);
                }
            }
            ("stroke-end", Some(_)) => {
                if let Some(stroke) = strokes.last_mut().filter(open) {
                    stroke.ended_ns = Some(event.host_ns);
                }
            }
            _ => {}
        }
    }
    strokes
}

/// A position of the stage at a time (s) in the phantom frame (m).
pub(super) type Placed = (f64, Vec3);

/// One contact with the displacement of the tip from the site (m) at each report in it, its first and last instant among them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Contact {
    pub(super) start_s: f64,
    pub(super) end_s: f64,
    pub(super) rows: Vec<(f64, Vec3)>,
}

/// The contact of a stroke; none where the stage never passed the site, or was not seen to come back. `path`: reports during the stroke.
pub(super) fn contact(stroke: &Stroke, path: &[Placed]) -> Option<Contact> {
    let depth = |placed: &Placed| (placed.1 - stroke.site).dot(&stroke.direction);
    let passes = |a: &Placed, b: &Placed| {
        let (da, db) = (depth(a), depth(b));
        let share = da / (da - db);
        (a.0 + share * (b.0 - a.0), a.1 + (b.1 - a.1) * share - stroke.site)
    };
    let first = path.windows(2).position(|w| depth(&w[0]) <= 0.0 && depth(&w[1]) > 0.0)?;
    let last = path.windows(2).rposition(|w| depth(&w[0]) > 0.0 && depth(&w[1]) <= 0.0)?;
    if last < first {
        return None;
    }
    let (begins, ends) = (passes(&path[first], &path[first + 1]), passes(&path[last], &path[last + 1]));
    let mut rows = vec![begins];
    rows.extend(
        path[first + 1..=last]
            .iter()
            .map(|p| (p.0, p.1 - stroke.site))
            .filter(|r| r.0 > begins.0 && r.0 < ends.0),
    );
    rows.push(ends);
    Some(Contact { start_s: begins.0, end_s: ends.0, rows })
}

/// From when to when (s) a stroke that was not finished had the tip in the phantom, of all reports between two times; to the end of time
/// where it was not seen to come out.
pub(super) fn inside(stroke: &Stroke, path: &[Placed], from_s: f64, to_s: f64) -> Option<[f64; 2]> {
    let depth = |placed: &Placed| (placed.1 - stroke.site).dot(&stroke.direction);
    let during = || path.iter().filter(|p| p.0 >= from_s && p.0 < to_s);
    let mut within = during().filter(|p| depth(p) > 0.0);
    let first = within.next()?;
    let last = within.next_back().unwrap_or(first);
    // Contact lies between two reports: those outside it are safe.
    let before = during().take_while(|p| p.0 < first.0).last().map_or(from_s, |p| p.0);
    let after = during().find(|p| p.0 > last.0).map_or(to_s, |p| p.0);
    Some([before, after])
}

/// The stage's position in the phantom frame.
pub(super) fn placed(mounting: &Mounting, time_s: f64, position_m: [f64; crate::device::AXES]) -> Placed {
    (time_s, mounting.tip_at(position_m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::HostTime;

    fn stroke() -> Stroke {
        Stroke {
            poke: 1,
            site: Vec3::new(0.04, 0.05, 0.025),
            direction: Vec3::new(0.0, 0.0, -1.0),
            radius_m: 0.008,
            began_ns: 0,
            ended_ns: Some(1),
            pressed_ns: None,
        }
    }

    /// 1 mm above the site, 2 mm/s down for 1.5 s, hold 1 s, and back: contact from 0.5 s to 3.5 s.
    #[test]
    fn contact_lasts_while_the_stage_is_past_the_site() {
        let height = |t: f64| 0.001 - 0.002 * t.min(1.5).min(4.0 - t);
        let path: Vec<Placed> = (0..=40)
            .map(|n| f64::from(n) * 0.1 + 0.013)
            .filter(|&t| t <= 4.0)
            .map(|t| (t, stroke().site + Vec3::z() * height(t)))
            .collect();
        let contact = contact(&stroke(), &path).expect("contact");
        assert!((contact.start_s - 0.5).abs() < 1e-12 && (contact.end_s - 3.5).abs() < 1e-12);
        assert!(contact.rows[0].1.norm() < 1e-15 && contact.rows[contact.rows.len() - 1].1.norm() < 1e-15);
        let deepest = contact.rows.iter().map(|r| -r.1.z).fold(0.0, f64::max);
        assert!((deepest - 0.002).abs() < 1e-12);
        assert!(contact.rows.windows(2).all(|w| w[0].0 < w[1].0));
        assert_eq!(super::contact(&stroke(), &path[..20]), None, "never came back");
    }

    #[test]
    fn a_stroke_that_was_not_finished_was_inside_from_its_first_report_there_to_the_one_that_is_out() {
        let at = |t: f64, height: f64| (t, stroke().site + Vec3::z() * height);
        let path =
            [at(0.0, 1e-3), at(0.1, 1e-4), at(0.2, -1e-3), at(0.3, -2e-3), at(0.4, -1e-4), at(0.5, 1e-4)];
        assert_eq!(inside(&stroke(), &path, 0.0, 9.0), Some([0.1, 0.5]));
        assert_eq!(inside(&stroke(), &path[..5], 0.0, f64::INFINITY), Some([0.1, f64::INFINITY]));
        assert_eq!(inside(&stroke(), &path[..2], 0.0, 9.0), None);
    }

    #[test]
    fn strokes_are_read_from_the_events_and_an_unfinished_one_is_known() {
        let event = |ns: u64, name: &str, poke, detail: serde_json::Value| {
            let mut event = Event::new(HostTime::from_nanos(ns), name);
            event.poke = poke;
            event.detail = detail.as_object().cloned().unwrap_or_default();
            event
        };
        let place = serde_json::json!({"site_m": [0.04, 0.05, 0.025], "direction": [0.0, 0.0, -1.0], "radius_m": 0.008});
        let found = strokes(
            [
                event(10, "stroke", Some(1), place.clone()),
                event(11, "leg", Some(1), serde_json::json!({"phase": "approach"})),
                event(12, "leg", Some(1), serde_json::json!({"phase": "press"})),
                event(19, "stroke-end", Some(1), serde_json::json!({})),
                event(20, "stroke", None, place.clone()),
                event(30, "stroke", Some(2), place),
            ]
            .into_iter(),
        );
        let times: Vec<_> = found.iter().map(|s| (s.poke, s.began_ns, s.pressed_ns, s.ended_ns)).collect();
        assert_eq!(times, [(1, 10, Some(12), Some(19)), (2, 30, None, None)]);
    }
}
