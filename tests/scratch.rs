//! scratch
use phantom_rig::inverse::*;
use std::path::Path;
#[test]
fn study() {
    let which = std::env::var("WHICH").unwrap_or("practice-01".into());
    for name in which.split(',') {
        let (rec, _) =
            phantom_rig::dataset::read_bundle(&Path::new("/work/shared/practice").join(name)).unwrap();
        let t = std::time::Instant::now();
        let quick = std::env::var("QUICK").is_ok();
        let r = fit(&rec, &Settings { quick, ..Settings::default() }, &mut |p| {
            eprintln!("{:?} {p:?}", t.elapsed())
        });
        match r {
            Err(e) => println!("ERR {e} {e:?}"),
            Ok(f) => {
                println!(
                    "{name} {:?} E {:?} int {:?} bound {} total {:?}\n{:#?}\n{:?} {:?}\n{:#?}\n{:?}",
                    t.elapsed(),
                    f.young_modulus_pa,
                    f.young_modulus_interval90_pa,
                    f.young_modulus_bound_pa,
                    f.restraint_total_n_per_m,
                    f.patches,
                    f.residual,
                    f.discretisation,
                    f.remarks,
                    f.pokes.iter().map(|p| p.chi2_per_value).collect::<Vec<_>>()
                );
            }
        }
    }
}
