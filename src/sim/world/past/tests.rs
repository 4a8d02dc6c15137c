//! What is seen of a session against what its markers do, which are watched themselves.

use super::super::effect::Effect;
use super::super::large::{Large, StiffeningLaw};
use super::super::live::Live;
use super::super::phantom::PhantomPlan;
use super::super::record::tests::world;
use super::super::rig::Rig;
use super::*;
use crate::geometry::Triangle;
use crate::sim::skin::{Skin, SkinCut};
use std::sync::OnceLock;

/// The small phantom with many markers and a skin, made once for all tests here.
fn phantom() -> &'static Phantom {
    static PHANTOM: OnceLock<Phantom> = OnceLock::new();
    PHANTOM.get_or_init(|| {
        let plan = PhantomPlan { marker_spacing_m: 0.003, ..world(Vec::new()).phantom };
        Phantom::prepare_seen(&plan, &SkinCut::default()).expect("a sound plan")
    })
}

fn seen(effects: Vec<Effect>) -> World {
    World { phantom: phantom().plan.clone(), ..world(effects) }
}

/// Displacement of a place on the resting skin (m), linear over its triangle.
fn between(skin: &Skin, moved: &[Vec3], place: [f64; 3]) -> Vec3 {
    let corners = |of: &dyn Fn(u32) -> Vec3, t: &[u32; 3]| Triangle(t.map(of));
    let rest = |v: u32| Vec3::from(skin.points_m[v as usize]);
    let point = Vec3::from(place);
    let nearest = skin
        .triangles
        .iter()
        .map(|t| (t, corners(&rest, t).nearest(&point)))
        .min_by(|a, b| (a.1.position - point).norm().total_cmp(&(b.1.position - point).norm()))
        .expect("a skin");
    assert!((nearest.1.position - point).norm() < 1e-9);
    corners(&|v| moved[v as usize], nearest.0).at(nearest.1.barycentric)
}

/// At 3 mm of depth, small strain and large: every marker from 2 mm off the rim of the tip on moves as the triangle does on which it is
/// painted, to 0.01 mm; nearer to the rim, where the slope of the surface has no bound, to 0.04 mm.
#[test]
fn displacements_between_vertices_are_those_of_markers() {
    let stiffening = Large::StrainStiffening { law: StiffeningLaw::Fung, stiffening: 2.0 };
    for effects in [vec![], vec![Effect::Large(stiffening)]] {
        let world = seen(effects);
        let past = world.happen(phantom()).expect("a session");
        let skin = phantom().skin().expect("a skin");
        let mut worst = [0.0_f64; 2];
        for (poke, scheduled) in past.timeline.pokes.iter().enumerate() {
            let time_s = 0.5 * (scheduled.start_s + scheduled.end_s);
            let (glimpse, site) = (past.glimpse(time_s, false).expect("a skin"), scheduled.plan.site_m);
            let exact = past.happened.moved_at(time_s);
            for (marker, &place) in phantom().markers().iter().enumerate() {
                let apart = (Vec3::from(place) - Vec3::from(site)).norm() - scheduled.plan.radius_m;
                let exact = Vec3::from_column_slice(&exact.as_slice()[3 * marker..3 * marker + 3]);
                let off = (between(skin, &glimpse.moved_m, place) - exact).norm();
                if apart > 0.0 {
                    let class = usize::from(apart < 0.002);
                    worst[class] = worst[class].max(off);
                }
            }
            assert_eq!(glimpse.tip.map(|t| t.radius_m), Some(scheduled.plan.radius_m), "poke {poke}");
        }
        println!("off by {:.1} µm at most, {:.1} µm within 2 mm of a rim", worst[0] * 1e6, worst[1] * 1e6);
        assert!(worst[0] < 1e-5 && worst[1] < 4e-5, "{worst:?}");
    }
}

/// A skin costs time and changes nothing else.
#[test]
fn a_session_that_is_seen_is_the_same_session() {
    let world = seen(vec![]);
    let bare = Phantom::prepare(&world.phantom).expect("a phantom");
    assert!(bare.skin().is_none() && world.happen(&bare).expect("a session").glimpse(1.0, false).is_none());
    let (recorded, watched) = (world.record(&bare).expect("rows"), world.record(phantom()).expect("rows"));
    assert_eq!(recorded.wrench, watched.wrench);
    assert_eq!(recorded.markers, watched.markers);
}

/// The tip's face is where the stage takes it, less what the stage gives, is late and lags; the skin moves as fast as it does from one
/// instant to another; a bench that goes on shows the same.
#[test]
fn the_tip_is_where_it_is_and_a_live_bench_shows_the_same() {
    let (gap_m, lag_s, compliance_m_per_n) = (4e-4, 0.02, 1e-3);
    let world = seen(vec![
        Effect::Rig(Rig::LateContact { gap_m }),
        Effect::Rig(Rig::CameraLag { lag_s }),
        Effect::Rig(Rig::StageCompliance { compliance_m_per_n }),
    ]);
    let past = world.happen(phantom()).expect("a session");
    let mut live = Live::new(world.clone(), phantom(), 0.0).expect("a bench");
    let poke = &past.timeline.pokes[0];
    let (site, direction) = (Vec3::from(poke.plan.site_m), Vec3::from(poke.plan.direction));
    let reported = |at_s: f64| match past.timeline.at(at_s) {
        Some((_, depth)) => site + direction * depth,
        None => site - direction * (0.001 * (poke.start_s - at_s).max(at_s - poke.end_s)),
    };
    // On the way in, at the end of the hold, on the way out.
    for time_s in [poke.start_s + 0.4, poke.start_s + 1.2, poke.end_s - 0.2] {
        while live.time_s() < time_s - 5e-4 {
            live.advance(live.time_s() + 5e-4, |at_s| reported(at_s).into()).expect("a step");
        }
        let (then, now) =
            (past.glimpse(time_s, true).expect("a skin"), live.glimpse(time_s, true).expect("a skin"));
        assert!((then.time_s - (time_s - lag_s)).abs() < 1e-12 && (now.time_s - then.time_s).abs() < 1e-9);
        let depth = past.timeline.at(then.time_s).expect("a poke").1 - gap_m;
        let give = compliance_m_per_n * past.happened.force_at(then.time_s).dot(&direction);
        let (old, new) = (then.tip.expect("a tip"), now.tip.expect("a tip"));
        assert!((old.face_m - site - direction * (depth - give)).norm() < 1e-6, "{:?}", old.face_m);
        assert!((old.face_m - new.face_m).norm() < 5e-6, "{:?} and {:?}", old.face_m, new.face_m);
        assert!((old.outward + direction).norm() < 1e-12);
        let apart = then.moved_m.iter().zip(&now.moved_m).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(apart < 1e-5, "{apart} m at {time_s} s");
        let later = past.glimpse(time_s + 0.01, false).expect("a skin");
        let speeds = then.speed_m_s.expect("asked for");
        for ((a, b), v) in then.moved_m.iter().zip(&later.moved_m).zip(speeds) {
            assert!(((b - a) / 0.01 - v).norm() < 2e-4, "{v:?}");
        }
    }
}
