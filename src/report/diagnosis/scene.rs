//! What the page's three-dimensional view is drawn from: the phantom at rest, where it was poked, where the mismatch
//! sits, what was found to have a place, and the next poke. Millimetres.

use super::figures::held;
use crate::diagnose::{Diagnosis, Found, Physics, Restrained};
use crate::geometry::Vec3;
use crate::mesh::MeshError;
use crate::observation::Recording;
use crate::report::page::{Columns, DiscScene, Skin, Triangles, millimetres, rounded};
use serde::Serialize;

/// The whole view.
#[derive(Serialize)]
pub(super) struct PlaceScene {
    nodes_mm: Columns,
    triangles: Triangles,
    tips: Vec<TipScene>,
    /// Where the mismatch sits.
    region: Option<BallScene>,
    /// What was found to have a place.
    balls: Vec<BallScene>,
    discs: Vec<NamedDisc>,
    /// Restraint with what is blamed.
    restraint: Vec<NamedDisc>,
    next: Option<NextScene>,
    /// Length of the arrow of the next poke (mm).
    arrow_mm: f64,
}

#[derive(Serialize)]
struct TipScene {
    numbers: Vec<u32>,
    /// Whether the mismatch shows in one of these pokes.
    shows: bool,
    disc: DiscScene,
}

#[derive(Serialize)]
struct BallScene {
    text: String,
    centre_mm: [f64; 3],
    radius_mm: f64,
}

#[derive(Serialize)]
struct NamedDisc {
    text: String,
    disc: DiscScene,
}

#[derive(Serialize)]
struct NextScene {
    disc: DiscScene,
    /// Unit vector into the phantom.
    direction: [f64; 3],
}

/// Pokes closer together than this (m) are drawn as one.
const SAME_SITE_M: f64 = 5e-4;

impl PlaceScene {
    pub(super) fn new(diagnosis: &Diagnosis, recording: &Recording) -> Result<Self, MeshError> {
        let skin = Skin::new(&recording.mesh)?;
        let (balls, discs) = places(&diagnosis.parameters, &skin);
        Ok(Self {
            nodes_mm: millimetres(skin.nodes.iter()),
            tips: tips(diagnosis, recording, &skin),
            region: diagnosis
                .mismatch
                .region
                .map(|r| ball("where the misfit sits".to_owned(), r.centroid_m, r.radius_m)),
            balls,
            discs,
            restraint: diagnosis.extended.restraint.iter().map(|patch| restrained(patch, &skin)).collect(),
            next: diagnosis.next_poke.as_ref().map(|next| &next.poke).map(|poke| NextScene {
                disc: skin.disc(&poke.site, poke.radius_m, Some(-poke.direction)),
                direction: poke.direction.into(),
            }),
            arrow_mm: rounded(120.0 * skin.diagonal(), 10.0),
            triangles: skin.triangles,
        })
    }
}

fn tips(diagnosis: &Diagnosis, recording: &Recording, skin: &Skin) -> Vec<TipScene> {
    let mut places: Vec<(Vec3, TipScene)> = Vec::new();
    for poke in &recording.pokes {
        let shows = diagnosis.mismatch.pokes.contains(&poke.number);
        match places.iter_mut().find(|(site, _)| (site - poke.site).norm() < SAME_SITE_M) {
            Some((_, tip)) => {
                tip.numbers.push(poke.number);
                tip.shows |= shows;
            }
            None => {
                let disc = skin.disc(&poke.site, poke.radius_m, Some(-poke.direction));
                places.push((poke.site, TipScene { numbers: vec![poke.number], shows, disc }));
            }
        }
    }
    places.into_iter().map(|(_, tip)| tip).collect()
}

fn restrained(patch: &Restrained, skin: &Skin) -> NamedDisc {
    NamedDisc { text: held(patch), disc: skin.disc(&patch.centroid_m, patch.radius_m, None) }
}

/// Balls in the body and discs on its base, of those entries that have a place.
fn places(found: &[Found], skin: &Skin) -> (Vec<BallScene>, Vec<NamedDisc>) {
    let (mut balls, mut discs) = (Vec::new(), Vec::new());
    let base = skin.nodes.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    for entry in found {
        let get = |id: &str| {
            let parameter = entry.parameters.iter().find(|p| p.id == id)?;
            parameter.values.first().map(|e| e.value)
        };
        let (Some(x), Some(y), Some(radius_m)) = (get("centre_x_m"), get("centre_y_m"), get("radius_m"))
        else {
            continue;
        };
        match (entry.physics, get("centre_z_m")) {
            (Physics::BaseDebonding, _) => discs.push(NamedDisc {
                text: format!("debonded, radius {:.1} mm", 1e3 * radius_m),
                disc: skin.disc(&Vec3::new(x, y, base), radius_m, Some(-Vec3::z())),
            }),
            (_, Some(z)) => {
                let ratio = get("modulus_ratio").map_or(String::new(), |r| format!(", × {r:.2}"));
                let text = format!("{}, radius {:.1} mm{ratio}", entry.physics, 1e3 * radius_m);
                balls.push(ball(text, Vec3::new(x, y, z), radius_m));
            }
            (_, None) => {}
        }
    }
    (balls, discs)
}

fn ball(text: String, centre: Vec3, radius_m: f64) -> BallScene {
    let centre_mm = <[f64; 3]>::from(centre).map(|c| rounded(1e3 * c, 1e2));
    BallScene { text, centre_mm, radius_mm: rounded(1e3 * radius_m, 1e2) }
}
