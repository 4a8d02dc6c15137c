//! What `check` says to people: one block of lines a topic, lengths in millimetres.

use crate::dataset::{ChannelSurvey, RestNoise, Survey, Suspicion};
use crate::observation::{Contact, Recording, TipShape};
use crate::units::pascals;
use std::fmt::Write;

/// Describes a bundle that has been read.
pub(super) fn describe(
    recording: &Recording,
    survey: &Survey,
    noise: &RestNoise,
    suspicions: &[Suspicion],
) -> String {
    let verdict = match suspicions.len() {
        0 => "sound".to_owned(),
        1 => "readable, with 1 suspicion".to_owned(),
        n => format!("readable, with {n} suspicions"),
    };
    let mut text = format!("{}: {verdict}\n", recording.name);
    // Writing to a String can't fail.
    let _ = phantom(&mut text, recording, survey);
    let _ = pokes(&mut text, survey);
    let _ = sampling(&mut text, recording, survey);
    let _ = rest(&mut text, recording, survey, noise);
    if !suspicions.is_empty() {
        text += "\nsuspicions\n";
        for suspicion in suspicions {
            let _ = writeln!(text, "  - {suspicion}");
        }
    }
    text.truncate(text.trim_end().len());
    text
}

fn phantom(text: &mut String, recording: &Recording, survey: &Survey) -> std::fmt::Result {
    let phantom = &recording.phantom;
    let [low, high] = phantom.modulus_range_pa;
    let [x, y, z] = survey.mesh.extent_m.map(|l| 1e3 * l);
    writeln!(text, "\nphantom    {x:.1} × {y:.1} × {z:.1} mm, {:.1} cm³", 1e6 * survey.mesh.volume_m3)?;
    writeln!(
        text,
        "           Poisson's ratio {}, {} kg/m³, modulus expected from {} to {}",
        phantom.poisson_ratio,
        phantom.density_kg_m3,
        pascals(low),
        pascals(high)
    )?;
    if let Some(gravity) = phantom.gravity {
        let [x, y, z] = <[f64; 3]>::from(gravity.acceleration_m_s2);
        let when = if gravity.at_rest { "already at rest" } else { "in the load intervals" };
        writeln!(text, "           weight acts {when}: ({x}, {y}, {z}) m/s²")?;
    }
    writeln!(text, "mesh       {} nodes, {} tetrahedra", survey.mesh.nodes, survey.mesh.tetrahedra)?;
    for (name, surface) in &survey.mesh.surfaces {
        writeln!(text, "  {name:<9}{} triangles, {:.2} cm²", surface.triangles, 1e4 * surface.area_m2)?;
    }
    let contact = match recording.tip.contact {
        Contact::Bonded => "bonded",
        Contact::Unilateral => "unilateral",
    };
    match recording.tip.shape {
        TipShape::Pad => writeln!(text, "tip        {contact} pad"),
        TipShape::Flat => writeln!(text, "tip        {contact} flat face"),
        TipShape::Sphere { radius_m } => {
            writeln!(text, "tip        {contact} sphere, radius {:.3} mm", 1e3 * radius_m)
        }
    }
}

fn pokes(text: &mut String, survey: &Survey) -> std::fmt::Result {
    writeln!(
        text,
        "\n poke      site (mm)             direction          radius (mm)     time (s)      depth (mm)        force (N)     rows  frames"
    )?;
    for p in &survey.pokes {
        let [x, y, z] = p.site_m.map(|l| 1e3 * l);
        let [dx, dy, dz] = p.direction;
        let range =
            |r: Option<[f64; 2]>, scale: f64| r.map_or("–".to_owned(), |[a, b]| span(a * scale, b * scale));
        writeln!(
            text,
            "{:>5}  {x:>6.1} {y:>6.1} {z:>6.1}   {dx:>6.3} {dy:>6.3} {dz:>6.3} {:>9.2}   {:>14} {:>15} {:>16} {:>8} {:>7}",
            p.poke,
            1e3 * p.radius_m,
            format!("{:.2} … {:.2}", p.start_s, p.end_s),
            range(p.depth_m, 1e3),
            range(p.force_n, 1.0),
            p.force_rows,
            p.frames
        )?;
    }
    if survey.stage.is_none() {
        writeln!(text, "  no stage.csv: the wrench drives the model")?;
    }
    Ok(())
}

fn span(low: f64, high: f64) -> String {
    // Noise around zero must not print as -0.00.
    let tidy = |v: f64| if v.abs() < 5e-4 { 0.0 } else { v };
    format!("{:.3} … {:.3}", tidy(low), tidy(high))
}

fn sampling(text: &mut String, recording: &Recording, survey: &Survey) -> std::fmt::Result {
    writeln!(text, "\nsampling")?;
    let channels = [("stage", survey.stage), ("force", Some(survey.force)), ("markers", Some(survey.frames))];
    for (name, channel) in channels {
        if let Some(channel) = channel {
            writeln!(text, "  {name:<9}{}", sampled(&channel))?;
        }
    }
    let markers = &survey.markers;
    writeln!(
        text,
        "  {} markers, {} rows; {:.2} % occluded, most often marker {} ({:.2} %)",
        markers.markers,
        markers.rows,
        1e2 * markers.occluded,
        markers.worst_marker,
        1e2 * markers.worst_occluded
    )?;
    writeln!(
        text,
        "  a marker may stand off the observed surface by {:.1} mm",
        1e3 * recording.max_standoff_m
    )
}

fn sampled(channel: &ChannelSurvey) -> String {
    let rate = channel.rate_hz.map_or("a single row".to_owned(), |r| format!("{r:.1} Hz"));
    let longest = channel.longest_spacing_in_pokes_s;
    let gaps = match channel.gaps_in_pokes {
        0 => "no gap in a poke".to_owned(),
        1 => format!("1 gap in a poke of {longest:.3} s: nothing is interpolated across"),
        n => format!("{n} gaps in pokes, the longest {longest:.3} s: nothing is interpolated across"),
    };
    let missing = match channel.missing_in_pokes {
        None | Some(0) => String::new(),
        Some(1) => ", 1 instant missing in a poke".to_owned(),
        Some(n) => format!(", {n} instants missing in pokes"),
    };
    format!("{} instants at {rate}, {gaps}{missing}", channel.rows)
}

fn rest(text: &mut String, recording: &Recording, survey: &Survey, noise: &RestNoise) -> std::fmt::Result {
    writeln!(
        text,
        "\nrest       until {} s: {} frames, every marker in at least {}",
        (1e3 * recording.rest_until_s).round() / 1e3,
        survey.markers.rest_frames,
        survey.markers.fewest_rest_rows
    )?;
    writeln!(text, "  noise    measured (stated) along x, y, z")?;
    for (name, channel) in noise.channels() {
        let (scale, unit) = match name {
            "force" => (1e3, "mN"),
            "torque" => (1e6, "µN·m"),
            _ => (1e6, "µm"),
        };
        write!(text, "  {name:<9}")?;
        for (measured, stated) in channel.measured.into_iter().zip(channel.stated) {
            write!(text, "{:.3} ({:.3}), ", scale * measured, scale * stated)?;
        }
        text.truncate(text.len() - 2);
        writeln!(text, " {unit}")?;
    }
    Ok(())
}
