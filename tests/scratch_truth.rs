//! scratch
use phantom_rig::fem::*;
use phantom_rig::geometry::Vec3;
use phantom_rig::inverse::*;
use std::path::Path;
#[test]
fn truth() {
    let (rec, _) =
        phantom_rig::dataset::read_bundle(&Path::new("/work/shared/practice/practice-01")).unwrap();
    let ev = Evidence::new(&rec, None).unwrap();
    let m = rec.mesh.clone();
    let t = std::time::Instant::now();
    let model = Model::new(&m, Order::P2, 0.47, "fixed").unwrap();
    println!("T model {:?}", t.elapsed());
    let all: Vec<usize> = (0..model.space().faces().len()).collect();
    let tips: Vec<Spot> =
        ev.sites.iter().map(|s| Spot::disc(model.space(), &all, &s.centre, s.radius_m).unwrap()).collect();
    println!("T tips {:?}", t.elapsed());
    let markers: Vec<Spot> =
        ev.rest.iter().map(|r| Spot::marker(model.space(), &m, "observed", &r.0).unwrap().0).collect();
    println!("T markers {:?}", t.elapsed());
    let search = model.space().surface("search").to_vec();
    let bench = Bench::new(
        model,
        tips,
        markers,
        &ev.sites.iter().map(|s| s.centre).collect::<Vec<_>>(),
        Driven::ByStage,
        None,
    )
    .unwrap();
    println!("T bench {:?}", t.elapsed());
    let mut problem = Problem { evidence: &ev, bench, search, adjoint: vec![] };
    let state = State {
        modulus: 10500.0,
        patches: [0.03, 0.07]
            .iter()
            .map(|&y| Restraint {
                centre: Vec3::new(0.12, y, 0.0),
                radius_m: 0.005,
                softness: 10500.0 / 62.15,
                glued: false,
            })
            .collect(),
    };
    let lin = problem.linearise(&state).unwrap();
    println!("T lin {:?}", t.elapsed());
    problem.adjoint = problem.bench.model.respond(&problem.bench.markers.iter().collect::<Vec<_>>()).unwrap();
    println!("T adjoint {:?}", t.elapsed());
    let mounted = Mounted::new(&problem.bench, &problem.search, &state.patches).unwrap();
    println!("T mount {:?} {}", t.elapsed(), mounted.groups.len());
    let lin2 = problem.linearise(&state).unwrap();
    println!("T lin2 {:?} {}", t.elapsed(), lin2.chi2());
    println!(
        "chi2 {} n {} force {}",
        lin.chi2(),
        lin.residual.len(),
        lin.residual.rows(0, 12).norm_squared()
    );
    // Taylor
    let state = State {
        modulus: 9500.0,
        patches: vec![
            Restraint {
                centre: Vec3::new(0.113, 0.037, 0.0),
                radius_m: 0.005,
                softness: 100.0,
                glued: false,
            },
            Restraint {
                centre: Vec3::new(0.093, 0.067, 0.0),
                radius_m: 0.005,
                softness: 300.0,
                glued: false,
            },
        ],
    };
    let lin = problem.linearise(&state).unwrap();
    for (i, p) in lin.parameters.iter().enumerate() {
        for h in [1e-2_f64, 1e-3] {
            let h = if matches!(p, Parameter::Shift(..)) { h * 0.01 } else { h };
            let mut d = nalgebra::DVector::zeros(lin.parameters.len());
            d[i] = h;
            let plus = problem.linearise(&problem.moved(&lin, &d)).unwrap();
            d[i] = -h;
            let minus = problem.linearise(&problem.moved(&lin, &d)).unwrap();
            let fd = -(plus.residual - minus.residual) / (2.0 * h);
            let j = lin.jacobian.column(i);
            println!(
                "T {p:?} h {h} err {} norm {} force err {} norm {}",
                (&fd - j).norm(),
                j.norm(),
                (fd.rows(0, 12) - j.rows(0, 12)).norm(),
                j.rows(0, 12).norm()
            );
        }
    }
}
