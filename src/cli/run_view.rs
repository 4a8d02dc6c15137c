//! A run as a person at the bench sees it: force trace, poke, depth, time left, what was lost, and how to stop.

use crate::acquire::{Doing, RunStatus, TRACE};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Dataset, Gauge, GraphType, Paragraph, Wrap};
use std::time::Duration;

/// What does not change during a run.
pub(super) struct Title {
    /// Protocol and rig.
    pub(super) text: String,
    /// Largest force that is allowed, along the axis that allows least (N).
    pub(super) limit_n: f64,
    /// Whether there is a camera whose pictures can be asked for.
    pub(super) pictures: bool,
    /// What became of the last that was asked for.
    pub(super) note: String,
}

/// Draws the whole screen.
pub(super) fn draw(frame: &mut Frame, title: &Title, status: &RunStatus) {
    let mut outer =
        Block::bordered().title(format!(" {} ", title.text)).title_bottom(keys(status, title.pictures));
    if !title.note.is_empty() {
        outer = outer.title_bottom(Line::raw(format!(" {} ", title.note)).right_aligned());
    }
    let inside = outer.inner(frame.area());
    frame.render_widget(outer, frame.area());
    let [head, bar, trace, readings, message] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Min(4),
        Constraint::Length(2),
        Constraint::Length(2),
    ])
    .areas(inside);
    frame.render_widget(Paragraph::new(heading(status)), head);
    let total = status.elapsed + status.left;
    let share = if total.is_zero() { 0.0 } else { status.elapsed.as_secs_f64() / total.as_secs_f64() };
    let gauge = Gauge::default()
        .ratio(share.clamp(0.0, 1.0))
        .label(format!("{} gone, {} left", clock(status.elapsed), clock(status.left)))
        .gauge_style(Style::new().fg(Color::Cyan).bg(Color::Reset))
        .use_unicode(true);
    frame.render_widget(gauge, bar);
    draw_trace(frame, trace, title, status);
    frame.render_widget(Paragraph::new(numbers(status)), readings);
    let style = if status.tripped.is_some() {
        Style::new().fg(Color::Red).add_modifier(Modifier::BOLD)
    } else {
        Style::new()
    };
    frame.render_widget(Paragraph::new(words(status)).style(style).wrap(Wrap { trim: true }), message);
}

fn keys(status: &RunStatus, pictures: bool) -> Line<'static> {
    let text = match status.doing {
        Doing::Asking => " Enter: go on · space, q or Ctrl-C: STOP ",

        Doing::Done => " any key: close ",
        _ if pictures => " space, q or Ctrl-C: STOP · p: picture ",
        _ => " space, q or Ctrl-C: STOP ",
    };
    Line::from(Span::styled(text, Style::new().add_modifier(Modifier::REVERSED)))
}

fn heading(status: &RunStatus) -> Line<'static> {
    let bold = Style::new().add_modifier(Modifier::BOLD);
    let depth = status.depth_m.map(|d| format!("   depth {:.2} mm", d * 1e3)).unwrap_or_default();
    let mut spans = vec![Span::styled(status.doing.word(), bold), Span::raw(depth)];
    if status.poke > 0 {
        let poke = Span::styled(format!("{} of {}", status.poke, status.pokes), bold);
        spans.splice(0..0, [Span::raw("poke "), poke, Span::raw("   ")]);
    }
    Line::from(spans)
}

fn draw_trace(frame: &mut Frame, area: Rect, title: &Title, status: &RunStatus) {
    // The latest point stands at the right edge, however many there are yet.
    let points: Vec<(f64, f64)> = status
        .trace
        .iter()
        .rev()
        .enumerate()
        .map(|(ago, force)| ((TRACE - 1 - ago) as f64, *force))
        .collect();
    let highest = status.trace.iter().copied().fold(0.0, f64::max);
    // Whole steps, so that the axis does not breathe; the limit comes into sight when it is near.
    let top = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0]
        .into_iter()
        .find(|&t| highest < 0.95 * t)
        .unwrap_or(highest * 1.1);
    let width = (TRACE - 1) as f64;
    let limit = [(0.0, title.limit_n), (width, title.limit_n)];
    let mut lines = vec![
        Dataset::default()
            .name("force")
            .marker(Marker::Braille)
            .graph_type(GraphType::Line)
            .style(Style::new().fg(Color::Green))
            .data(&points),
    ];
    if title.limit_n <= top {
        let red = Style::new().fg(Color::Red);
        lines.push(
            Dataset::default()
                .name("limit")
                .marker(Marker::Dot)
                .graph_type(GraphType::Line)
                .style(red)
                .data(&limit),
        );
    }
    let chart = Chart::new(lines)
        .x_axis(Axis::default().bounds([0.0, width]).labels(["10 s ago", "now"]))
        .y_axis(Axis::default().bounds([0.0, top]).labels(["0 N".to_owned(), format!("{top} N")]))
        .legend_position(None);
    frame.render_widget(chart, area);
}

fn numbers(status: &RunStatus) -> Vec<Line<'static>> {
    let w = status.wrench;
    let losses = status.losses;
    let lost = losses.lost + losses.malformed + status.dropped;
    let style = if lost > 0 { Style::new().fg(Color::Yellow) } else { Style::new() };
    vec![
        Line::raw(format!(
            "Fx {:+7.3} N  Fy {:+7.3} N  Fz {:+7.3} N   Tx {:+7.2}  Ty {:+7.2}  Tz {:+7.2} mN·m",
            w[0],
            w[1],
            w[2],
            w[3] * 1e3,
            w[4] * 1e3,
            w[5] * 1e3
        )),
        Line::styled(
            format!(
                "{} force records, {} lost, {} twice, {} late, {} not recorded; {} frames",
                losses.received,
                losses.lost,
                losses.duplicated,
                losses.reordered,
                status.dropped,
                status.frames
            ),
            style,
        ),
    ]
}

fn words(status: &RunStatus) -> String {
    match status.tripped {
        Some(tripped) => format!("STOPPED: {}. {}", tripped.cause, status.message),
        None => status.message.clone(),
    }
}

/// Minutes and seconds.
pub(super) fn clock(time: Duration) -> String {
    let seconds = time.as_secs();
    format!("{}:{:02}", seconds / 60, seconds % 60)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acquire::{Cause, Phase, Tripped};
    use crate::clock::HostTime;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    fn screen(status: &RunStatus) -> String {
        let mut terminal = Terminal::new(TestBackend::new(84, 18)).expect("a screen");
        let title = Title {
            text: "five pokes · simulated bench".to_owned(),
            limit_n: 4.0,
            pictures: true,
            note: "picture: monday-live.png".to_owned(),
        };
        terminal.draw(|frame| draw(frame, &title, status)).expect("drawn");
        terminal.backend().to_string()
    }

    /// Dots of the trace, in Braille, in the left and in the right half of the screen.
    fn dots(shown: &str) -> [usize; 2] {
        let count = |from, many| {
            let dots = |c: &char| ('\u{2801}'..='\u{28FF}').contains(c);
            shown.lines().flat_map(|line| line.chars().skip(from).take(many)).filter(dots).count()
        };
        [count(0, 42), count(42, 50)]
    }

    #[test]
    fn the_latest_force_stands_at_the_right_edge() {
        let mut status = RunStatus { doing: Doing::Homing, ..RunStatus::default() };
        status.trace.extend([0.3; 30]);
        let shown = screen(&status);
        assert!(!shown.contains("poke 0"), "none has begun:\n{shown}");
        let [left, right] = dots(&shown);
        assert!(left == 0 && right > 5, "{left} {right}:\n{shown}");
        status.trace.extend([0.3; TRACE]);
        status.trace.drain(TRACE..);
        let [left, _] = dots(&screen(&status));
        assert!(left > 25, "{left}");
    }

    #[test]
    fn what_a_technician_asks_is_on_the_screen() {
        let mut status = RunStatus {
            doing: Doing::Leg(Phase::Press),
            poke: 2,
            pokes: 5,
            depth_m: Some(0.00183),
            elapsed: Duration::from_secs(63),
            left: Duration::from_secs(42),
            wrench: [0.012, -0.003, 0.847, 0.0, 0.001, 0.0],
            ..RunStatus::default()
        };
        status.trace.extend((0..200).map(|n| 0.8 * (f64::from(n) / 30.0).sin().abs()));
        status.losses.received = 441_000;
        let shown = screen(&status);
        for words in [
            "poke 2 of 5",
            "press",
            "depth 1.83 mm",
            "0:42 left",
            "+0.847 N",
            "0 lost",
            "STOP",
            "1 N",
            "p: picture",
            "monday-live.png",
        ] {
            assert!(shown.contains(words), "{words} is missing:\n{shown}");
        }
        let seen = HostTime::from_nanos(1);
        let cause = Cause::Limit { axis: 2, value: 4.012, limit: 4.0 };
        status.tripped = Some(Tripped { cause, seen, sent: Some(seen) });
        status.doing = Doing::Stopped;
        let shown = screen(&status);
        assert!(shown.contains("STOPPED: Fz of the sensor is 4.012 N; the limit is 4.000 N"), "{shown}");
        if std::env::var_os("SHOW").is_some() {
            println!("{shown}");
        }
    }
}
